"""Whether what came from the wire can be true: every channel against its own past, and channels against each
other."""

from __future__ import annotations

from math import exp, inf, isfinite, nan
from typing import Final, NamedTuple

from cablecomp.control.options import HealthOptions
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import (
    JOINT_POSITION,
    JOINT_TORQUE,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    TEMPERATURE,
)
from cablecomp.signals import Sample

MOTOR_STALE: Final = 1
TORQUE_STALE: Final = 2
JOINT_STALE: Final = 4
MOTOR_JUMP: Final = 8
TORQUE_JUMP: Final = 16
JOINT_JUMP: Final = 32
TORQUE_SATURATED: Final = 64
JOINT_RESIDUAL: Final = 128
TORQUE_MISMATCH: Final = 256
MOTOR_LAGS: Final = 512
UNANSWERED: Final = 1024

_WORDS: Final = (
    "motor position is stale",
    "joint torque is stale",
    "joint position is stale",
    "motor encoder jumped",
    "joint torque jumped",
    "joint encoder jumped",
    "torque sensor is at its limit",
    "joint encoder disagrees with the model",
    "torque sensor disagrees with motor torque",
    "motor does not follow",
    "drive does not answer",
)


def health_names(flags: int) -> tuple[str, ...]:
    """Words for the flags of a check."""
    return tuple(word for bit, word in enumerate(_WORDS) if flags >> bit & 1)


class Channel:
    """One channel: the last plausible value, when it came, and whether newer ones had to be turned down.

    A value is plausible if it is finite, within `most`, and moved no faster than `rate` since the value
    before. After one that is not, values are turned down until they agree with the last plausible one again.
    """

    __slots__ = (
        "_floor",
        "_hold_s",
        "_most",
        "_rate",
        "_raw",
        "_raw_s",
        "arrived_s",
        "refused",
        "seen",
        "suspect",
        "value",
    )

    def __init__(self, rate: float, floor: float, hold_s: float, most: float = inf) -> None:
        self._rate = rate
        self._floor = floor
        self._hold_s = hold_s
        self._most = most
        self._raw = self._raw_s = nan
        self.value = nan
        self.arrived_s = -inf
        self.seen = 0
        self.refused = 0
        self.suspect = False

    def take(self, value: float, arrived_s: float) -> bool:
        """Judge one new value that came at `arrived_s`; False = turned down."""
        raw, dt = self._raw, arrived_s - self._raw_s
        self._raw, self._raw_s = value, arrived_s
        if not -self._most < value < self._most:
            self.refused += 1
            self.suspect = self.suspect or not isfinite(value)
            return False
        if raw == raw:
            if self.suspect:
                ok = abs(value - self.value) <= self._rate * self._hold_s + self._floor
            else:
                ok = abs(value - raw) <= self._rate * dt + self._floor
            if not ok:
                self.suspect = True
                self.refused += 1
                return False
        self.suspect = False
        self.value, self.arrived_s = value, arrived_s
        return True


class Checked(NamedTuple):
    """What a check gives: the sample for the observer, ages in s, what is wrong, and whether control may live
    on it.

    `sample` holds the last plausible values, `ready` that all needed ones have come at least once; `joint_ok`
    = the joint encoder may be used for feedback; `fatal` = stop now.
    """

    sample: Sample
    motor_age_s: float
    load_age_s: float
    flags: int
    ready: bool
    joint_ok: bool
    fatal: bool


class Sustained:
    """A condition that counts once it has lasted `for_s`; `age_s` = for how long it has counted (0 = it does
    not)."""

    __slots__ = ("_for_s", "_since", "age_s")

    def __init__(self, for_s: float) -> None:
        self._for_s = for_s
        self._since = inf
        self.age_s = 0.0

    def step(self, condition: bool, now_s: float) -> bool:
        """Whether the condition has held since `for_s` ago."""
        if not condition:
            self._since = inf
            self.age_s = 0.0
            return False
        if self._since == inf:
            self._since = now_s
        self.age_s = max(now_s - self._since - self._for_s, 0.0)
        return now_s - self._since >= self._for_s


class Health:
    """Watches one joint. `needs_torque`, `needs_joint`: channels that the feed-forward lives on;
    `others`: places of the further channels that the observer reads, in its order.

    Motor position, joint torque, joint position are held at their last plausible value; all else passes
    as it came.
    """

    def __init__(
        self,
        options: HealthOptions,
        ratio: float,
        fresh_s: float,
        *,
        needs_torque: bool = True,
        needs_joint: bool = False,
        others: tuple[int, ...] = (),
    ) -> None:
        o = options
        limit = inf if o.torque_max_Nm is None else o.torque_max_Nm
        self.motor = Channel(o.motor_rate_rad_s, 0.002, fresh_s)
        self.joint = Channel(o.joint_rate_rad_s, 0.002, fresh_s)
        self.torque = Channel(o.torque_rate_Nm_s, 0.05, fresh_s, limit)
        self._o = o
        self._ratio = ratio
        self._fresh_s = fresh_s
        self._needs_torque = needs_torque
        self._needs_joint = needs_joint
        self._others = others
        self._residual = Sustained(o.confirm_s)
        self._mismatch = Sustained(o.confirm_s)
        self._lags = Sustained(o.confirm_s)
        self._mean_mismatch = 0.0
        self._last_s = nan
        self._bad_joint = False

    def check(
        self, readings: JointReadings, now_s: float, predicted_rad: float = nan, target_rad: float = nan
    ) -> Checked:
        """One cycle. `predicted_rad`: joint position that the observer said last; `target_rad`: motor target
        sent last."""
        values, arrived, updates = readings.values, readings.arrived_s, readings.updates
        flags = self._take(values, arrived, updates)
        motor_age = now_s - self.motor.arrived_s
        torque_age = now_s - self.torque.arrived_s
        joint_age = now_s - self.joint.arrived_s
        flags |= self._compare(values, now_s, predicted_rad, target_rad)
        has_joint, has_torque = self.joint.value == self.joint.value, self.torque.value == self.torque.value
        fresh = self._fresh_s
        if motor_age > fresh:
            flags |= MOTOR_STALE
        if has_torque and torque_age > fresh:
            flags |= TORQUE_STALE
        if has_joint and joint_age > fresh:
            flags |= JOINT_STALE
        if readings.unanswered > self._o.unanswered:
            flags |= UNANSWERED
        load_age = 0.0
        if self._needs_torque:
            load_age = max(torque_age, self._mismatch.age_s)
        if self._needs_joint:
            load_age = max(load_age, joint_age, self._residual.age_s)
        ready = (
            self.motor.value == self.motor.value
            and (has_torque or not self._needs_torque)
            and (has_joint or not self._needs_joint)
        )
        sample = Sample(
            now_s,
            self.motor.value,
            self.torque.value,
            self.joint.value,
            values[MOTOR_TORQUE],
            values[TEMPERATURE],
            tuple([values[place] for place in self._others]) if self._others else (),
        )
        joint_ok = has_joint and not self._bad_joint and joint_age <= fresh
        fatal = bool(flags & MOTOR_LAGS)
        return Checked(sample, motor_age, load_age, flags, ready, joint_ok, fatal)

    def _take(self, values: list[float], arrived: list[float], updates: list[int]) -> int:
        flags = 0
        for channel, place, jump in (
            (self.motor, MOTOR_POSITION, MOTOR_JUMP),
            (self.torque, JOINT_TORQUE, TORQUE_JUMP),
            (self.joint, JOINT_POSITION, JOINT_JUMP),
        ):
            if updates[place] != channel.seen:
                channel.seen = updates[place]
                channel.take(values[place], arrived[place])
            if channel.suspect:
                flags |= jump
        limit = self._o.torque_max_Nm
        if limit is not None and abs(values[JOINT_TORQUE]) >= limit:
            flags |= TORQUE_SATURATED
        return flags

    def _compare(self, values: list[float], now_s: float, predicted_rad: float, target_rad: float) -> int:
        o, flags = self._o, 0
        if o.joint_residual_rad is not None:
            off = abs(self.joint.value - predicted_rad) > o.joint_residual_rad
            self._bad_joint = self._residual.step(off, now_s)
            flags |= JOINT_RESIDUAL if self._bad_joint else 0
        if o.torque_mismatch_Nm is not None and values[MOTOR_TORQUE] == values[MOTOR_TORQUE]:
            mismatch = self.torque.value + values[MOTOR_TORQUE] / self._ratio
            if mismatch == mismatch:
                dt = now_s - self._last_s if self._last_s == self._last_s else 0.0
                self._mean_mismatch += (1.0 - exp(-dt / o.confirm_s)) * (mismatch - self._mean_mismatch)
            off = abs(self._mean_mismatch) > o.torque_mismatch_Nm
            flags |= TORQUE_MISMATCH if self._mismatch.step(off, now_s) else 0
        self._last_s = now_s
        if o.lead_rad is not None and self._lags.step(abs(target_rad - self.motor.value) > o.lead_rad, now_s):
            flags |= MOTOR_LAGS
        return flags
