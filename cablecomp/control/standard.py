"""Protocols that suit any joint, made from its limits: one to calibrate from, unseen motions to be
judged by, torques to make.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.control.protocol import (
    AngleSweep,
    Hold,
    NestedReversals,
    Protocol,
    Ramp,
    Segment,
    SineSweep,
    Unload,
)
from cablecomp.control.stiffness import greatest_load


class Span(NamedTuple):
    """Half the load (Nm) and the range of positions (rad) that a protocol makes use of."""

    load_Nm: float
    low_rad: float
    high_rad: float


def span_of(config: JointConfig, share: float = 0.8) -> Span:
    """The limits of joint and motor, drawn in to `share`; +-45 degrees where none is stated."""
    limits, ratio = config.limits, config.drive.ratio
    lows = [limits.joint_position_min_rad, _at_joint(limits.motor_position_min_rad, ratio)]
    highs = [limits.joint_position_max_rad, _at_joint(limits.motor_position_max_rad, ratio)]
    low = max((v for v in lows if v is not None), default=-pi / 4)
    high = min((v for v in highs if v is not None), default=pi / 4)
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    most = greatest_load(config)
    if limits.motor_torque_max_Nm is not None:
        most = min(most, limits.motor_torque_max_Nm / ratio)
    return Span(share * most, middle - half, middle + half)


def _at_joint(motor_rad: float | None, ratio: float) -> float | None:
    return None if motor_rad is None else ratio * motor_rad


def calibration_protocol(config: JointConfig, share: float = 0.8) -> Protocol:
    """About 60 s that show EA, pretension and both coefficients of friction: a swing through the range, which erases
    what went before; load loops within loops at rest; motion under changing load.
    """
    s = span_of(config, share)
    m, base = s.load_Nm, _base(config, s)
    slower = _slower(config, s)
    segments: tuple[Segment, ...] = (
        Ramp(duration_s=1.0, load_Nm=base),
        *turning_under_load(config, share),
        Ramp(duration_s=2.0 * slower, position_rad=0.5 * (s.low_rad + s.high_rad), load_Nm=base),
        *loops_at_rest(config, share),
        Ramp(duration_s=3.0 * slower, position_rad=s.low_rad, load_Nm=m),
        Ramp(duration_s=4.0 * slower, position_rad=s.high_rad, load_Nm=base - 0.8 * (m - base)),
        Ramp(duration_s=3.0 * slower, position_rad=0.3 * s.high_rad, load_Nm=base + 0.5 * (m - base)),
        SineSweep(amplitude=0.35 * m if base == 0.0 else 0.2 * m, from_Hz=0.15, to_Hz=0.4, duration_s=10.0),
        Ramp(duration_s=3.0 * slower, position_rad=s.low_rad, load_Nm=base - 0.5 * (m - base)),
        Ramp(duration_s=4.0 * slower, position_rad=0.0, load_Nm=base + 0.9 * (m - base)),
        Unload(rate_Nm_s=0.5 * m, dwell_s=0.5),
    )
    return Protocol(name="calibration", segment=segments, note="made from the joint's limits")


def loops_at_rest(config: JointConfig, share: float = 0.8) -> tuple[Segment, ...]:
    """Load loops within loops, the motor at rest."""
    s = span_of(config, share)
    base = _base(config, s)
    peaks = tuple(base + x * (s.load_Nm - base) for x in (1.0, -0.9, 0.7, -0.5, 0.35, -0.2))
    return NestedReversals(peaks=peaks, rate=0.55 * s.load_Nm), Hold(duration_s=1.0)


def turning_under_load(config: JointConfig, share: float = 0.8) -> tuple[Segment, ...]:
    """There and back through the range under a load that is held."""
    s = span_of(config, share)
    base = _base(config, s)
    return (
        AngleSweep(
            from_rad=s.low_rad,
            to_rad=s.high_rad,
            speed_rad_s=(s.high_rad - s.low_rad) / (4.0 * _slower(config, s)),
            load_Nm=base + 0.4 * (s.load_Nm - base),
            load_rate_Nm_s=s.load_Nm,
        ),
    )


def _base(config: JointConfig, span: Span) -> float:
    """The load about which a protocol works: an open circuit has to be kept taut."""
    return 0.5 * span.load_Nm if config.drive.circuit == "open" else 0.0


def _slower(config: JointConfig, span: Span) -> float:
    """By what motions are stretched so that the motor keeps its speed; a least-jerk move peaks at 1.875 of its mean."""
    most = config.limits.motor_velocity_max_rad_s
    if most is None:
        return 1.0
    peak = 1.875 * (span.high_rad - span.low_rad) / 4.0 / config.drive.ratio
    return max(1.0, peak / (0.8 * most))


def reaching_protocol(
    config: JointConfig, seed: int, duration_s: float = 30.0, share: float = 0.75, pace: float = 1.0
) -> Protocol:
    """Reaching motions with a load that changes meanwhile, drawn from `seed`.

    Every reach takes 2 to 4 s over `pace`; some are followed by a rest. The last one leads back to zero.
    """
    s = span_of(config, share)
    rng = np.random.default_rng(seed)
    lowest = 0.0 if config.drive.circuit == "open" else -s.load_Nm
    segments: list[Segment] = []
    total = 0.0
    while total < duration_s - 3.0:
        time = float(rng.uniform(2.0, 4.0)) / pace
        position = float(rng.uniform(s.low_rad, s.high_rad))
        load = float(rng.uniform(lowest, s.load_Nm))
        segments.append(Ramp(duration_s=time, position_rad=position, load_Nm=load))
        total += time
        if rng.random() < 0.3:
            segments.append(Hold(duration_s=0.8 / pace))
            total += 0.8 / pace
    segments.append(Ramp(duration_s=3.0, position_rad=0.0, load_Nm=0.0))
    return Protocol(name=f"reaching-{seed}", segment=tuple(segments), note="unseen motions with load changes")


def force_protocol(config: JointConfig, seed: int, duration_s: float = 20.0, share: float = 0.8) -> Protocol:
    """Torques to be made against a held output: ramps between random levels of one sign (the
    surroundings push back along -q).
    """
    m = span_of(config, share).load_Nm
    if config.drive.circuit == "open":  # beyond its pretension the cable would hang slack
        m = min(m, 0.6 * config.drive.stage[-1].pretension_moment_Nm)
    rng = np.random.default_rng(seed)
    segments: list[Segment] = []
    total = 0.0
    while total < duration_s - 2.0:
        time = float(rng.uniform(1.5, 3.0))
        segments.append(Ramp(duration_s=time, load_Nm=-float(rng.uniform(0.1, 1.0)) * m))
        total += time
        if rng.random() < 0.3:
            segments.append(Hold(duration_s=0.6))
            total += 0.6
    segments.append(Ramp(duration_s=2.0, load_Nm=-0.2 * m))
    return Protocol(
        name=f"force-{seed}",
        mode="force",
        segment=tuple(segments),
        start_load_Nm=-0.1 * m,
        note="torques against a wall",
    )
