"""The newest value of every channel of a joint, when it came, and what went wrong on the way; allocated once,
written in place."""

from __future__ import annotations

from collections.abc import Iterable
from math import nan
from typing import Final, NamedTuple

from cablecomp.links.records import (
    CHANNELS,
    JOINT_POSITION,
    JOINT_TORQUE,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    TEMPERATURE,
    DriveState,
)
from cablecomp.signals import Sample

_RESYNC_AFTER: Final = 3


class MessageStats:
    """Counts of one message: frames taken, found invalid, and by its sequence counter lost, repeated,
    reordered, restarted.

    `last_s`: arrival of the last frame taken (NaN = none yet). `sequence`: its counter (-1 = none yet).
    """

    __slots__ = (
        "_behind",
        "invalid",
        "last_s",
        "lost",
        "name",
        "received",
        "reordered",
        "repeated",
        "restarts",
        "sequence",
    )

    def __init__(self, name: str) -> None:
        self.name = name
        self.received = 0
        self.invalid = 0
        self.lost = 0
        self.repeated = 0
        self.reordered = 0
        self.restarts = 0
        self.last_s = nan
        self.sequence = -1
        self._behind = 0

    def accept(self, sequence: int, modulus: int) -> bool:
        """Judge a frame by its counter; False = it repeats or comes behind a newer one and must not be used.

        A step of 1 is the next frame; a step of s < modulus/2 has lost s-1 (modulo the counter: after a long
        silence it is a lower bound); 0 repeats; the rest comes from before. Three in a row from before, each
        the next of the other, mean that the device has started afresh: they are taken, and counted as one
        restart.
        """
        step = (sequence - self.sequence) % modulus
        if self.sequence < 0 or step == 1:
            self.sequence = sequence
            self._behind = 0
            return True
        if step == 0:
            self.repeated += 1
            return False
        if 2 * step < modulus:
            self.lost += step - 1
            self.sequence = sequence
            self._behind = 0
            return True
        return self._from_before(sequence, modulus)

    def _from_before(self, sequence: int, modulus: int) -> bool:
        run, expected = divmod(self._behind, modulus)
        run = run + 1 if run and sequence == expected else 1
        if run >= _RESYNC_AFTER:
            self.restarts += 1
            self.reordered -= run - 1
            self.sequence = sequence
            self._behind = 0
            return True
        self.reordered += 1
        self._behind = run * modulus + (sequence + 1) % modulus
        return False


class DeviceClock:
    """Unwraps a device's counter of time: `seconds = unit * (counter + 2^bits * turns)`; a restart is left to
    the sequence."""

    __slots__ = ("_last", "_modulus", "_turns", "_unit_s")

    def __init__(self, unit_s: float, bits: int) -> None:
        self._unit_s = unit_s
        self._modulus = 1 << bits
        self._last = 0
        self._turns = 0

    def seconds(self, counter: int) -> float:
        """Time of the device in s; a step back by over half of the range is the counter's wrap."""
        if counter - self._last < -(self._modulus >> 1):
            self._turns += 1
        self._last = counter
        return self._unit_s * (counter + self._turns * self._modulus)


class Age(NamedTuple):
    """How old a joint's newest values are, in s by the caller's clock (infinite = never came)."""

    motor_position_s: float
    joint_position_s: float
    joint_torque_s: float


class JointReadings:
    """Newest values of a joint, by channel index (`CHANNELS`, then `others`).

    `values` SI, at the pulleys (NaN = never came); `arrived_s` by the caller's clock (NaN = never);
    `device_s` by the device's own clock (NaN = not stamped); `updates` counts values taken. `saturated`:
    CLIP_* bits of the last drive reply; `state`, `error`: the drive's; `sensor_flags`: the sensor node's, as
    it sends them. `motor_step_rad`: what the drive rounds its position to (0 = hardly at all). `sent`, `replies`,
    `unanswered`: commands sent, drive replies taken, commands sent since the last reply. `messages`: statistics of
    each message.
    """

    __slots__ = (
        "arrived_s",
        "device_s",
        "error",
        "messages",
        "motor_step_rad",
        "name",
        "others",
        "replies",
        "saturated",
        "sensor_flags",
        "sent",
        "state",
        "unanswered",
        "updates",
        "values",
    )

    def __init__(self, name: str, others: tuple[str, ...] = ()) -> None:
        n = len(CHANNELS) + len(others)
        self.name = name
        self.others = others
        self.values = [nan] * n
        self.arrived_s = [nan] * n
        self.device_s = [nan] * n
        self.updates = [0] * n
        self.state = DriveState.UNKNOWN
        self.error = 0
        self.sensor_flags = 0
        self.motor_step_rad = 0.0
        self.saturated = 0
        self.sent = 0
        self.replies = 0
        self.unanswered = 0
        self.messages: list[MessageStats] = []

    def take_reply(self, places: Iterable[int], stats: MessageStats, now_s: float) -> None:
        """Note that a reply of the drive has just brought the values at these places."""
        for place in places:
            self.arrived_s[place] = now_s
            self.updates[place] += 1
        self.replies += 1
        self.unanswered = 0
        stats.received += 1
        stats.last_s = now_s

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all places, in the order of `values`."""
        return CHANNELS + self.others

    def index(self, channel: str) -> int:
        """Place of a channel in `values`."""
        return self.channels.index(channel)

    def age_s(self, channel: int, now_s: float) -> float:
        """Age of a channel's newest value in s by the caller's clock; infinite if it never came."""
        arrived = self.arrived_s[channel]
        return now_s - arrived if arrived == arrived else float("inf")

    def ages(self, now_s: float) -> Age:
        """Ages of the three channels that the compensator lives on."""
        return Age(
            self.age_s(MOTOR_POSITION, now_s),
            self.age_s(JOINT_POSITION, now_s),
            self.age_s(JOINT_TORQUE, now_s),
        )

    def sample(self, now_s: float) -> Sample:
        """The newest values as one sample of time `now_s`; absent channels are NaN, `other` in the order of
        `others`."""
        v = self.values
        return Sample(
            now_s,
            v[MOTOR_POSITION],
            v[JOINT_TORQUE],
            v[JOINT_POSITION],
            v[MOTOR_TORQUE],
            v[TEMPERATURE],
            tuple(v[len(CHANNELS) :]) if self.others else (),
        )

    @property
    def lost(self) -> int:
        """Frames lost by sequence counters, over all messages."""
        return sum(m.lost for m in self.messages)
