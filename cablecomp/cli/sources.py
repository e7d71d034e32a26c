"""How a command reads recordings: what foreign columns mean, what the frames of a CAN log mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.shared import console
from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.links.load import load_link
from cablecomp.links.logged import LinkDecoder
from cablecomp.recording.can_log import DecodeFrame, by_dbc
from cablecomp.recording.mapping import ColumnMap, joined_maps, load_mapping, mapping_from, mapping_text
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import Recording, open_recording, read_all
from cablecomp.recording.suggest import as_mapping, suggest
from cablecomp.recording.table import Table

MapOption = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        help="what foreign columns mean: a TOML file, CHANNEL=COLUMN[,unit=deg][,sign=-1].., or auto (shown first)",
    ),
]
LinkOption = Annotated[
    Path | None, typer.Option("--link", help="for a CAN log: the link file of its devices")
]
DbcOption = Annotated[Path | None, typer.Option("--dbc", help="for a CAN log: its message table")]
JointOption = Annotated[str | None, typer.Option("--joint", help="which joint of the link file")]


@dataclass(frozen=True)
class Sources:
    """Opens recordings as the command line says."""

    mapping: ColumnMap | None
    auto: bool
    decode: Callable[[], DecodeFrame] | None
    ratio: float | None

    def open(self, path: Path) -> Recording:
        """Open one recording; see `open_recording`."""
        return open_recording(path, self._mapping(path), self.decode)

    def read(self, path: Path, gaps: bool = False) -> Table:
        """Read one recording whole; see `read_all`."""
        return read_all(path, self._mapping(path), self.decode, gaps)

    def _mapping(self, path: Path) -> ColumnMap | None:
        if not self.auto:
            return self.mapping
        raw = raw_columns(path, self.decode)
        found = as_mapping(suggest(raw.columns, self.ratio, raw.units))
        found = found if self.mapping is None else joined_maps(found, self.mapping)
        console.print(f"{path} is read so:\n{mapping_text(found)}", style="dim")
        return found


def sources(
    words: Sequence[str] | None,
    link: Path | None = None,
    dbc: Path | None = None,
    joint: str | None = None,
    config: JointConfig | None = None,
) -> Sources:
    """Sources from the options of a command; raises InputError for what does not fit together."""
    if link is not None and dbc is not None:
        raise InputError("--link and --dbc say the same: give one of them")
    decode: Callable[[], DecodeFrame] | None = None
    if link is not None:
        loaded = load_link(link)
        LinkDecoder(loaded, joint)  # says at once if there is no such joint
        decode = lambda: LinkDecoder(loaded, joint)  # noqa: E731  # a new one for each reading
    elif dbc is not None:
        decode = by_dbc(dbc)
    files = [Path(w) for w in words or () if w.endswith(".toml") and "=" not in w]
    inline = [w for w in words or () if w != "auto" and Path(w) not in files]
    mapping: ColumnMap | None = None
    for part in [*map(load_mapping, files), *([mapping_from(inline)] if inline else [])]:
        mapping = part if mapping is None else joined_maps(mapping, part)
    return Sources(mapping, "auto" in (words or ()), decode, None if config is None else config.drive.ratio)
