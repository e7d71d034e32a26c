"""The check before belief, as commands make it: one line each on standard error, and kept with the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cablecomp.cli.shared import warn
from cablecomp.config import JointConfig
from cablecomp.estimation.belief import still_doubted, suspicions
from cablecomp.estimation.copies import same_readings
from cablecomp.estimation.view import Suspicion
from cablecomp.recording.reader import Recording
from cablecomp.recording.table import FloatArray


def believe(config: JointConfig, name: str, columns: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """What of a recording hardly fits the drive, said on standard error, and returned for the result's own file."""
    lines = tuple(f"{name}: {s.text}" for s in suspicions(config, columns))
    warn(lines)
    return lines


@dataclass(frozen=True)
class Doubts:
    """What was said of all recordings of one diagnosis: `of` each by name; `copies`: which of them are one."""

    of: Mapping[str, tuple[Suspicion, ...]]
    copies: tuple[str, ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """One line each, for the result's own file."""
        return (*(f"{name}: {s.text}" for name, said in self.of.items() for s in said), *self.copies)

    @property
    def mend_first(self) -> tuple[str, ...]:
        """Those of signs and units: physics that is found in such readings is made up."""
        return tuple(
            f"{name}: {s.text}" for name, said in self.of.items() for s in said if s.kind in ("sign", "unit")
        )

    def beside(self, found: JointConfig, data: Mapping[str, Mapping[str, FloatArray]]) -> Doubts:
        """Those that stand beside the joint as it was found."""
        return replace(
            self, of={name: still_doubted(said, found, data[name]) for name, said in self.of.items()}
        )


def believe_all(config: JointConfig, data: Mapping[str, Mapping[str, FloatArray]]) -> Doubts:
    """The same for all recordings of one diagnosis, by name, and which of them are one."""
    of = {name: suspicions(config, columns) for name, columns in data.items()}
    doubts = Doubts(of, tuple(same_readings(data)))
    warn(doubts.lines)
    return doubts


def believe_streamed(config: JointConfig, recording: Recording) -> tuple[str, ...]:
    """The same for a recording's first rows, which are read once more for it."""
    whole = recording.head()
    return believe(config, recording.path.name, whole) if whole else ()
