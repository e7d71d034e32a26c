"""What a terminal would show, and what a page would draw."""

from __future__ import annotations

import base64
import io
import re
import zlib

from rich.console import Console, RenderableType


def as_text(content: RenderableType, width: int = 110) -> str:
    """Return what a console of `width` columns would show, without colour."""
    console = Console(
        file=io.StringIO(), width=width, color_system=None, highlight=False, markup=False, emoji=False
    )
    with console.capture() as captured:
        console.print(content)
    return captured.get()


def figures_of(html: str) -> list[str]:
    """The JSON of each figure of a page."""
    packed = re.findall(r'class="plot-data">([^/]*?)</script>', html)
    return [zlib.decompress(base64.b85decode(text)).decode() for text in packed]
