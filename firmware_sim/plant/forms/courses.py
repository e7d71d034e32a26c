"""Courses over time that several forms use."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import TIME
from firmware_sim.plant.records import Floats


def low_passed(values: Floats, time_s: Floats, lag_s: float) -> Floats:
    """First-order lag: lag ẏ + y = x, x on a line between samples, y = x at the first; lag 0 changes nothing."""
    if lag_s <= 0.0:
        return values.copy()
    result = np.empty_like(values)
    y = x0 = float(values[0])
    result[0] = y
    for k, (x, h) in enumerate(zip(values[1:].tolist(), np.diff(time_s).tolist(), strict=True), start=1):
        decay = math.exp(-h / lag_s)
        slope = (x - x0) / h
        # y follows a ramp with the lag, and what it was away from that dies out
        y = x - slope * lag_s + (y - x0 + slope * lag_s) * decay
        result[k], x0 = y, x
    return result


def ramp(time_s: Floats, start_s: float, duration_s: float) -> Floats:
    """From 0 to 1 in `duration_s`; a step where that is 0."""
    if duration_s <= 0.0:
        return (time_s >= start_s).astype(float)
    return np.clip((time_s - start_s) / duration_s, 0.0, 1.0)


def settling(time_s: Floats, start_s: float, lag_s: float) -> Floats:
    """From 0 towards 1, ever more slowly: 1 − e^(−t/lag) from `start_s` on."""
    return -np.expm1(-np.maximum(time_s - start_s, 0.0) / max(lag_s, 1e-9))


def stairs(
    time_s: Floats, start_s: float, duration_s: float, steps: float, growth: float = 1.0, wait: float = 1.0
) -> Floats:
    """From 0 to 1 in steps, the first at `start_s`, the last `duration_s` after it: each `growth` times as large as the
    one before, and waited for `wait` times as long."""
    count = max(round(steps), 1)
    waits, sizes = wait ** np.arange(count - 1), growth ** np.arange(count)
    at = start_s + duration_s * np.concatenate([[0.0], np.cumsum(waits) / max(np.sum(waits), 1e-300)])
    gone = np.concatenate([[0.0], np.cumsum(sizes) / np.sum(sizes)])
    return gone[np.searchsorted(at, time_s, side="right")]


def worked(time_s: Floats, load_Nm: Floats, start_s: float, duration_s: float) -> Floats:
    """From 0 to 1 as the load comes and goes: how far it has gone up and down since `start_s`, over how far it goes in
    `duration_s`; a step where it rests for all that time."""
    within = (time_s[1:] > start_s) & (time_s[:-1] < start_s + duration_s)
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(load_Nm)) * within)])
    return moved / moved[-1] if moved[-1] > 0.0 else (time_s >= start_s).astype(float)


def schedule(build: Build, column: int, size: float, course: Callable[[Floats], Floats]) -> None:
    """Let every run add `size` times a course over its time [s] to an input column."""

    def fill(inputs: Floats) -> None:
        inputs[:, column] += size * course(inputs[:, TIME])

    build.schedules.append(fill)
