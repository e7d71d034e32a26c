"""A headless Chromium that draws pages (Playwright), and what it sees of them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import pytest

CHROMIUM: Final = next(
    (p for b in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(b))), None
)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the path to draw pages in")
DESKTOP, PHONE = 1280, 390
_QUIET: Final = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip

SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
"""Pixels by which a page is wider than its window."""
TWICE = """() => { const ids = [...document.querySelectorAll('[id]')].map((e) => e.id);
  return ids.filter((id, k) => ids.indexOf(id) !== k); }"""
"""Ids that two elements share."""
BLANK = """() => [...document.querySelectorAll('.plot')].flatMap((plot, k) =>
  !plot.closest('details:not([open])')
    && !plot.querySelector('path.js-line, .bars path, image, path.point, .fills path') ? [k] : [])"""
"""Numbers of the figures without a mark."""
CUT = """() => [...document.querySelectorAll('.plot')].filter((p) => p.clientWidth).flatMap((plot, k) => {
  const place = plot.getBoundingClientRect();
  return [...plot.querySelectorAll('svg text')].filter((text) => {
    const box = text.getBoundingClientRect();
    return box.width && !text.closest('.hoverlayer') && (box.left < place.left - 1 || box.right > place.right + 1
      || box.top < place.top - 1 || box.bottom > place.bottom + 1);
  }).map((text) => `figure ${k}: ${text.textContent}`);
})"""
"""Texts of figures that stick out of them."""
OVERLAPPING = """() => [...document.querySelectorAll('.plot')].filter((p) => p.clientWidth).flatMap((plot, k) => {
  const kinds = '.xtick text, .ytick text, .legendtext, .xtitle, .ytitle, .annotation-text, .bartext';
  const texts = [...plot.querySelectorAll(kinds)].map((t) => [t.textContent, t.getBoundingClientRect(), t])
    .filter(([, box, t]) => box.width && getComputedStyle(t).opacity !== '0');
  return texts.flatMap(([a, p], i) => texts.slice(i + 1).filter(([, q]) =>
    Math.min(p.right, q.right) - Math.max(p.left, q.left) > 3
      && Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 4)
    .map(([b]) => `figure ${k}: ${a} | ${b}`));
})"""
"""Texts of figures that lie on each other."""
SPILT = """() => [...document.querySelectorAll('.fact, .fact span, h1, h2, h3, p, li, td, th')].filter((e) =>
  e.clientWidth && e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'inline')
  .map((e) => e.textContent.slice(0, 60))"""
"""Texts wider than their place."""


@contextmanager
def browser() -> Iterator[Any]:
    """A browser that is gone afterwards."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=CHROMIUM, args=list(_QUIET))
        try:
            yield found
        finally:
            found.close()


@contextmanager
def opened(found: Any, address: str, width: int = DESKTOP, **how: Any) -> Iterator[Any]:
    """A page at an address; what its console complained of raises AssertionError at the end."""
    context = found.new_context(viewport={"width": width, "height": 900}, **how)
    said: list[str] = []
    page = context.new_page()
    page.on("console", lambda m: said.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda e: said.append(str(e)))
    try:
        page.goto(address)
        yield page
    finally:
        context.close()
    assert not said, said


@contextmanager
def drawn(found: Any, html: str, folder: Path, width: int = DESKTOP, **how: Any) -> Iterator[Any]:
    """A page of ours once its figures stand."""
    path = folder / "page.html"
    path.write_text(html, encoding="utf-8")
    with opened(found, path.as_uri(), width, **how) as page:
        page.wait_for_function("document.body.dataset.drawn || !document.querySelector('.plot')")
        yield page
