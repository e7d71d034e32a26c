"""Self-contained HTML pages: plotly.js is packed in once, nothing is fetched, every text is escaped."""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from typing import Any, Final, Literal

import numpy as np
from plotly.io.json import to_json_plotly
from plotly.offline import get_plotlyjs

from cablecomp.report import style

Tone = Literal["plain", "good", "warn", "bad"]


@dataclass(frozen=True)
class Fact:
    """A summary number on a card: label, value as shown (with unit), remark below it, tone."""

    label: str
    value: str
    remark: str = ""
    tone: Tone = "plain"


@dataclass(frozen=True)
class Section:
    """One titled part of a page; `body` is HTML made by the functions of this module, `lead` plain text."""

    title: str
    body: str
    lead: str = ""


def number(value: float | None, unit: str = "", digits: int = 3) -> str:
    """Return `value` with `digits` significant digits and its unit; None and NaN are a dash."""
    if value is None or math.isnan(value):
        return "–"
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}·10{_superscript(int(exponent))}"
    return f"{text.replace('-', '−')} {unit}".rstrip()


def paragraph(text: str) -> str:
    """Return plain text as a paragraph."""
    return f"<p>{escape(text)}</p>"


def bullets(lines: Iterable[str]) -> str:
    """Return plain lines as a list; no lines give an empty string."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def facts(cards: Iterable[Fact]) -> str:
    """Return summary numbers as a row of cards."""
    return f'<div class="facts">{"".join(_card(card) for card in cards)}</div>'


def table(headers: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """Return a table of plain cells; numbers (int, float) are set right-aligned with `number`."""
    head = "".join(f"<th>{escape(header)}</th>" for header in headers)
    body = "".join(f"<tr>{''.join(_cell(cell) for cell in row)}</tr>" for row in rows)
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    return (
        f'<div class="scroll"><table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def fold(title: str, body: str, *, opened: bool = False) -> str:
    """Return HTML folded away below a title."""
    return f"<details{' open' if opened else ''}><summary>{escape(title)}</summary>{body}</details>"


def code(text: str) -> str:
    """Return text set as it is, such as a configuration file."""
    return f"<pre>{escape(text)}</pre>"


def figure(fig: Any, caption: str = "") -> str:
    """Return a plotly figure as HTML; the page around it draws it where it stands, one folded away once it is opened."""
    data = _figure_json(fig)
    height = int(fig.layout.height or 450)
    note = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return (
        f'<figure><div class="plot" style="height:{height}px"></div>'
        f'<script type="application/json" class="plot-data">{data}</script>{note}</figure>'
    )


def _figure_json(fig: Any) -> str:
    """A figure as JSON that no text in it can end; long linear axes in 16 bits, which no screen tells from 64."""
    spec = fig.to_plotly_json()
    spec["layout"].pop("template", None)  # the page has one for all of its figures
    if not any(axis.type == "log" for axis in (*fig.select_xaxes(), *fig.select_yaxes())):
        for trace, entry in zip(fig.data, spec["data"], strict=True):
            for key in ("x", "y"):
                values = getattr(trace, key, None)
                if (
                    isinstance(values, np.ndarray)
                    and values.dtype.kind == "f"
                    and _LONG[0] < len(values) < _LONG[1]
                ):
                    entry[key] = _sixteen_bits(values)
    return str(to_json_plotly(spec)).replace("\\u002f", "/")  # `<` stays escaped


def _sixteen_bits(values: Any) -> dict[str, object]:
    """value = low + step * n with n in 0..65534; 65535 stands for what is not finite."""
    finite = np.isfinite(values)
    low = float(values[finite].min()) if finite.any() else 0.0
    width = float(values[finite].max()) - low if finite.any() else 0.0
    step = width / 65534.0 or 1.0
    steps = np.where(finite, np.round((values - low) / step), 65535).astype("<u2")
    return {"low": low, "step": step, "steps": base64.b64encode(steps.tobytes()).decode()}


def columns(*parts: str) -> str:
    """Return HTML parts side by side, one below the other on a narrow window."""
    return f'<div class="columns">{"".join(f"<div>{part}</div>" for part in parts)}</div>'


def page(title: str, lead: str, sections: Iterable[Section]) -> str:
    """Return a complete page that opens offline."""
    parts = list(sections)
    links = "".join(f'<a href="#s{i}">{escape(part.title)}</a>' for i, part in enumerate(parts))
    body = "".join(_section(i, part) for i, part in enumerate(parts))
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{CSS}</style>{_library(body)}</head>"
        f'<body><header><h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p><nav>{links}</nav></header>'
        f"<main>{body}</main><script>{_DRAW}</script></body></html>\n"
    )


def _library(body: str) -> str:
    return f'<script type="text/plain" id="plotly">{_packed()}</script>' if "plot-data" in body else ""


@cache
def _packed() -> str:
    """plotly.js, zlib in base 85: 1.8 MB in place of 4.8."""
    return base64.b85encode(zlib.compress(get_plotlyjs().encode(), 9)).decode()


def _section(index: int, section: Section) -> str:
    lead = f'<p class="lead">{escape(section.lead)}</p>' if section.lead else ""
    return f'<section id="s{index}"><h2>{escape(section.title)}</h2>{lead}{section.body}</section>'


def _card(card: Fact) -> str:
    remark = f'<span class="remark">{escape(card.remark)}</span>' if card.remark else ""
    return (
        f'<div class="fact {card.tone}"><span class="label">{escape(card.label)}</span>'
        f'<span class="value">{escape(card.value)}</span>{remark}</div>'
    )


def _cell(cell: object) -> str:
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return f'<td class="number">{escape(number(cell, digits=5))}</td>'
    return f"<td>{escape(str(cell))}</td>"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


_LONG: Final = (64, 16_384)
"""Lengths between which an array is worth packing, and 65 534 steps are finer than its points."""
_CONFIG: Final = json.dumps({
    "displaylogo": False, "responsive": True, "toImageButtonOptions": {"format": "svg"},
    "modeBarButtonsToRemove": ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d"],
})  # fmt: skip
_DRAW: Final = """
(async () => {
  const unpack = async (text) => {  // base 85 of RFC 1924, then zlib
    const digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
    const value = new Uint8Array(128);
    for (let i = 0; i < 85; i++) value[digits.charCodeAt(i)] = i;
    const pad = (5 - text.length % 5) % 5, padded = text + "~".repeat(pad);
    const bytes = new Uint8Array(padded.length / 5 * 4), view = new DataView(bytes.buffer);
    for (let i = 0, j = 0; i < padded.length; i += 5, j += 4) {
      let word = 0;
      for (let k = 0; k < 5; k++) word = word * 85 + value[padded.charCodeAt(i + k)];
      view.setUint32(j, word);
    }
    const stream = new Blob([bytes.subarray(0, bytes.length - pad)]).stream();
    return new Response(stream.pipeThrough(new DecompressionStream("deflate"))).text();
  };
  const notes = [...document.querySelectorAll("script.plot-data")];
  if (!notes.length) return;
  if (!("DecompressionStream" in window)) {
    for (const note of notes) note.previousElementSibling.textContent = "This browser is too old to draw figures.";
    return;
  }
  const library = document.createElement("script");
  library.textContent = await unpack(document.getElementById("plotly").textContent);
  document.head.append(library);
  const numbers = (packed) => {
    const bytes = Uint8Array.from(atob(packed.steps), (c) => c.charCodeAt(0));
    return Float64Array.from(new Uint16Array(bytes.buffer), (n) => (n < 65535 ? packed.low + packed.step * n : NaN));
  };
  const draw = (note) => {
    const { data, layout } = JSON.parse(note.textContent);
    layout.template = TEMPLATE;
    for (const trace of data)
      for (const key of ["x", "y"]) if (trace[key]?.steps) trace[key] = numbers(trace[key]);
    Plotly.newPlot(note.previousElementSibling, data, layout, CONFIG);
  };
  for (const note of notes) {
    const folded = note.closest("details:not([open])");
    if (folded) folded.addEventListener("toggle", () => draw(note), { once: true });
    else draw(note);
  }
  document.body.dataset.drawn = "yes";
})();
""".replace("CONFIG", _CONFIG).replace("TEMPLATE", json.dumps(style.template().to_plotly_json()))

CSS = f"""
:root {{ color-scheme: light; }}
* {{ box-sizing: border-box; }}
body {{ margin: 0; background: #f4f6f9; color: {style.INK}; font: 15px/1.55 {style.FONT}; }}
header, main {{ max-width: 1240px; margin: 0 auto; padding: 0 24px; }}
header {{ padding-top: 32px; }}
h1 {{ font-size: 27px; line-height: 1.25; margin: 0 0 6px; letter-spacing: -0.01em; }}
h2 {{ font-size: 19px; margin: 0 0 8px; }}
p {{ margin: 0 0 10px; }}
.lead {{ color: {style.MUTED}; max-width: 120ch; }}
nav {{ display: flex; flex-wrap: wrap; gap: 6px 18px; margin: 10px 0 18px; font-size: 14px; }}
a {{ color: {style.PREDICTED}; text-decoration: none; }} a:hover {{ text-decoration: underline; }}
section {{ background: {style.PAPER}; border: 1px solid {style.RULE}; border-radius: 10px; padding: 20px 22px;
  margin: 0 0 18px; scroll-margin-top: 8px; }}
.facts {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(190px, 1fr)); gap: 12px; }}
.fact {{ border: 1px solid {style.RULE}; border-left: 4px solid #94a3b8; border-radius: 8px;
  padding: 10px 12px; }}
.fact.good {{ border-left-color: #0b8a6f; }} .fact.warn {{ border-left-color: #b7791f; }}
.fact.bad {{ border-left-color: #c8102e; }}
.fact span {{ display: block; }}
.fact .label {{ color: {style.MUTED}; font-size: 13px; }}
.fact .value {{ font-size: 20px; font-weight: 600; font-variant-numeric: tabular-nums;
  line-height: 1.25; overflow-wrap: anywhere; }}
.fact .remark {{ color: {style.MUTED}; font-size: 12.5px; line-height: 1.35; }}
.columns {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(min(440px, 100%), 1fr)); gap: 18px; }}
.columns > div {{ min-width: 0; }}
figure {{ margin: 0 0 8px; }} figcaption {{ color: {style.MUTED}; font-size: 13.5px; margin: 2px 0 8px; }}
.scroll {{ overflow-x: auto; }}
table {{ border-collapse: collapse; font-size: 14px; margin: 4px 0 10px; }}
caption {{ text-align: left; color: {style.MUTED}; padding-bottom: 4px; }}
th, td {{ padding: 5px 16px 5px 0; border-bottom: 1px solid {style.RULE}; text-align: left; }}
th {{ color: {style.MUTED}; font-weight: 600; }}
td.number {{ text-align: right; font-variant-numeric: tabular-nums; }}
details {{ margin: 6px 0; }} summary {{ cursor: pointer; font-weight: 600; }}
pre {{ font: 13px/1.5 {style.MONO}; background: #f8fafc; border: 1px solid {style.RULE}; border-radius: 8px;
  padding: 12px 14px; overflow-x: auto; }}
ul {{ margin: 4px 0 10px; padding-left: 22px; }}
"""
