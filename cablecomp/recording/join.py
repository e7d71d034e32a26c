"""Messages of several topics to rows on one clock, by a stated rule.

A row stands for each message of the *leading* topic. Every other topic gives the value that is nearest in time
among its last message at or before the row and any up to `within_s` after it (messages of one cycle are often
stamped microseconds apart); how old that value is stands beside it as `other_age_<topic>_s`. A value older than
`hold_s` is not used: where a channel needs one, the row is left out, and counted.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right, insort
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

import numpy as np

from cablecomp.recording.clocks import ClockLine, clock_line
from cablecomp.recording.messages import Message, MessageLog
from cablecomp.recording.raw import NumberRows
from cablecomp.recording.table import FloatArray

_ROWS: Final = 1 << 14
_KEPT: Final = 4096
_SAME_CLOCK_S: Final = 2e-3

Clock = Literal["auto", "stamp", "log"]


@dataclass(frozen=True)
class JoinRule:
    """How messages become rows; None = chosen from the recording (`settled` says what)."""

    leader: str | None = None
    within_s: float | None = None
    hold_s: float | None = None
    clock: Clock = "auto"


class Settled(NamedTuple):
    """A rule with everything chosen; `by_stamp`: the senders' stamps are the clock."""

    leader: str
    within_s: float
    hold_s: float
    by_stamp: bool


@dataclass
class TopicFacts:
    """What one pass tells of a topic: messages, fields, period; `clocks`: thinned (stamp, logged) in ns."""

    name: str
    count: int = 0
    fields: dict[str, None] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    stamped: bool = True
    clocks: list[tuple[int, int]] = field(default_factory=list)
    _every: int = 1

    @property
    def period_s(self) -> float:
        """Mean time between messages."""
        return (self.last_ns - self.first_ns) * 1e-9 / max(self.count - 1, 1)

    def take(self, message: Message) -> None:
        """Take in the next message of the topic."""
        self.first_ns = message.logged_ns if self.count == 0 else self.first_ns
        self.last_ns = message.logged_ns
        if self.count < 200 or self.count % 100 == 0:
            self.fields |= dict.fromkeys(message.fields)
        self.stamped = self.stamped and message.stamp_ns is not None
        if self.stamped and message.stamp_ns is not None and self.count % self._every == 0:
            self.clocks.append((message.stamp_ns, message.logged_ns))
            if len(self.clocks) > _KEPT:
                self.clocks, self._every = self._least(), 2 * self._every
        self.count += 1

    def _least(self) -> list[tuple[int, int]]:
        """Of each two neighbours the one with the lesser delay."""
        pairs = zip(self.clocks[::2], self.clocks[1::2], strict=False)
        return [min(pair, key=lambda c: c[1] - c[0]) for pair in pairs]

    def line(self, stamp_origin_ns: int, log_origin_ns: int) -> ClockLine:
        """How to bring this topic's stamps to the logger's clock, both counted from these origins."""
        stamps, logged = (np.array(v, dtype=object) for v in zip(*self.clocks, strict=True))
        return clock_line(
            np.array((stamps - stamp_origin_ns) * 1e-9, dtype=np.float64),
            np.array((logged - log_origin_ns) * 1e-9, dtype=np.float64),
        )


def survey(log: MessageLog, progress: Callable[[float], None] | None = None) -> dict[str, TopicFacts]:
    """One pass over all messages: what each topic holds."""
    found: dict[str, TopicFacts] = {}
    for k, (message, share) in enumerate(log.read(None)):
        facts = found.setdefault(message.topic, TopicFacts(message.topic))
        facts.take(message)
        if progress is not None and k % 4096 == 0:
            progress(share)
    return found


@dataclass(frozen=True)
class Joined:
    """Rows from messages: `read` streams them; `rule` is what was settled, `notes` say it in words."""

    read: Callable[[], Iterator[NumberRows]]
    names: tuple[str, ...]
    rule: Settled
    notes: tuple[str, ...]


def join(
    log: MessageLog,
    topics: Mapping[str, TopicFacts],
    wanted: Mapping[str, tuple[str, str]],
    needed: Collection[str],
    rule: JoinRule,
) -> Joined:
    """Join the `wanted` columns, name -> (topic, field), into rows with `time_s` from the leader's first message.

    A row in which a `needed` column has no fresh value is left out.
    """
    used = {topic: topics[topic] for topic, _ in wanted.values()}
    chosen = settled(rule, used)
    clocks = _Clocks(used, chosen)
    ages = {topic: age_name(topic) for topic in used if topic != chosen.leader}
    names = ("time_s", *wanted, *ages.values())

    def read() -> Iterator[NumberRows]:
        return _Rows(log, wanted, frozenset(needed), ages, chosen, clocks).blocks()

    return Joined(read, names, chosen, tuple(_words(chosen, used, clocks)))


def settled(rule: JoinRule, topics: Mapping[str, TopicFacts]) -> Settled:
    """The rule with everything chosen: the topic with most messages leads; within a quarter of its period;
    values hold for five of their own periods; the senders' stamps are the clock where all topics have them.
    """
    most = max(topics.values(), key=lambda t: t.count).name
    leader = most if rule.leader is None or rule.leader not in topics else rule.leader
    period = topics[leader].period_s
    slowest = max(t.period_s for t in topics.values())
    within = 0.25 * period if rule.within_s is None else rule.within_s
    hold = 5.0 * max(slowest, period) if rule.hold_s is None else rule.hold_s
    stamped = all(t.stamped for t in topics.values()) and rule.clock != "log"
    return Settled(leader, within, hold, stamped)


def age_name(topic: str) -> str:
    """Name of the channel that tells how old a topic's value is in a row."""
    return f"other_age_{re.sub(r'[^A-Za-z0-9]+', '_', topic).strip('_') or 'topic'}_s"


class _Clocks:
    """Time of a message on the one clock: the logger's, counted from the leader's first message."""

    def __init__(self, topics: Mapping[str, TopicFacts], rule: Settled) -> None:
        self._origin = topics[rule.leader].first_ns
        self._stamp = rule.by_stamp
        self.lines: dict[str, ClockLine] = {}
        self._origins: dict[str, int] = {}
        if self._stamp:
            for name, topic in topics.items():
                self._origins[name] = topic.clocks[0][0]
                self.lines[name] = topic.line(self._origins[name], self._origin)
            self._share(rule.leader)

        self.late_s = 1e-3 + max((self._lateness(topic) for topic in topics.values()), default=0.0)

    def _lateness(self, topic: TopicFacts) -> float:
        """How long after its own time nearly every message (99.9 %) of a topic is logged."""
        if not self._stamp:
            return 0.0
        late = [
            (logged - self._origin) * 1e-9
            - self.lines[topic.name].logged((stamp - self._origins[topic.name]) * 1e-9)
            for stamp, logged in topic.clocks
        ]
        return min(max(float(np.quantile(late, 0.999)), 0.0), 1.0)

    def _share(self, leader: str) -> None:
        """Topics whose stamps come from the leader's clock take its line: their delays may differ."""
        line, origin = self.lines[leader], self._origins[leader]
        for name, own in self.lines.items():
            ahead = (self._origins[name] - origin) * 1e-9
            if abs(own.logged(0.0) - line.logged(ahead)) < _SAME_CLOCK_S:
                self.lines[name] = ClockLine(line.rate, line.logged(ahead), own.delay_s)

    def logged(self, message: Message) -> float:
        """When the message was logged [s]."""
        return (message.logged_ns - self._origin) * 1e-9

    def time(self, message: Message) -> float:
        """The message's own time [s]."""
        if self._stamp and message.stamp_ns is not None:
            line = self.lines[message.topic]
            return line.logged((message.stamp_ns - self._origins[message.topic]) * 1e-9)
        return self.logged(message)


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


class _Rows:
    """The running state of a join."""

    def __init__(
        self,
        log: MessageLog,
        wanted: Mapping[str, tuple[str, str]],
        needed: frozenset[str],
        ages: Mapping[str, str],
        rule: Settled,
        clocks: _Clocks,
    ) -> None:
        self._log, self._wanted, self._ages, self._rule, self._clocks = log, wanted, ages, rule, clocks
        self._needed = {wanted[name][0] for name in needed} - {rule.leader}
        self._key = next(field for topic, field in wanted.values() if topic == rule.leader)
        topics = {topic for topic, _ in wanted.values()}
        self._history = {
            topic: _History(frozenset(f for t, f in wanted.values() if t == topic)) for topic in topics
        }
        self._waiting: list[_Row] = []
        self._last = -math.inf
        self._left_out = 0

    def blocks(self) -> Iterator[NumberRows]:
        """Blocks of rows, each column by its name."""
        parts: list[tuple[_Row, dict[str, tuple[float, dict[str, float]]]]] = []
        first = 1
        for row in self._complete():
            near = {t: h.nearest(row.time, self._rule.within_s) for t, h in self._history.items()}
            fresh = {
                t: found
                for t, found in near.items()
                if found is not None and row.time - found[0] <= self._rule.hold_s
            }
            own = near[self._rule.leader]
            fresh[self._rule.leader] = (row.time, row.fields if own is None else {**own[1], **row.fields})
            if row.time < self._last or not self._needed <= fresh.keys():
                self._left_out += 1
                continue
            self._last = row.time
            parts.append((row, fresh))
            if len(parts) == _ROWS:
                yield self._block(first, parts)
                first, parts = first + len(parts), []
        if parts:
            yield self._block(first, parts)

    def _complete(self) -> Iterator[_Row]:
        """Rows in the order of time, each once nothing that belongs to it is still to come."""
        patience = self._rule.within_s + self._clocks.late_s
        for message, share in self._log.read(frozenset(self._history)):
            now = self._clocks.logged(message)
            while self._waiting and self._waiting[0].time + patience < now:
                yield self._waiting.pop(0)
            time = self._clocks.time(message)
            self._history[message.topic].add(time, message.fields)
            if message.topic == self._rule.leader and self._key in message.fields:
                insort(self._waiting, _Row(time, message.fields, share), key=lambda row: row.time)
        yield from self._waiting

    def _block(
        self, first: int, parts: Sequence[tuple[_Row, dict[str, tuple[float, dict[str, float]]]]]
    ) -> NumberRows:
        arrays: dict[str, FloatArray] = {"time_s": np.array([row.time for row, _ in parts])}
        for topic, name in self._ages.items():
            ages = [row.time - fresh[topic][0] if topic in fresh else math.nan for row, fresh in parts]
            arrays[name] = np.array(ages)
        for name, (topic, key) in self._wanted.items():
            values = [
                fresh[topic][1].get(key, math.nan) if topic in fresh else math.nan for _, fresh in parts
            ]
            arrays[name] = np.array(values)
        left_out, self._left_out = self._left_out, 0
        return NumberRows(first, arrays, parts[-1][0].share, left_out=left_out)


def _words(rule: Settled, topics: Mapping[str, TopicFacts], clocks: _Clocks) -> Iterator[str]:
    if len(topics) > 1:
        yield (
            f"a row for each message of {rule.leader}; other topics by their nearest message up to "
            f"{1e3 * rule.within_s:.3g} ms after it, none older than {1e3 * rule.hold_s:.3g} ms"
        )
    if rule.by_stamp:
        for name, line in clocks.lines.items():
            yield (
                f"time of {name}: its sender's stamps, brought to the logger's clock (rate {line.rate - 1.0:+.2e}, "
                f"median delay {1e3 * line.delay_s:.3g} ms)"
            )
