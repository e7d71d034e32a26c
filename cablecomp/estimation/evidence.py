"""Recordings as a fit takes them: cleaned inputs, rows thinned by travel, sessions and conditions.

A law that knows no rates is done with a row per so much travel: between two rows motion and load go one way. Holds
keep a row per so much time. `gather` makes one of a recording's columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.observer.rows import Readings
from cablecomp.signal.between import rate_of
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray

JOINT: Final = "joint_position_rad"
INPUT: Final = "motor_position_rad"
MOTOR: Final = "motor_torque_Nm"
OUTPUTS: Final = (JOINT, MOTOR, "tension_h_N", "tension_l_N")
"""Channels that a model has to account for, where they are recorded."""

NEEDED: Final = ("time_s", INPUT, JOINT)
RATED: Final = 2
"""Every so many of them a law with rates is run at, beside the judged ones."""
FEWEST: Final = 40
"""Readings of a channel, and rows, below which there is nothing to fit."""
OVERFLOWN: Final = 1e15
"""From there on a reading is none, whatever its unit: something has overflowed, and its square would."""


class Apart(NamedTuple):
    """How far from the common value a parameter stands: value = factor common + addend."""

    factor: float = 1.0
    addend: float = 0.0


@dataclass(frozen=True)
class Evidence:
    """One recording, ready to be fitted.

    `columns`: canonical channels on the fine rows, inputs cleaned of noise; `rows`: the fine rows that are
    judged, thinned by travel; `counted`: by output channel, which of `rows` count; `read`: by output channel, on which
    fine rows it was read, and not bridged; `weight`: root of the time that a judged row stands for, over its mean;
    `noise`: 1-sigma of a reading by channel, as the data show it (of the joint's angle, once the drive is calibrated:
    what noise leaves on judged rows, the inputs' in it); `outliers`: readings set aside; `unread`: channels
    left out, hardly read; `shift_s`: what was added to the recording's own clock; `carryover`: by output channel, what
    histories that nobody recorded would add to the judged rows, a column each; `hidden`: the gaps, by the fine row
    before each, in which the drive went where it was not seen to; `apart`: by parameter, in this order, how the
    configuration states that the joint stood apart in this recording; `steady`: by output channel, its readings on the
    judged rows with noise averaged off (`steadying.py`), and `quiet`: what part of a fine row's noise (variance) is
    left in these; `claimed`: the configuration's session that claims the recording and its mounting, where
    laws without a name hold in one session alone.
    """

    name: str
    session: str
    condition: Mapping[str, float]
    columns: Mapping[str, FloatArray]
    rows: IntArray
    counted: Mapping[str, BoolArray]
    weight: FloatArray
    _: KW_ONLY
    noise: Mapping[str, float] = field(default_factory=dict)
    outliers: int = 0
    samples: int = 0
    shift_s: float = 0.0
    carryover: Mapping[str, FloatArray] = field(default_factory=dict)
    hidden: tuple[int, ...] = ()
    apart: Mapping[str, Apart] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    read: Mapping[str, BoolArray] = field(default_factory=dict)
    steady: Mapping[str, FloatArray] = field(default_factory=dict)
    quiet: Mapping[str, float] = field(default_factory=dict)
    claimed: tuple[str, ...] = ()

    def at_rows(self, name: str) -> FloatArray:
        """A channel on the judged rows."""
        return self.steady[name] if name in self.steady else self.columns[name][self.rows]

    def read_at_rows(self, name: str) -> FloatArray:
        """An output channel on the judged rows, NaN where it was not read."""
        return np.where(self.read[name][self.rows], self.at_rows(name), np.nan)

    @cached_property
    def motor_rate(self) -> FloatArray:
        """Speed of the motor on the fine rows [rad/s]; NaN where two of them have one time."""
        return rate_of(self.columns[INPUT], self.columns["time_s"])

    @cached_property
    def load_rates(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """How fast the channels change on fine rows that a load is read from, and when they turn (`in_time.py`)."""
        return {}

    @cached_property
    def readings(self) -> dict[tuple[bytes, tuple[str, ...]], Readings]:
        """What the kernel reads, by the fine rows and the further channels that were asked for (`simulate.py`)."""
        return {}

    @property
    def before_the_end(self) -> slice:
        """The fine rows up to the last judged one at which the joint's angle counts: what goes on beyond is kept for
        the end, and nothing is chosen by it."""
        counts = np.flatnonzero(self.counted[JOINT])
        return slice(int(self.rows[counts[-1]]) + 1) if len(counts) else slice(None)

    @cached_property
    def deflection_rad(self) -> float:
        """How far the joint's angle goes beside a straight line over the motor's, from its 1 to its 99 % quantile."""
        joint, motor = self.columns[JOINT][self.before_the_end], self.columns[INPUT][self.before_the_end]
        seen = np.isfinite(joint) & np.isfinite(motor)
        line = np.stack([motor[seen], np.ones(int(np.sum(seen)))], axis=1)
        beside = joint[seen] - line @ np.linalg.lstsq(line, joint[seen], rcond=None)[0]
        return float(np.ptp(np.quantile(beside, (0.01, 0.99))))

    @property
    def group(self) -> float:
        """Readings of which a fine row is the mean."""
        return max(1.0, self.samples / len(self.columns["time_s"]))

    def noise_of_fine(self, name: str) -> float:
        """1-sigma of a fine row's reading of a channel, out of that of a reading."""
        return self.noise.get(name, 0.0) / float(np.sqrt(self.group))

    def noise_at_rows(self, name: str) -> float:
        """The same on the judged rows (root of its mean square, weighed); before `noise` holds what is left there."""
        return self.noise_of_fine(name) * float(np.sqrt(self.quiet.get(name, 1.0)))

    @cached_property
    def rated(self) -> IntArray:
        """The fine rows at which a law with rates is run."""
        return np.union1d(self.rows, np.arange(0, len(self.columns["time_s"]), RATED))

    def counting_from(self, first: int) -> Evidence:
        """The same with judged rows before `first` not counted."""
        later = np.arange(len(self.rows)) >= first
        return replace(self, counted={k: v & later for k, v in self.counted.items()})


def varies(evidence: Sequence[Evidence], channel: str) -> bool:
    """Whether all recordings have the channel and one of them says more of it than one value."""
    return (
        all(channel in e.columns for e in evidence)
        and max(float(np.ptp(e.columns[channel])) for e in evidence) > 0.0
    )


def rms_by_time(left: FloatArray, weight: FloatArray) -> float:
    """RMS of what is left on rows of these weights, by the time that they stand for; NaN for none."""
    return float(np.sqrt(np.average(left**2, weights=weight**2))) if len(left) else float("nan")


def noise_mean(evidence: Sequence[Evidence], channel: str) -> float:
    """1-sigma of a channel's reading, mean over the recordings; 0 where none shows any."""
    return float(np.mean([e.noise.get(channel, 0.0) for e in evidence]))


def noise_rms(evidence: Sequence[Evidence], channel: str) -> float:
    """The same, root mean square: what noise alone leaves of readings of all recordings together."""
    return float(np.sqrt(np.mean([e.noise.get(channel, 0.0) ** 2 for e in evidence])))


def load_channel(config: JointConfig, columns: Mapping[str, FloatArray]) -> str | None:
    """Channel that holds the load: the motor's torque where the configuration says so, else `joint_torque_Nm`, else
    none."""
    if config.observer.load == "motor_torque" and MOTOR in columns:
        return MOTOR
    return "joint_torque_Nm" if "joint_torque_Nm" in columns else None
