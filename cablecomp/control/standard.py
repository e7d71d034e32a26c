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
    """The joint's limits, drawn in to `share`; +-45 degrees where it states none."""
    low, high = config.limits.joint_position_min_rad, config.limits.joint_position_max_rad
    low = -pi / 4 if low is None else low
    high = pi / 4 if high is None else high
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    return Span(share * greatest_load(config), middle - half, middle + half)


def calibration_protocol(config: JointConfig, share: float = 0.8) -> Protocol:
    """About 60 s that show EA, pretension and both coefficients of friction: load loops within loops,
    at rest and turning.
    """
    s = span_of(config, share)
    m = s.load_Nm
    one_sided = config.drive.circuit == "open"
    base = 0.5 * m if one_sided else 0.0
    peaks = tuple(base + x * (m - base) for x in (1.0, -0.9, 0.7, -0.5, 0.35, -0.2))
    speed = (s.high_rad - s.low_rad) / 4.0
    segments: tuple[Segment, ...] = (
        Ramp(duration_s=1.0, load_Nm=base),
        NestedReversals(peaks=peaks, rate=0.55 * m),
        Hold(duration_s=1.0),
        AngleSweep(
            from_rad=s.low_rad,
            to_rad=s.high_rad,
            speed_rad_s=speed,
            load_Nm=base + 0.4 * (m - base),
            load_rate_Nm_s=m,
        ),
        Ramp(duration_s=3.0, position_rad=s.low_rad, load_Nm=m),
        Ramp(duration_s=4.0, position_rad=s.high_rad, load_Nm=base - 0.8 * (m - base)),
        Ramp(duration_s=3.0, position_rad=0.3 * s.high_rad, load_Nm=base + 0.5 * (m - base)),
        SineSweep(amplitude=0.35 * m if not one_sided else 0.2 * m, from_Hz=0.15, to_Hz=0.4, duration_s=10.0),
        Ramp(duration_s=3.0, position_rad=s.low_rad, load_Nm=base - 0.5 * (m - base)),
        Ramp(duration_s=4.0, position_rad=0.0, load_Nm=base + 0.9 * (m - base)),
        Unload(rate_Nm_s=0.5 * m, dwell_s=0.5),
    )
    return Protocol(name="calibration", segment=segments, note="made from the joint's limits")


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
        last = config.drive.stage[-1]
        m = min(m, 0.6 * last.pretension_N * last.output_radius_m)
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
