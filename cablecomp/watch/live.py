"""Watch a running joint: its residual goes through the sequential test, and what lies around an alarm is kept.

The loop only hands its rows over (`take`); everything else is done by a worker beside it, so that no cycle waits.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from math import hypot, sqrt
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.locate.location import Location
from cablecomp.effects.catalogue import other_channels
from cablecomp.errors import InputError
from cablecomp.recording.atomic import atomic_file
from cablecomp.recording.writer import write_canonical
from cablecomp.signal.noise import channel_noise, reading_sigma
from cablecomp.signal.smoothing import FloatArray
from cablecomp.signals import Estimate, Sample
from cablecomp.watch.ring import Ring, locate_in_ring
from cablecomp.watch.sequential import Alarm, WatchConfig, start, step

FLOORS: Final = 3.0
"""Noise floors that the residual may have from the start, or times what the joint is known to leave: a friction model
fed with noisy signals shows up to 1.5."""
_MEASURED: Final = (
    "time_s",
    "motor_position_rad",
    "joint_position_rad",
    "joint_torque_Nm",
    "motor_torque_Nm",
    "temperature_degC",
)


@dataclass(frozen=True)
class LiveOptions:
    """How the watch behaves.

    `between_false_alarms_s`: mean time between false alarms, at least; `smallest`: mismatch of interest, in
    units of the usual RMS (less is for `diagnose`); `learning_s`: what is usual is learnt for so long;
    `keep_s`: stretch that is kept around an alarm, `after_s` of it after it; `most`: recordings kept in one
    run; `block_s`: how often rows are handed to the worker.
    """

    between_false_alarms_s: float = 36_000.0
    smallest: float = 1.0
    learning_s: float = 10.0
    keep_s: float = 60.0
    after_s: float = 5.0
    most: int = 8
    block_s: float = 0.1


class LiveWatch:
    """Watches one joint. `folder`: where kept stretches go (`mismatch-1.csv`, `.json`, …); `inline`: no worker, for
    simulated time. The first row is learnt from as it comes: start it when control has begun.
    """

    def __init__(
        self,
        config: JointConfig,
        period_s: float,
        folder: Path,
        options: LiveOptions | None = None,
        *,
        inline: bool = False,
    ) -> None:
        self.options = LiveOptions() if options is None else options
        self.kept: list[Path] = []
        self._folder = folder
        self._offset = config.sensors.joint_position_offset_rad
        self._floor = _stated_floor(config)
        self._known_rad = config.remainder.joint_position_rad or 0.0
        self._channels = (*_MEASURED, *other_channels(config))
        capacity = max(400, round(self.options.keep_s / period_s))
        self._ring = Ring((*self._channels, "load_Nm", "residual_rad"), capacity)
        learning = max(400, round(self.options.learning_s / period_s))
        self._promise = WatchConfig(self.options.between_false_alarms_s, learning, self.options.smallest)
        self._state = start(self._promise)
        self._first = True
        self._alarm: Alarm | None = None
        self._rows: list[tuple[float, ...]] = []
        self._block = max(1, round(self.options.block_s / period_s))
        self._news: deque[str] = deque()
        self._off = False
        self._jobs: deque[Future[None]] = deque()
        self._worker = None if inline else ThreadPoolExecutor(1, thread_name_prefix="live")
        if self._worker is not None:
            self._worker.submit(int).result()  # its thread is there before the loop gets its priority

    def take(self, sample: Sample, estimate: Estimate, trusted: bool) -> str | None:
        """Take in one cycle; `trusted`: no reading was late, frozen or out of range. Returns a line of news, if any."""
        residual = sample.joint_position_rad - estimate.joint_position_rad - self._offset
        self._rows.append(
            (
                sample.time_s,
                sample.motor_position_rad,
                sample.joint_position_rad,
                sample.joint_torque_Nm,
                sample.motor_torque_Nm,
                sample.temperature_degC,
                *sample.other,
                estimate.joint_torque_Nm,
                residual if trusted else float("nan"),
            )
        )
        if len(self._rows) >= self._block:
            self._hand_over()
        return self._news.popleft() if self._news else None

    def finish(self) -> list[str]:
        """Wait for what is under way, keep what an alarm just before the end came with; returns the last news."""
        self._hand_over()
        self._run(self._keep)
        while self._jobs:
            self._jobs.popleft().result()
        if self._worker is not None:
            self._worker.shutdown()
            self._worker = None
        news = list(self._news)
        self._news.clear()
        return news

    # ---- the worker's side -----------------------------------------------------------------------

    def _hand_over(self) -> None:
        rows, self._rows = self._rows, []
        if rows:
            self._run(lambda: self._digest(rows))

    def _run(self, work: Callable[[], None]) -> None:
        if self._worker is None:
            self._do(work)
            return
        while self._jobs and self._jobs[0].done():
            self._jobs.popleft()
        self._jobs.append(self._worker.submit(self._do, work))

    def _do(self, work: Callable[[], None]) -> None:
        """Do it, unless the watch is off; what goes wrong turns it off and is news: the joint runs on."""
        if self._off:
            return
        try:
            work()
        except Exception as error:  # whatever it is, no watch ends a run
            self._off = True
            self._news.append(f"the watch is off: {type(error).__name__}: {error}")

    def _digest(self, rows: list[tuple[float, ...]]) -> None:
        block = np.array(rows)
        self._ring.extend(block)
        if self._alarm is None:
            self._alarm = self._ask(block)
            if self._alarm is not None:
                self._news.append(f"mismatch: {_words(self._alarm)}; locating ...")
        elif block[-1, 0] >= self._alarm.at_s + self.options.after_s:
            self._keep()

    def _keep(self) -> None:
        """Keep what an alarm came with, and learn anew what is usual; a full disk does not stop the joint."""
        alarm, self._alarm = self._alarm, None
        if alarm is None:
            return
        try:
            self._news.append(self._kept(alarm))
        except (OSError, InputError) as error:
            self._news.append(f"mismatch not kept: {error}")
        self._state = start(self._promise)

    def _ask(self, block: FloatArray) -> Alarm | None:
        if len(self.kept) >= self.options.most:
            return None
        for time, residual in zip(block[:, 0].tolist(), block[:, -1].tolist(), strict=True):
            alarm = step(self._state, time, residual)
            if alarm is not None:
                return alarm
        return self._from_the_start(float(block[-1, 0]))

    def _from_the_start(self, now_s: float) -> Alarm | None:
        """Once learning is over: what is usual may be far from noise, and from what the joint is known to leave."""
        usual = self._state.usual
        if usual is None or not self._first:
            return None
        self._first = False
        rms = sqrt(usual.rms**2 + usual.mean**2)
        columns = self._ring.columns()
        floor = hypot(self._noise(columns), self._known_rad)
        if rms <= FLOORS * floor:
            return None
        since = now_s - self.options.learning_s
        return Alarm(now_s, since, "from the start", rms, floor, rms / floor, FLOORS)

    def _kept(self, alarm: Alarm) -> str:
        """Write the ring as a recording and locate the mismatch in it; returns the news."""
        columns = self._ring.columns()
        path = self._folder / f"mismatch-{len(self.kept) + 1}.csv"
        measured = {k: columns[k] for k in self._channels if np.isfinite(columns[k]).any()}
        self._folder.mkdir(parents=True, exist_ok=True)
        write_canonical(path, measured)
        located, words = self._located(columns)
        note = {
            "schema": 1,
            "recording": path.name,
            **asdict(alarm),
            "between_false_alarms_s": self.options.between_false_alarms_s,
            "mismatch": [] if located is None else [m.entry() for m in located.significant()],
            "changes_s": [] if located is None else list(located.changes_s),
        }
        with atomic_file(path.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps(note, indent=1) + "\n", encoding="utf-8")
        self.kept.append(path)
        return f"mismatch located: {words}; kept in {path.name}"

    def _located(self, columns: dict[str, FloatArray]) -> tuple[Location | None, str]:
        asked = {k: v for k, v in columns.items() if k != "load_Nm"}
        asked["joint_torque_Nm"] = columns["load_Nm"]  # the load that the observer ran on, measured or not
        ring = Ring(tuple(asked), max(2, len(columns["time_s"])))
        ring.extend(np.column_stack(list(asked.values())))
        try:
            found = locate_in_ring(ring, self._noise(columns), np.random.default_rng(0))
        except InputError as error:
            return None, f"not yet ({error})"
        first = found.significant()[:1]
        if not first:
            return found, "nowhere in particular"
        m = first[0]
        return found, f"{m.covariate} (share {m.share:.2f}, p = {m.p_value:.3g}): {m.how}"

    def _noise(self, columns: Mapping[str, FloatArray]) -> float:
        return max(self._floor, channel_noise(columns["time_s"], columns["residual_rad"]).sigma)


def _stated_floor(config: JointConfig) -> float:
    sensors = config.sensors
    return max(reading_sigma(sensors.joint_position_noise_rad, sensors.joint_position_resolution_rad), 1e-12)


def _words(alarm: Alarm) -> str:
    size = 1e3 * alarm.size_rad
    if alarm.kind == "from the start":
        return f"residual {abs(size):.3g} mrad RMS since the start, {alarm.log_evidence:.1f} times what is expected"
    usual = f"usual RMS {1e3 * alarm.usual_rad:.3g} mrad"
    if alarm.kind == "wider":
        return f"residual spreads to {size:.3g} mrad since {alarm.since_s:.3f} s ({usual})"
    return f"residual moved by {size:+.3g} mrad since {alarm.since_s:.3f} s ({usual})"
