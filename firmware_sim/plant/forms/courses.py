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


def second_rate(values: Floats, time_s: Floats, reach_s: float = 0.05) -> Floats:
    """Second derivative by time, of differences over `reach_s` either way; within that of an end as at that distance
    from it."""
    at = np.clip(time_s, time_s[0] + reach_s, time_s[-1] - reach_s)
    before, here, after = (np.interp(at + k * reach_s, time_s, values) for k in (-1.0, 0.0, 1.0))
    return np.asarray((after - 2.0 * here + before) / reach_s**2)


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


def ratcheted(time_s: Floats, load_Nm: Floats, start_s: float, duration_s: float, holds_Nm: float) -> Floats:
    """From 0 to 1 as the load pulls: how far it has risen beyond what holds since `start_s`, over how far it does in
    `duration_s`; a step where it never does."""
    within = (time_s[1:] > start_s) & (time_s[:-1] < start_s + duration_s)
    rises = np.maximum(np.diff(np.maximum(load_Nm - holds_Nm, 0.0)), 0.0)
    moved = np.concatenate([[0.0], np.cumsum(rises * within)])
    return moved / moved[-1] if moved[-1] > 0.0 else (time_s >= start_s).astype(float)


def worn_by_travel(
    time_s: Floats, motor_rad: Floats, start_s: float, pace_rad_s: float, travel_rad: float, power: float
) -> Floats:
    """From 0 towards 1 as Weibull has lives end, 1 − e^(−(s/travel)^power), s the motor's way since `start_s`: before
    the first of these samples it went at its pace."""
    went = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(motor_rad)) * (time_s[1:] > start_s))])
    way = went + pace_rad_s * max(float(time_s[0]) - start_s, 0.0)
    return np.asarray(-np.expm1(-((way / travel_rad) ** power)))


def held(time_s: Floats, start_s: float, period_s: float, share: float, rise_s: float) -> Floats:
    """1 for that share of every period, one of which begins at `start_s`, and 0 for the rest; from one to the other in
    `rise_s`."""
    since = np.mod(time_s - start_s, period_s)
    falling = since + (1.0 - share) * period_s  # since what was held in the period before is let go of
    now = np.clip(since / rise_s, 0.0, 1.0) - np.clip((since - share * period_s) / rise_s, 0.0, 1.0)
    return np.asarray(now + np.clip(1.0 - falling / rise_s, 0.0, 1.0))


def schedule(build: Build, column: int, size: float, course: Callable[[Floats], Floats]) -> None:
    """Let every run add `size` times a course over its time [s] to an input column."""

    def fill(inputs: Floats) -> None:
        inputs[:, column] += size * course(inputs[:, TIME])

    build.schedules.append(fill)
