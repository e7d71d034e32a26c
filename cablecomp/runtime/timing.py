"""The report that a run ends with: how it kept its time and its data."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import inf
from typing import Any

from cablecomp.counting import counted
from cablecomp.runtime.histogram import Spread
from cablecomp.runtime.minutes import Minute, shown


@dataclass(frozen=True)
class TimingReport:
    """How a run kept its time and its data.

    `period`: time between the beginnings of two ticks; `jitter`: how late a tick began; `cycle`: decode,
    observe, compensate, encode, record of all joints; `step`: observer and compensator of one joint;
    `data_age`: age of the oldest channel used. `misses`: cycles that ended after the next tick was due;
    `skipped`: ticks left out for that. `policy` says what of scheduling, memory and garbage collection could
    be had, and what not; `minutes`: the whole minutes of a long run one by one; `stepped`: time was simulated,
    so that rate, period, late begin and data age say nothing of this machine.
    """

    rate_Hz: float
    asked_Hz: float
    ticks: int
    skipped: int
    misses: int
    period: Spread
    jitter: Spread
    poll: Spread
    step: Spread
    cycle: Spread
    data_age: Spread
    frames: int
    lost_frames: int
    invalid_frames: int
    foreign_frames: int
    repeated_frames: int
    reordered_frames: int
    dropped_frames: int
    send_failures: int
    policy: tuple[str, ...]
    minutes: tuple[Minute, ...] = ()
    stepped: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON (NaN and infinity as None)."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain

    def rows(self) -> list[tuple[str, str]]:
        """Name and words of each line, as the terminal and the report page show them."""
        us = 1e6
        spread = "p50 {0:.1f}  p99 {1:.1f}  p99.9 {2:.1f}  max {3:.1f} µs"

        def line(s: Spread) -> str:
            return spread.format(s.p50_s * us, s.p99_s * us, s.p999_s * us, s.max_s * us)

        work = [
            ("poll", line(self.poll)),
            ("step of one joint", line(self.step)),
            ("whole cycle", line(self.cycle)),
        ]
        if self.stepped:
            measured = [
                (
                    "time",
                    f"simulated, {self.ticks} ticks of 1/{self.asked_Hz:g} s: neither rate nor lateness was measured",
                ),
                *work,
                ("longer than a tick", f"{counted(self.misses, 'cycle')}: late, had it been real time"),
            ]
        else:
            measured = [
                ("rate", f"{self.rate_Hz:.2f} Hz of {self.asked_Hz:g} Hz asked"),
                ("ticks", f"{self.ticks}, {self.misses} missed their end, {self.skipped} skipped"),
                ("period", line(self.period)),
                ("late begin", line(self.jitter)),
                *work,
                ("data age", line(self.data_age)),
            ]
        return [
            *measured,
            (
                "frames",
                f"{self.frames} taken, {self.lost_frames} lost, {self.repeated_frames} repeated, "
                f"{self.reordered_frames} reordered, {self.invalid_frames} damaged, "
                f"{self.foreign_frames} of other devices, {self.dropped_frames} dropped "
                f"by the system, {self.send_failures} not sent",
            ),
            *((f"minute {m.number}", m.words()) for m in shown(self.minutes)),
            *(("policy", line_) for line_ in self.policy),
        ]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not -inf < value < inf:
        return None
    return value
