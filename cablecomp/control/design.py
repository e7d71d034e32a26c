"""Gains designed from the drive's own stiffness range, with margins over all of it, and the limit
cycles that its hysteresis could sustain.

The deflection compensated for a *measured* load is a feedback: when the link swings on the cable, the
torque sensor shows it and the motor answers, late. With a filter F and all lags, G, the link sees the
stiffness k/(1 - G): compensation at low frequency is bought with less damping at the link's own
frequency. So the filter is designed like a gain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.compensator import Gains
from cablecomp.control.limit_cycle import LimitCycle, limit_cycle
from cablecomp.control.margins import Loop
from cablecomp.control.options import ControlConfig, MotorModel
from cablecomp.control.plant_model import (
    Complex,
)
from cablecomp.control.stiffness import StiffnessRange, stiffness_range
from cablecomp.control.synthesis import DesignWork
from cablecomp.errors import InputError


@dataclass(frozen=True)
class LoopDesign:
    """Everything `cablecomp design` shows; `compensation_error` = |1 - G| at each of `compensation_Hz`."""

    name: str
    rate_Hz: float
    motor: MotorModel
    stiffness: StiffnessRange
    gains: Gains
    loops: tuple[Loop, ...]
    limit_cycle: LimitCycle
    compensation_Hz: tuple[float, ...]
    compensation_error: tuple[float, ...]
    link_Hz: tuple[float, float]
    warnings: tuple[str, ...]
    responses: dict[str, tuple[NDArray[np.float64], Complex]]


def design_loop(config: JointConfig, rate_Hz: float, wanted: ControlConfig | None = None) -> LoopDesign:
    """Design filter and gains for a joint at a loop rate; raises InputError if the motor model cannot
    carry any loop.
    """
    wanted = ControlConfig() if wanted is None else wanted
    stiffness, work = _begun(config, rate_Hz, wanted)
    gains = work.gains()
    loops = work.loops(gains)
    grid = np.geomspace(0.1, 0.45 * rate_Hz, 160)
    G = work.compensation(gains, grid)
    limit = limit_cycle(work, config, gains, float(np.max(np.abs(stiffness.deflection_rad))))
    low, high = (np.sqrt(k / wanted.motor.output_inertia_kgm2) / (2 * pi) for k in stiffness[1:3])
    return LoopDesign(
        config.name,
        rate_Hz,
        wanted.motor,
        stiffness,
        gains,
        loops,
        limit,
        tuple(float(f) for f in grid),
        tuple(float(e) for e in np.abs(1.0 - G)),
        (float(low), float(high)),
        (*_unmet(gains, wanted), *_warnings(gains, loops, limit, float(low))),
        work.responses(gains),
    )


def design_gains(config: JointConfig, rate_Hz: float, wanted: ControlConfig) -> Gains:
    """The gains of `design_loop` without what it shows about them: a run need not wait for that."""
    return _begun(config, rate_Hz, wanted)[1].gains()


def _begun(config: JointConfig, rate_Hz: float, wanted: ControlConfig) -> tuple[StiffnessRange, DesignWork]:
    if not 1.0 <= rate_Hz <= 1e5:
        raise InputError(f"rate is {rate_Hz:g} Hz; 1 to 100 000 Hz is accepted")
    stiffness = stiffness_range(config, wanted.load_max_Nm)
    work = DesignWork(config, 1.0 / rate_Hz, wanted, stiffness)
    work.check_drive()
    return stiffness, work


def _unmet(gains: Gains, wanted: ControlConfig) -> Iterator[str]:
    """Where a gain was to be designed and none keeps the margins."""
    for name in ("motor_integral_per_s", "joint_feedback_per_s", "force_feedback_per_s"):
        if getattr(wanted.compensator, name) is None and getattr(gains, name) == 0.0:
            yield (
                f"{name}: no gain keeps a gain margin of {wanted.gain_margin:g} and a phase margin of "
                f"{wanted.phase_margin_deg:g} deg over all stiffnesses; it is 0: ask for less"
            )


def _warnings(gains: Gains, loops: tuple[Loop, ...], limit: LimitCycle, link_Hz: float) -> tuple[str, ...]:
    lines = [
        f"{loop.name}: unstable at {loop.worst.stiffness_Nm_per_rad:.4g} Nm/rad"
        for loop in loops
        if not loop.worst.stable
    ]
    for amplitude, hertz in limit.found[:3]:
        lines.append(f"limit cycle possible: {amplitude * 1e3:.3g} mrad at {hertz:.3g} Hz")
    if gains.load_filter_Hz < 5.0:
        lines.append(
            f"the link swings at {link_Hz:.3g} Hz on the loaded cable, so that feed-forward on the torque "
            f"sensor has to be slow ({gains.load_filter_Hz:g} Hz); state the expected load in the reference "
            "(load = both), or stiffen the drive"
        )
    return tuple(lines)
