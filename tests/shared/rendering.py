"""What a terminal would show."""

from __future__ import annotations

import io

from rich.console import Console, RenderableType


def as_text(content: RenderableType, width: int = 110) -> str:
    """Return what a console of `width` columns would show, without colour."""
    console = Console(
        file=io.StringIO(), width=width, color_system=None, highlight=False, markup=False, emoji=False
    )
    with console.capture() as captured:
        console.print(content)
    return captured.get()
