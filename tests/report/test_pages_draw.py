"""Pages as a browser draws them: every figure has marks, none is cut, the console stays silent.

Needs a headless Chromium (`chromium`, `chromium-browser` or `google-chrome` on the path); skipped without one.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from diagnosis_example import example

from cablecomp.report import page, style
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.page import Section

BROWSER = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path to draw pages in")


def drawn(html: str, folder: Path, ask: str) -> str:
    """What `ask` (JavaScript) gives after the page has been drawn; the console's lines raise AssertionError."""
    asked = f"<script>setTimeout(() => {{ document.title = JSON.stringify({ask}); }}, 6000);</script>"
    path = folder / "page.html"
    path.write_text(html.replace("</body>", f"{asked}</body>"), encoding="utf-8")
    assert BROWSER is not None
    command = [
        BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--window-size=1280,900",
        f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=20000", "--dump-dom", path.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not said, said
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None
    return title[1].replace("&quot;", '"')


def test_every_figure_of_the_diagnosis_page_is_drawn(tmp_path: Path) -> None:
    """Marks in each plot; no plot wider than its place; nothing makes the page scroll sideways."""
    html = diagnosis_page(example())
    plots = html.count('class="plot"')
    ask = """[...document.querySelectorAll(".plot")].filter((p) => p.closest("details:not([open])")
      || (p.querySelectorAll("path.js-line, .bars path, image, path.point").length
          && p.scrollWidth <= p.parentElement.clientWidth + 1)).length * 1000
      + Math.min(999, document.documentElement.scrollWidth - document.documentElement.clientWidth)"""
    assert plots > 8
    assert int(drawn(html, tmp_path, ask)) == plots * 1000


def test_long_axes_arrive_as_they_were(tmp_path: Path) -> None:
    """What is packed in 16 bits comes out within half a step, gaps included; figures alike are both drawn."""
    x, y = np.linspace(0.0, 9.0, 200), np.sin(np.linspace(0.0, 9.0, 200))
    y[50] = np.nan
    fig = style.figure(300)
    style.curve(fig, x, y, "sine", style.PREDICTED, 1.0)
    html = page.page("x", "", [Section("a", page.figure(fig) + page.figure(fig))])
    ask = "[...document.querySelectorAll('.plot')].map((p) => [p.data[0].x.at(-1), p.data[0].y[3], p.data[0].y[50]])"
    first, second = re.findall(r"\[([^][]+)\]", drawn(html, tmp_path, ask))
    assert first == second
    last, third, gap = first.split(",")
    assert float(last) == pytest.approx(9.0, abs=1e-4)
    assert float(third) == pytest.approx(y[3], abs=2e-5)
    assert gap == "null"
