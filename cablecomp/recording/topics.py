"""What one pass over a log of messages tells of its topics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cablecomp.recording.clocks import ClockLine, clock_line
from cablecomp.recording.messages import Message, MessageLog

_KEPT: Final = 4096


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
