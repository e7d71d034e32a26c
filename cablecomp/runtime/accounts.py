"""What a loop keeps count of while it runs: ticks, times of each cycle, minutes; and the report made of it."""

from __future__ import annotations

from math import inf

from cablecomp.links.link import Link, LinkStatus
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.health import Checked
from cablecomp.runtime.histogram import CycleTimes
from cablecomp.runtime.minutes import Minute, Minutes
from cablecomp.runtime.timing import TimingReport


class Accounts:
    """Of a loop of that period: `tick` at every one, `cycle` and `joint` at those under control; `last_s`: when the
    last tick began."""

    def __init__(self, period_s: float) -> None:
        self.times = CycleTimes()
        self.last_s = -inf
        self._first_s = -inf
        self._period_s = period_s
        self._minutes = Minutes()
        self._ticks = 0

    def tick(self, tick: Tick) -> None:
        """One more, whatever was done in it."""
        if self._ticks == 0:
            self._first_s = tick.now_s
        else:
            self.times.period.add(tick.now_s - self.last_s)
        self._ticks += 1
        self.last_s = tick.now_s

    def cycle(self, tick: Tick, begin: float, polled: float, end: float) -> None:
        """What the tick took, from when it began to when it had polled and when its commands were out (s)."""
        t = self.times
        t.jitter.add(tick.late_s)
        t.poll.add(polled - begin)
        t.cycle.add(end - begin)
        if end - begin + tick.late_s > self._period_s:
            t.misses += 1

    def joint(self, step_s: float, checked: Checked | None) -> None:
        """What a joint's step took, and how old its data were."""
        t = self.times
        t.step.add(step_s)
        if checked is not None:
            age = max(checked.motor_age_s, checked.load_age_s)
            t.data_age.add(min(age, 1e9))

    def minute(self, since_s: float, skipped: int, link: Link) -> Minute | None:
        """The minute under control that is just over, if one is."""
        if since_s < self._minutes.due_s:
            return None
        return self._minutes.close(self.times, skipped, link.status())

    def report(
        self, status: LinkStatus, skipped: int, policy: tuple[str, ...], *, stepped: bool
    ) -> TimingReport:
        """How time and data were kept so far; `policy`: what could be had of the system."""
        t, span = self.times, self.last_s - self._first_s
        return TimingReport(
            rate_Hz=(self._ticks - 1) / span if span > 0.0 else 0.0,
            asked_Hz=1.0 / self._period_s,
            ticks=self._ticks,
            skipped=skipped,
            misses=t.misses,
            period=t.period.spread(),
            jitter=t.jitter.spread(),
            poll=t.poll.spread(),
            step=t.step.spread(),
            cycle=t.cycle.spread(),
            data_age=t.data_age.spread(),
            frames=status.frames,
            lost_frames=status.lost,
            invalid_frames=status.invalid,
            foreign_frames=status.foreign,
            repeated_frames=status.repeated,
            reordered_frames=status.reordered,
            dropped_frames=status.dropped,
            send_failures=status.send_failures,
            policy=policy,
            minutes=tuple(self._minutes.done),
            stepped=stepped,
        )
