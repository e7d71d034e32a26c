"""Recordings by their places: files as they are given, folders with all that lies in them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from cablecomp.errors import InputError

SUFFIXES: Final = (
    ".csv", ".csv.gz", ".tsv", ".tsv.gz", ".parquet", ".npz", ".mat", ".mcap", ".bag", ".db3",
    ".blf", ".asc", ".trc", ".mf4",
)  # fmt: skip
"""Endings by which a file in a folder is taken for a recording; a file that is given itself may have any."""
_BAG: Final = "metadata.yaml"
_WRITTEN: Final = ("prediction.csv", "cycles.csv")
"""What `run` and `replay` write beside a recording; in a folder these are none."""


def find_recordings(places: Iterable[Path]) -> list[Path]:
    """All recordings of these places, a folder's in the order of their paths; each once, by the path that it is first
    given by, whatever other path or link leads to it.

    A folder is searched to its last subfolder; what is hidden (`.name`), and what `run` or `replay` wrote beside a
    recording, is left alone. Raises InputError for a folder that holds no recording.
    """
    found: dict[str, Path] = {}
    for place in places:
        inside = list(_in(place)) if place.is_dir() else [place]
        if not inside:
            raise InputError(
                f"{place}: holds no recording; looked for *{', *'.join(SUFFIXES)} in it and below"
            )
        for path in inside:
            found.setdefault(os.path.realpath(path), path)
    return list(found.values())


def _in(folder: Path) -> Iterator[Path]:
    if (folder / _BAG).is_file():
        yield folder
        return
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.name in _WRITTEN:
            continue
        if path.is_dir():
            yield from _in(path)
        elif path.name.lower().endswith(SUFFIXES):
            yield path
