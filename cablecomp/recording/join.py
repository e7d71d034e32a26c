"""Messages of several topics to rows on one clock, by a stated rule.

A row stands for each message of the *leading* topic. Every other topic gives the value that is nearest in time
among its last message at or before the row and any up to `within_s` after it (messages of one cycle are often
stamped microseconds apart); how old that value is stands beside it as `other_age_<topic>_s`. A value older than
`hold_s` is not used: where a channel needs one, the row is left out, and counted.

A topic of another rate is interpolated between its messages before and after the row: held, 200 Hz would lag 2.5 ms
behind on average, in which a joint moves farther than its cable gives way.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.clocks import ClockLine
from cablecomp.recording.join_rows import JoinedRows, JoinPlan
from cablecomp.recording.messages import Message, MessageLog
from cablecomp.recording.raw import NumberRows
from cablecomp.recording.topics import TopicFacts

_SAME_CLOCK_S: Final = 2e-3
_SAME_RATE: Final = 1.5

Clock = Literal["auto", "stamp", "log"]


@dataclass(frozen=True)
class JoinRule:
    """How messages become rows; None = chosen from the recording (`settled` says what)."""

    leader: str | None = None
    within_s: float | None = None
    hold_s: float | None = None
    clock: Clock = "auto"


class Settled(NamedTuple):
    """A rule with everything chosen; `hold_s` by topic; `by_stamp`: the senders' stamps are the clock."""

    leader: str
    within_s: float
    hold_s: dict[str, float]
    by_stamp: bool


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
    steady: Collection[str] = (),
) -> Joined:
    """Join the `wanted` columns, name -> (topic, field), into rows with `time_s` from the leader's first message.

    A row in which a `needed` column has no fresh value is left out. A row stands for each message of the leader
    that holds the first of its wanted fields. `steady`: columns that change steadily and may be interpolated. Raises
    InputError if the rule names a leader that is not there.
    """
    used = {topic: topics[topic] for topic, _ in wanted.values()}
    chosen = settled(rule, used)
    clock = _OneClock(used, chosen)
    ages = _age_names([topic for topic in used if topic != chosen.leader])
    after = frozenset(wanted[name][0] for name in needed) - {chosen.leader}
    between = _between(used, chosen.leader, {n: place for n, place in wanted.items() if n in steady})
    plan = JoinPlan(wanted, after, ages, chosen.leader, chosen.within_s, chosen.hold_s, between)
    names = ("time_s", *wanted, *ages.values())
    return Joined(
        lambda: JoinedRows(log, plan, clock).blocks(),
        names,
        chosen,
        tuple(_words(chosen, used, clock, between)),
    )


def settled(rule: JoinRule, topics: Mapping[str, TopicFacts]) -> Settled:
    """The rule with everything chosen: the topic with most messages leads; within a quarter of its period; a value
    holds for five periods of its own or of the leader; the senders' stamps are the clock where all topics have
    them.
    """
    if rule.leader is not None and rule.leader not in topics:
        raise InputError(f"[join] leader '{rule.leader}' is none of the topics used: {', '.join(topics)}")
    leader = rule.leader or max(topics.values(), key=lambda t: t.count).name
    period = topics[leader].period_s
    within = 0.25 * period if rule.within_s is None else rule.within_s
    hold = {
        name: 5.0 * max(topic.period_s, period) if rule.hold_s is None else rule.hold_s
        for name, topic in topics.items()
    }
    stamped = all(t.stamped for t in topics.values()) and rule.clock != "log"
    return Settled(leader, within, hold, stamped)


def _age_names(topics: Sequence[str]) -> dict[str, str]:
    """Name of the channel that tells how old a topic's value is, for each topic."""
    found: dict[str, str] = {}
    for topic in topics:
        bare = re.sub(r"[^A-Za-z0-9]+", "_", topic).strip("_") or "topic"
        twice = sum(name.startswith(f"other_age_{bare}") for name in found.values())
        found[topic] = f"other_age_{bare}{f'_{twice + 1}' if twice else ''}_s"
    return found


class _OneClock:
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


def _between(
    topics: Mapping[str, TopicFacts], leader: str, steady: Mapping[str, tuple[str, str]]
) -> dict[str, frozenset[str]]:
    """Topic -> fields to interpolate, of the topics that are slower or faster than the leader."""
    period = topics[leader].period_s
    found: dict[str, frozenset[str]] = {}
    for topic, name in steady.values():
        other = topics[topic].period_s
        if topic != leader and not period / _SAME_RATE < other < period * _SAME_RATE:
            found[topic] = found.get(topic, frozenset()) | {name}
    return found


def _words(
    rule: Settled, topics: Mapping[str, TopicFacts], clock: _OneClock, between: Collection[str]
) -> Iterator[str]:
    if len(topics) > 1:
        yield (
            f"a row for each message of {rule.leader}; other topics by their nearest message up to "
            f"{1e3 * rule.within_s:.3g} ms after it, none older than {1e3 * max(rule.hold_s.values()):.3g} ms"
        )
    if between:
        yield f"between the messages before and after a row, as it comes at another rate: {', '.join(between)}"
    if rule.by_stamp:
        for name, line in clock.lines.items():
            yield (
                f"time of {name}: its sender's stamps, brought to the logger's clock (drift "
                f"{1e6 * (line.rate - 1.0):.0f} ppm, median delay {1e3 * line.delay_s:.3f} ms)"
            )
