"""The running half of a join: messages come in the order of logging, rows go out in the order of time."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

import numpy as np

from cablecomp.recording.messages import Message, MessageLog
from cablecomp.recording.raw import NumberRows
from cablecomp.recording.table import FloatArray

_ROWS: Final = 1 << 14


class Clock(Protocol):
    """Times of messages on the one clock [s]."""

    @property
    def late_s(self) -> float:
        """How long after its own time a message may be logged."""

    def logged(self, message: Message) -> float:
        """When it was logged."""

    def time(self, message: Message) -> float:
        """Its own time."""


@dataclass(frozen=True)
class JoinPlan:
    """What is joined: `wanted` column -> (topic, field); `needed` topics without a fresh value of which a row is
    left out; `ages` topic -> name of its column of ages; `hold_s` by topic, how old a value may be; `between` topic ->
    fields that are interpolated between the messages before and after a row.
    """

    wanted: Mapping[str, tuple[str, str]]
    needed: frozenset[str]
    ages: Mapping[str, str]
    leader: str
    within_s: float
    hold_s: Mapping[str, float]
    between: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def fields_of(self, topic: str) -> frozenset[str]:
        """The fields of a topic that are wanted."""
        return frozenset(name for t, name in self.wanted.values() if t == topic)


class _Row(NamedTuple):
    """A message of the leading topic, which waits until all that may belong to it has come."""

    time: float
    fields: dict[str, float]
    share: float


class _History:
    """What has come of one topic and may still be wanted, by time; messages may come out of order.

    A message that holds only a part of the fields (several publishers, multiplexed signals) is completed by
    the one before it.
    """

    def __init__(self, fields: frozenset[str]) -> None:
        self._fields = fields
        self._times: list[float] = []
        self._held: list[dict[str, float]] = []

    def add(self, time: float, fields: dict[str, float]) -> None:
        """Take in one message."""
        k = bisect_right(self._times, time)
        if k and not self._fields <= fields.keys():
            fields = {**self._held[k - 1], **fields}
        self._times.insert(k, time)
        self._held.insert(k, fields)

    def nearest(self, time: float, within_s: float) -> tuple[float, dict[str, float]] | None:
        """Nearest of the last message at or before `time` and those up to `within_s` after it; rows must be
        asked for in rising time: what lies further back is forgotten.
        """
        k = bisect_right(self._times, time)
        if k > 1:
            del self._times[: k - 1], self._held[: k - 1]
            k = 1
        later = k < len(self._times) and self._times[k] <= time + within_s
        if later and (k == 0 or self._times[k] - time < time - self._times[k - 1]):
            return self._times[k], self._held[k]
        return (self._times[k - 1], self._held[k - 1]) if k else None

    def around(
        self, time: float
    ) -> tuple[tuple[float, dict[str, float]], tuple[float, dict[str, float]]] | None:
        """The last message at or before `time` and the first after it; None where one is not there."""
        k = bisect_right(self._times, time)
        if not 0 < k < len(self._times):
            return None
        return (self._times[k - 1], self._held[k - 1]), (self._times[k], self._held[k])


class JoinedRows:
    """The running state of a join."""

    def __init__(self, log: MessageLog, plan: JoinPlan, clock: Clock) -> None:
        self._log, self._plan, self._clock = log, plan, clock
        self._key = next(name for topic, name in plan.wanted.values() if topic == plan.leader)
        topics = {topic for topic, _ in plan.wanted.values()}
        self._history = {topic: _History(plan.fields_of(topic)) for topic in topics}
        self._waiting: list[_Row] = []
        self._last = -math.inf
        self._left_out = 0

    def blocks(self) -> Iterator[NumberRows]:
        """Blocks of rows, each column by its name."""
        parts: list[tuple[_Row, dict[str, tuple[float, dict[str, float]]]]] = []
        first = 1
        for row in self._complete():
            near = {t: self._at(row.time, t) for t in self._history}
            fresh = {
                t: found
                for t, found in near.items()
                if found is not None and row.time - found[0] <= self._plan.hold_s[t]
            }
            own = near[self._plan.leader]
            fresh[self._plan.leader] = (row.time, row.fields if own is None else {**own[1], **row.fields})
            if row.time < self._last or not self._plan.needed <= fresh.keys():
                self._left_out += 1
                continue
            self._last = row.time
            parts.append((row, fresh))
            if len(parts) == _ROWS:
                yield self._block(first, parts)
                first, parts = first + len(parts), []
        if parts:
            yield self._block(first, parts)

    def _at(self, time: float, topic: str) -> tuple[float, dict[str, float]] | None:
        """What a topic says at a row, and since when."""
        history, plan = self._history[topic], self._plan
        near = history.nearest(time, plan.within_s)
        pair = history.around(time) if topic in plan.between else None
        if near is None or pair is None or pair[1][0] - pair[0][0] > plan.hold_s[topic]:
            return near
        (before, old), (after, new) = pair
        share = (time - before) / (after - before)
        mixed = {
            name: (1.0 - share) * old[name] + share * new[name]
            for name in plan.between[topic] & old.keys() & new.keys()
        }
        return before, {**near[1], **mixed}

    def _complete(self) -> Iterator[_Row]:
        """Rows in the order of time, each once nothing that belongs to it is still to come."""
        wait = max((self._plan.hold_s[t] for t in self._plan.between), default=0.0)
        patience = max(self._plan.within_s, wait) + self._clock.late_s
        for message, share in self._log.read(frozenset(self._history)):
            now = self._clock.logged(message)
            while self._waiting and self._waiting[0].time + patience < now:
                yield self._waiting.pop(0)
            time = self._clock.time(message)
            self._history[message.topic].add(time, message.fields)
            if message.topic == self._plan.leader and self._key in message.fields:
                insort(self._waiting, _Row(time, message.fields, share), key=lambda row: row.time)
        yield from self._waiting

    def _block(
        self, first: int, parts: Sequence[tuple[_Row, dict[str, tuple[float, dict[str, float]]]]]
    ) -> NumberRows:
        arrays: dict[str, FloatArray] = {"time_s": np.array([row.time for row, _ in parts])}
        for topic, name in self._plan.ages.items():
            ages = [row.time - fresh[topic][0] if topic in fresh else math.nan for row, fresh in parts]
            arrays[name] = np.array(ages)
        for name, (topic, key) in self._plan.wanted.items():
            values = [
                fresh[topic][1].get(key, math.nan) if topic in fresh else math.nan for _, fresh in parts
            ]
            arrays[name] = np.array(values)
        left_out, self._left_out = self._left_out, 0
        return NumberRows(first, arrays, parts[-1][0].share, left_out=left_out)
