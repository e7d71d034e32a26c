"""Writing a recording anew in canonical channels, streamed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.atomic import atomic_file
from cablecomp.recording.channels import order
from cablecomp.recording.mcap_writer import write_mcap, write_ros_mcap
from cablecomp.recording.parquet_file import write_parquet
from cablecomp.recording.reader import Recording
from cablecomp.recording.table import Block
from cablecomp.recording.writer import CsvWriter

_ENDINGS: Final = (".csv", ".csv.gz", ".parquet", ".mcap", ".npz")


def convert(
    source: Recording,
    to: Path,
    between_s: tuple[float, float] = (-inf, inf),
    progress: Callable[[float, int], None] | None = None,
    late_s: Mapping[str, float] | None = None,
    ros: bool = False,
) -> int:
    """Write the rows of `source` with times within `between_s` to `to`, by its ending; returns how many.

    `late_s`: channels whose values come so much later than the others', set right by interpolation; rows at the
    ends that have no value then are left out, and all of the recording is held in memory. `ros`: ROS 2's
    messages, in MCAP.

    The file appears only when it is whole. Raises InputError for another ending, for the recording itself, if nothing
    is left, or as reading does.
    """
    ending = next((e for e in _ENDINGS if to.name.endswith(e)), None)
    if ending is None:
        raise InputError(f"{to}: {', '.join(_ENDINGS)} are accepted endings")
    if ros and ending != ".mcap":
        raise InputError(f"{to}: ROS 2's messages go into .mcap; give that ending")
    if to.exists() and to.samefile(source.path):
        raise InputError(f"{to}: is the recording itself, which stays as it is; give another file to write")
    blocks = _set_right(source, late_s) if late_s else source.blocks()
    counted = _Counted(blocks, between_s, progress)
    names = order(source.channels)
    with atomic_file(to) as temporary:
        part = temporary.with_name(f"{temporary.name}{ending}")
        try:
            _write(part, ending, names, counted, ros)
            if not counted.rows:
                raise InputError(
                    f"{source.path}: has no row between {between_s[0]:g} s and {between_s[1]:g} s"
                )
            part.rename(temporary)
        finally:
            part.unlink(missing_ok=True)
    return counted.rows


def _set_right(source: Recording, late_s: Mapping[str, float]) -> Iterator[Block]:
    """The whole recording as one block, late channels moved to where they belong."""
    source.require(late_s, "as --late sets it right")
    parts = [block.columns for block in source.blocks()]
    whole = {n: np.concatenate([p[n] for p in parts]) for n in source.channels}
    time = whole["time_s"]
    for name, late in late_s.items():
        whole[name] = np.interp(time + late, time, whole[name])
    latest, earliest = max(*late_s.values(), 0.0), min(*late_s.values(), 0.0)
    first, last = np.searchsorted(time, [time[0] - earliest, time[-1] - latest], side="left")
    if last <= first:
        said = ", ".join(f"{name}={late:g}" for name, late in late_s.items())
        raise InputError(
            f"{source.path}: lasts {time[-1] - time[0]:g} s, of which --late {said} leaves no row; give less"
        )
    yield Block(1, {n: v[first:last] for n, v in whole.items()}, 1.0)


class _Counted:
    """Blocks cut to a stretch of time, counted on the way."""

    def __init__(
        self,
        blocks: Iterable[Block],
        between_s: tuple[float, float],
        progress: Callable[[float, int], None] | None,
    ) -> None:
        self._blocks, self._between, self._progress = blocks, between_s, progress
        self.rows = 0

    def __iter__(self) -> Iterator[Block]:
        low, high = self._between
        for block in self._blocks:
            time = block.columns["time_s"]
            first, last = np.searchsorted(time, [low, high], side="left")
            last = int(np.searchsorted(time, high, side="right")) if np.isfinite(high) else len(time)
            if last > first:
                self.rows += int(last - first)
                yield block.part(int(first), int(last))
            if self._progress is not None:
                self._progress(block.fraction, self.rows)
            if len(time) and time[-1] > high:
                return


def _write(path: Path, ending: str, names: tuple[str, ...], blocks: Iterable[Block], ros: bool) -> None:
    if ending in (".csv", ".csv.gz"):
        with CsvWriter(path, names) as writer:
            for block in blocks:
                writer.write(block.columns)
    elif ending == ".mcap":
        (write_ros_mcap if ros else write_mcap)(path, blocks)
    else:
        parts = list(blocks)
        whole = {n: np.concatenate([b.columns[n] for b in parts]) for n in names} if parts else {}
        if ending == ".npz":
            # numpy's stub takes `**` for `allow_pickle`, a bool
            np.savez_compressed(path, **whole)  # type: ignore[arg-type]  # numpy's stub: a name may be a flag
        else:
            write_parquet(path, whole)
