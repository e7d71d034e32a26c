"""The receiving side of a device that a DBC table describes: frames of one message into a joint's
readings."""

from __future__ import annotations

from math import isfinite
from struct import unpack
from typing import Final, NamedTuple

from cablecomp.links import dbc
from cablecomp.links.dbc import Field, Layout
from cablecomp.links.readings import DeviceClock, JointReadings, MessageStats
from cablecomp.links.records import DriveState

ALWAYS: Final = -1
"""Key of the entries of a message that is not multiplexed."""
_SIZES: Final = {"e": 2, "f": 4, "d": 8}


class Entry(NamedTuple):
    """Channel value = `gain n + offset`, n the field's counts (or the float that its bits are).

    `absent`: counts that mean "no value": the channel then keeps its last value, and ages.
    """

    place: int
    big: bool
    shift: int
    mask: int
    sign: int
    real: str
    gain: float
    offset: float
    absent: int | None


class Status(NamedTuple):
    """What a message says about its device besides channels; fields that it does not carry are None.

    `stamps`: the source whose frame with the counter `stamps_sequence` the device time belongs to (None =
    this frame).
    """

    state: Field | None
    states: dict[int, DriveState]
    error: Field | None
    flags: Field | None
    time: Field | None
    clock: DeviceClock | None
    stamps: Source | None
    stamps_sequence: Field | None
    reply: bool


class Source:
    """One message that a device sends.

    A frame is taken whole or not at all: a wrong length, a NaN, or a counter that repeats or runs behind
    leaves the readings as they are, and is counted.
    """

    __slots__ = (
        "_big",
        "_entries",
        "_length",
        "_readings",
        "_real",
        "_selector",
        "_sequence",
        "places",
        "stats",
        "status",
    )

    def __init__(
        self,
        layout: Layout,
        readings: JointReadings,
        entries: dict[int, tuple[Entry, ...]],
        sequence: Field | None,
    ) -> None:
        self._length = layout.length
        self._big = any(field.big for field in layout.fields.values())
        self._readings = readings
        self._entries = entries
        self._selector = layout.selector if ALWAYS not in entries else None
        self._sequence = sequence
        self._real = any(e.real for group in entries.values() for e in group)
        self.places = tuple(sorted({e.place for group in entries.values() for e in group}))
        self.stats = MessageStats(f"{readings.name}: {layout.name}")
        self.status: Status | None = None
        readings.messages.append(self.stats)

    def take(self, data: bytes, now_s: float) -> int:
        """Take one frame."""
        stats, readings = self.stats, self._readings
        if len(data) != self._length:
            stats.invalid += 1
            return 0
        little = int.from_bytes(data, "little")
        big = int.from_bytes(data, "big") if self._big else 0
        selector = self._selector
        chosen = ALWAYS if selector is None else dbc.counts_in(selector, little, big)
        entries = self._entries.get(chosen, ())
        if self._real and not _finite(entries, little, big):
            stats.invalid += 1
            return 0
        sequence = self._sequence
        if sequence is not None:
            n = (big if sequence.big else little) >> sequence.shift & sequence.mask
            if not stats.accept(n, sequence.mask + 1):
                return 0
        values, arrived, updates = readings.values, readings.arrived_s, readings.updates
        taken = 0
        for place, is_big, shift, mask, sign, real, gain, offset, absent in entries:
            n = (big if is_big else little) >> shift & mask
            if real:
                values[place] = gain * float_of(real, n) + offset
            else:
                if n & sign:
                    n -= sign << 1
                if n == absent:
                    continue
                values[place] = gain * n + offset
            arrived[place] = now_s
            updates[place] += 1
            taken += 1
        stats.received += 1
        stats.last_s = now_s
        if self.status is not None:
            self._take_status(self.status, little, big)
        return taken

    def _take_status(self, status: Status, little: int, big: int) -> None:
        readings = self._readings
        state, states, error, flags, time, clock, _, _, reply = status
        if reply:
            readings.replies += 1
            readings.unanswered = 0
        if state is not None:
            readings.state = states.get(dbc.counts_in(state, little, big), DriveState.UNKNOWN)
        if error is not None:
            readings.error = dbc.counts_in(error, little, big)
        if flags is not None:
            readings.sensor_flags = dbc.counts_in(flags, little, big)
        if time is not None and clock is not None:
            self._stamp(status, clock.seconds(dbc.counts_in(time, little, big)), little, big)

    def _stamp(self, status: Status, device_s: float, little: int, big: int) -> None:
        stamped = self
        if status.stamps is not None and status.stamps_sequence is not None:
            stamped = status.stamps
            if stamped.stats.sequence != dbc.counts_in(status.stamps_sequence, little, big):
                return
        for place in stamped.places:
            self._readings.device_s[place] = device_s


def float_of(real: str, n: int) -> float:
    """The float whose bits are `n`: `e`, `f` or `d` of the struct module."""
    x: float = unpack(">" + real, n.to_bytes(_SIZES[real], "big"))[0]
    return x


def _finite(entries: tuple[Entry, ...], little: int, big: int) -> bool:
    for e in entries:
        if e.real and not isfinite(float_of(e.real, (big if e.big else little) >> e.shift & e.mask)):
            return False
    return True
