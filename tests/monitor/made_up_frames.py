"""Frames made up for those who look on."""

from __future__ import annotations

import numpy as np

from cablecomp.monitor.frames import Frame, frame
from cablecomp.observer import WrapProfile

WRAP = WrapProfile(
    "cable h, output pulley", np.linspace(0.0, 6.0, 200), 60.0 + np.sin(np.linspace(0.0, 6.0, 200))
)


def made_up(k: int) -> Frame:
    """Frame number k of a joint under a swinging load."""
    load = float(np.sin(0.1 * k))
    return frame(
        {
            "time_s": 0.04 * k, "joint": "wrist", "phase": "normal", "load_Nm": load, "deflection_rad": 1e-3 * load,
            "deflection_low_rad": -1.0, "deflection_high_rad": 1.0, "residual_rad": 1e-5, "cycle_p99_s": 1e-4,
            "late_p99_s": float("nan"), "misses": 0, "alarms": ["motor position is stale"] if k == 60 else [],
            "dropped": 0,
        },
        [WRAP],
    )  # fmt: skip
