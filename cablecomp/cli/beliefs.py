"""The check before belief, as commands make it: one line each on standard error, and kept with the result."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.cli.shared import warn
from cablecomp.config import JointConfig
from cablecomp.estimation.belief import same_readings, suspicions
from cablecomp.recording.reader import Recording
from cablecomp.recording.table import FloatArray


def believe(config: JointConfig, name: str, columns: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """What of a recording hardly fits the drive, said on standard error, and returned for the result's own file."""
    lines = tuple(f"{name}: {s.text}" for s in suspicions(config, columns))
    warn(lines)
    return lines


def believe_all(config: JointConfig, data: Mapping[str, Mapping[str, FloatArray]]) -> tuple[str, ...]:
    """The same for all recordings of one diagnosis, by name, and which of them are one."""
    copies = tuple(same_readings(data))
    warn(copies)
    return (*(line for name, columns in data.items() for line in believe(config, name, columns)), *copies)


def believe_streamed(config: JointConfig, recording: Recording) -> tuple[str, ...]:
    """The same for a recording's first rows, which are read once more for it."""
    whole = recording.head()
    return believe(config, recording.path.name, whole) if whole else ()
