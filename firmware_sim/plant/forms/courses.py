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


def stairs(time_s: Floats, start_s: float, duration_s: float, steps: float) -> Floats:
    """From 0 to 1 in equal steps, the first at `start_s`, the last `duration_s` after it."""
    count = max(round(steps), 1)
    at = start_s + duration_s * np.arange(count) / max(count - 1, 1)
    return np.searchsorted(at, time_s, side="right") / count


def schedule(build: Build, column: int, size: float, course: Callable[[Floats], Floats]) -> None:
    """Let every run add `size` times a course over its time [s] to an input column."""

    def fill(inputs: Floats) -> None:
        inputs[:, column] += size * course(inputs[:, TIME])

    build.schedules.append(fill)
