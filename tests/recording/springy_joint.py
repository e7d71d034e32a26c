"""Channels of a drive that the tests of foreign columns read."""

from __future__ import annotations

import numpy as np

RATIO = 0.25


def joint(rows: int = 4000) -> dict[str, np.ndarray]:
    """A drive that gives way by 4 mrad/(N m), with friction of 0.03 N m at the motor: nothing of our mechanics."""
    t = np.arange(rows) * 1e-3
    q = 1.2 * np.sin(2.0 * np.pi * 0.5 * t) + 0.1 * np.sin(2.0 * np.pi * 3.1 * t)
    load = 1.5 * np.sin(2.0 * np.pi * 0.8 * t + 0.4)
    return {
        "time_s": t,
        "motor_position_rad": q,
        "joint_position_rad": RATIO * q + 4e-3 * load,
        "joint_torque_Nm": load,
        "motor_torque_Nm": -RATIO * load + 0.03 * np.sign(np.gradient(q)),
    }
