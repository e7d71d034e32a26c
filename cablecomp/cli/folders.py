"""Folders that commands write into: refused before any work where they cannot be written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from cablecomp.recording.atomic import check_directory


def out_option(words: str) -> Any:
    """The option `--out` for a folder, `words` as its help; one that cannot be written is refused before any work."""
    return typer.Option("--out", callback=writable, help=words)


def writable(option: typer.CallbackParam, out: Path | None) -> Path | None:
    """The folder of an option; raises InputError if it can be none that is written into."""
    if out is not None:
        check_directory(out, option.opts[0])
    return out
