"""Self-contained HTML pages: plotly.js is packed in once, nothing is fetched, every text is escaped."""

from __future__ import annotations

import base64
import json
import math
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
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
    return f"{typeset(f'{value:.{digits}g}')} {unit}".rstrip()


def typeset(text: str) -> str:
    """Return numbers in a text with powers of ten and minus signs as they are printed."""
    return re.sub(r"e([+-]\d+)", lambda m: f"·10{_superscript(int(m[1]))}", text).replace("-", "−")


def paragraph(text: str) -> str:
    """Return plain text as a paragraph."""
    return f"<p>{_words(text)}</p>"


def bullets(lines: Iterable[str]) -> str:
    """Return plain lines as a list; no lines give an empty string."""
    items = "".join(f"<li>{_words(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def facts(cards: Iterable[Fact]) -> str:
    """Return summary numbers as a row of cards."""
    return f'<div class="facts">{"".join(_card(card) for card in cards)}</div>'


def table(headers: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """Return a table of plain cells; numbers (int, float) are set right-aligned with `number`."""
    head = "".join(f"<th>{_breakable(escape(header))}</th>" for header in headers)
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


def figure(fig: Any, caption: str = "", least_px: int = 0) -> str:
    """Return a plotly figure as HTML; the page around it draws it where it stands, one folded away once it is
    opened. `least_px`: on a narrower screen it keeps that width and scrolls."""
    data = _figure_data(fig)
    height = int(fig.layout.height or 450)
    note = f"<figcaption>{_words(caption)}</figcaption>" if caption else ""
    width, scrolls = (f";min-width:{least_px}px", ' class="scroll"') if least_px else ("", "")
    return (
        f'<figure{scrolls}><div class="plot" style="height:{height}px{width}"></div>'
        f'<script type="text/plain" class="plot-data">{data}</script>{note}</figure>'
    )


def _figure_data(fig: Any) -> str:
    """A figure as packed JSON; long linear axes in 16 bits, which no screen tells from 64."""
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
    return _packed(str(to_json_plotly(spec)))


def _sixteen_bits(values: Any) -> dict[str, object]:
    """value = low + step * n with n in 0..65534, 65535 for what is not finite; `steps` from one n to the next."""
    finite = np.isfinite(values)
    low = float(values[finite].min()) if finite.any() else 0.0
    width = float(values[finite].max()) - low if finite.any() else 0.0
    step = width / 65534.0 or 1.0
    found = np.where(finite, np.round((np.where(finite, values, low) - low) / step), 65535).astype(np.int64)
    return {"low": low, "step": step, "steps": np.diff(found, prepend=0).tolist()}


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
        f'<meta name="color-scheme" content="light dark">'
        f"<style>{CSS}</style>{_library(body)}</head>"
        f'<body><header><h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p><nav>{links}</nav></header>'
        f"<main>{body}</main><script>{_draw()}</script></body></html>\n"
    )


def _library(body: str) -> str:
    return f'<script type="text/plain" id="plotly">{_plotly()}</script>' if "plot-data" in body else ""


@cache
def _plotly() -> str:
    return _packed(get_plotlyjs())


def _packed(text: str) -> str:
    """Text in zlib and base 85: plotly.js takes 1.8 MB in place of 4.8, a figure a fifth; nothing in it ends a
    script."""
    return base64.b85encode(zlib.compress(text.encode(), 9)).decode()


def _section(index: int, section: Section) -> str:
    lead = f'<p class="lead">{_words(section.lead)}</p>' if section.lead else ""
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
    text = str(cell)
    kind = ' class="long"' if len(text) > LONG_TEXT else ""
    return f"<td{kind}>{_breakable(_words(text))}</td>"


def _breakable(text: str) -> str:
    """HTML whose long names may be broken, so that a table is no wider than its card."""
    return _IN_NAMES.sub(r"\1<wbr>", text)


def _words(text: str) -> str:
    """Plain text as HTML; what stands between backticks is code."""
    return _CODE.sub(r"<code>\1</code>", escape(text))


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


LONG_TEXT: Final = 60
"""Characters from which on a cell is a sentence, and keeps a width that it can be read at."""
_CODE: Final = re.compile("`([^`]+)`")
_IN_NAMES: Final = re.compile(r"(?<=\w)([_/])(?=[^\W\d])")
"""Where a long name may be broken."""
_LONG: Final = (64, 16_384)
"""Lengths between which an array is worth packing, and 65 534 steps are finer than its points."""
_CONFIG: Final = json.dumps({
    "displaylogo": False, "toImageButtonOptions": {"format": "svg"},
    "modeBarButtonsToRemove": ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d"],
})  # fmt: skip
_HERE: Final = Path(__file__).parent
CSS: Final = style.variables() + (_HERE / "page.css").read_text(encoding="utf-8")
"""Style sheet of every page, light and dark."""


@cache
def _draw() -> str:
    """The script that draws, with what it takes from `style`."""
    template = json.dumps(json.dumps(style.template().to_plotly_json()))
    colours = json.dumps(style.dark_colours())
    head = f"const CONFIG = {_CONFIG}, TEMPLATE = {template}, DARK = {colours};\n"
    return head + (_HERE / "page.js").read_text(encoding="utf-8")
