"""Compiled readout: from what the joint does to what stands in its noise-free channels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from firmware_sim.plant.jit import part

READOUT = np.dtype(
    [
        ("compliance", "f8"),  # rad per N·m of load path
        ("gap", "f8"),  # rad, total clearance
        ("gap_side", "f8"),  # state: which flank bears
        ("mount_compliance", "f8"),  # rad/(N·m), creeping mount
        ("mount_time_s", "f8"),
        ("mount_angle", "f8"),  # state
        ("bend_compliance", "f8"),  # rad/(N·m), mount that stiffens as it is loaded
        ("mount_yield_Nm", "f8"),
        ("flex_compliance", "f8"),  # rad per unit of another channel
        ("joint_ripple", "f8"),  # rad, joint encoder's own periodic error
        ("joint_ripple_order", "f8"),
        ("joint_ripple_phase", "f8"),
        ("motor_ripple", "f8"),
        ("motor_ripple_order", "f8"),
        ("motor_ripple_phase", "f8"),
        ("torque_square", "f8"),  # 1/(N·m)
        ("torque_play_share", "f8"),
        ("torque_play_Nm", "f8"),
        ("torque_play", "f8"),  # state
        ("torque_per_K", "f8"),
        ("torque_ref", "f8"),
        ("cog_Nm", "f8"),  # motor torque ripple
        ("cog_order", "f8"),
        ("cog_phase", "f8"),
        # results
        ("joint_rad", "f8"),
        ("motor_rad", "f8"),
        ("joint_Nm", "f8"),
        ("motor_Nm", "f8"),
    ]
)


@part
def read_out(
    r: Any,
    h: float,
    q_out: float,
    q_in: float,
    path: float,
    load: float,
    motor: float,
    warm: float,
    other: float,
) -> None:
    """Fill the results: encoders behind compliance, clearance and mounts, torque sensor and motor current
    with their errors.

    `path` is the torque that passes the load path, `load` the external moment, both N·m along +q_out; h in s.
    """
    if path != 0.0:
        r.gap_side = 1.0 if path > 0.0 else -1.0
    angle = q_out + r.compliance * path + 0.5 * r.gap * r.gap_side
    if r.mount_compliance != 0.0:
        r.mount_angle += (r.mount_compliance * path - r.mount_angle) * (-math.expm1(-h / r.mount_time_s))
        angle += r.mount_angle
    if r.bend_compliance != 0.0:
        angle += r.bend_compliance * r.mount_yield_Nm * math.tanh(path / r.mount_yield_Nm)
    angle += r.flex_compliance * other
    r.joint_rad = angle + r.joint_ripple * math.sin(r.joint_ripple_order * angle + r.joint_ripple_phase)
    r.motor_rad = q_in + r.motor_ripple * math.sin(r.motor_ripple_order * q_in + r.motor_ripple_phase)
    torque = load + r.torque_square * load * load + r.torque_per_K * (warm - r.torque_ref)
    if r.torque_play_share != 0.0:
        width = r.torque_play_Nm
        r.torque_play = min(max(r.torque_play, load - width), load + width)
        torque += r.torque_play_share * (r.torque_play - load)
    r.joint_Nm = torque
    r.motor_Nm = motor + r.cog_Nm * math.sin(r.cog_order * q_in + r.cog_phase)
