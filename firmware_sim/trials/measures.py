"""Sizes in the joint angle: how wide the plain drive's loop is, and what an effect adds to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from firmware_sim.plant import PlantRun
from firmware_sim.plant.records import Floats
from firmware_sim.trials.courses import Course

_DEGREE = 7
_BINS = 24


@dataclass(frozen=True)
class PlainDrive:
    """What the plain drive does in a course.

    `loop_rad` is the width of its hysteresis loop, `compliance` the mean slope of deflection against load
    (rad/N·m), the rest are RMS values of load (N·m), joint speed (rad/s), joint acceleration (rad/s²) and
    of the neighbour's load about its mean (N·m).
    """

    loop_rad: float
    compliance: float
    deflection_range_rad: float
    load_rms: float
    speed_rms: float
    acceleration_rms: float
    other_rms: float


def loop_width(deflection: Floats, load: Floats) -> float:
    """Width of the hysteresis loop, rad.

    The best memoryless curve of deflection against load (a polynomial) is taken off; over bins of load, the
    greatest distance between the 2nd and the 98th percentile of what is left is the width.
    """
    span = max(float(np.max(np.abs(load))), 1e-12)
    x = load / span
    left = deflection - np.polyval(np.polyfit(x, deflection, _DEGREE), x)
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    widths = [0.0]
    for k in range(_BINS):
        inside = left[place == k]
        if len(inside) >= 20:
            low, high = np.percentile(inside, (2.0, 98.0))
            widths.append(float(high - low))
    return max(widths)


def plain_measures(course: Course, joint_rad: Floats, ratio: float) -> PlainDrive:
    """Measure the plain drive's answer to a course, noise-free."""
    deflection = joint_rad - ratio * course.motor_rad
    load, time = course.load_Nm, course.time_s
    slope = float(np.polyfit(load, deflection, 1)[0]) if np.ptp(load) > 0 else 0.0
    speed = np.gradient(joint_rad, time)
    return PlainDrive(
        loop_width(deflection, load),
        max(slope, 1e-9),
        float(np.ptp(deflection)),
        _rms(load - load.mean()),
        _rms(speed),
        _rms(np.gradient(speed, time)),
        _rms(course.other - course.other.mean()),
    )


def apparent_angle(run: PlantRun, compliance: float, motor_torque: bool = False) -> Floats:
    """The joint angle as the channels tell it, rad: what a sensor of motor angle or torque gets wrong counts
    by what it makes of the joint angle (ratio, mean compliance), that of the motor torque where asked for."""
    angle = (
        run.joint_position_rad
        - run.ratio * (run.motor_position_rad - run.motor_true_rad)
        - compliance * run.joint_torque_Nm
    )
    return np.asarray(angle + compliance / run.ratio * run.motor_torque_Nm if motor_torque else angle)


def contribution(with_effect: Floats, without: Floats) -> float:
    """RMS of what the effect adds to the (apparent) joint angle, rad; a constant, which any encoder's zero
    hides, does not count."""
    added = with_effect - without
    return _rms(added - added.mean())


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
