"""How a command reads recordings: what foreign columns mean, what the frames of a CAN log mean."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Protocol, get_args, get_type_hints

import typer

from cablecomp.cli.shared import errors
from cablecomp.config import JointConfig
from cablecomp.errors import ConfigError, InputError, path_text
from cablecomp.recording.can_log import CanKind, DecodeFrame, by_dbc
from cablecomp.recording.folder import find_recordings
from cablecomp.recording.inspection import require_motion
from cablecomp.recording.mapping import ColumnMap, joined_maps, load_mapping, mapping_from, mapping_text
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import Recording, open_recording, read_all
from cablecomp.recording.source import identify
from cablecomp.recording.suggest import as_mapping, suggest, unknown_units
from cablecomp.recording.table import FloatArray, Table

Columns = dict[str, FloatArray]

MapOption = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        help="what foreign columns mean: a TOML file, CHANNEL=COLUMN[,unit=deg][,sign=-1].., or auto (shown first)",
    ),
]
RatioOption = Annotated[
    Path | None,
    typer.Option(
        "--config", help="joint configuration: its ratio helps to tell units, its load what is missing"
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

    def check(self, path: Path) -> None:
        """Raise InputError if it is said what the frames of a file mean that is no CAN log."""
        if self.decode is not None and identify(path).kind not in get_args(CanKind):
            raise InputError(
                f"{path}: is no CAN log, which --link, --dbc and --joint are for; leave them out"
            )

    def open(self, path: Path) -> Recording:
        """Open one recording; see `open_recording`."""
        self.check(path)
        return open_recording(path, self._mapping(path), self.decode)

    def read(self, path: Path, gaps: bool = False) -> Table:
        """Read one recording whole; see `read_all`."""
        return read_all(path, self._mapping(path), self.decode, gaps)

    def _mapping(self, path: Path) -> ColumnMap | None:
        if not self.auto:
            return self.mapping
        raw = raw_columns(path, self.decode)
        suggested = suggest(raw.columns, self.ratio, raw.units)
        needed, left_out = unknown_units(suggested, self.mapping)
        if needed:
            raise unit_error(path, needed)
        found = as_mapping(suggested, self.mapping)
        errors().print(f"{path} is read so:\n{mapping_text(found)}", style="dim")
        for line in left_out:
            errors().print(f"{path}: {line}", style="yellow", soft_wrap=True, markup=False)
        return found


def unit_error(path: Path, lines: Sequence[str]) -> ConfigError:
    """The error for needed columns of a file whose units are not known."""
    return ConfigError(f"{path}: {line}" for line in lines)


class Reading(Protocol):
    """How the command line says that recordings are read, once the joint is known that their columns may be of."""

    def __call__(self, joint: JointConfig | None = None, /) -> Sources: ...


def reads_recordings(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options --map, --link, --dbc and --joint in place of its parameter `reading`, a `Reading`."""

    @wraps(command)
    def with_options(**given: Any) -> None:
        words, link, dbc, which = (given.pop(name) for name in options)
        command(reading=lambda joint=None, /: sources(words, link, dbc, which, joint), **given)

    options = {"words": MapOption, "link": LinkOption, "dbc": DbcOption, "which": JointOption}
    hints = get_type_hints(command, include_extras=True)
    parameters = []
    for name, parameter in inspect.signature(command).parameters.items():
        taken = options if name == "reading" else {name: hints[name]}
        default = None if name == "reading" else parameter.default
        parameters += [
            inspect.Parameter(n, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=a)
            for n, a in taken.items()
        ]
    with_options.__annotations__ = {p.name: p.annotation for p in parameters} | {"return": None}
    with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer reads
    return with_options


def read_moving(recordings: Sequence[Path], reading: Sources, what: str) -> dict[str, Columns]:
    """Channels of every recording that these files and folders hold, by path; raises InputError for one without
    motion, or without a channel that `what` is done with them needs."""
    from cablecomp.estimation.evidence import NEEDED  # brings solvers: only where recordings are fitted

    for path in recordings:
        if path.is_file():  # in a folder, CAN logs may lie beside other recordings
            reading.check(path)
    data = {path_text(path): reading.read(path, gaps=True).columns for path in find_recordings(recordings)}
    for name, columns in data.items():
        missing = next((key for key in NEEDED if key not in columns), None)
        if missing is not None:
            raise InputError(f"{name}: channel `{missing}` is missing; a {what} needs {', '.join(NEEDED)}")
        require_motion({"joint_position_rad": columns["joint_position_rad"]}, name)
    return data


def sources(
    words: Sequence[str] | None,
    link: Path | None = None,
    dbc: Path | None = None,
    joint: str | None = None,
    config: JointConfig | None = None,
) -> Sources:
    """Sources from the options of a command; raises InputError for what does not fit together."""
    if joint is not None and link is None:
        raise InputError("--joint says which joint of a link file: give that with --link, or leave it out")
    if link is not None and dbc is not None:
        raise InputError("--link and --dbc say the same: give one of them")
    decode: Callable[[], DecodeFrame] | None = None
    if link is not None:
        from cablecomp.links.load import load_link  # brings python-can: only where a link is given
        from cablecomp.links.logged import LinkDecoder

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
