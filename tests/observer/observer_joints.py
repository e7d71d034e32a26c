"""Joints and runs that the observer's tests share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from joints import WIDE
from numpy.typing import NDArray

from cablecomp.config import JointConfig, parse_joint
from cablecomp.observer import Observer

Array = NDArray[np.float64]


def joint(circuit: str = "closed", *stages: dict[str, Any], **sections: Any) -> JointConfig:
    """A joint of these stages, each given as what differs from `WIDE`; merging below 1e-13."""
    arrangement = sections.pop("arrangement", "series")
    observer = {"merge_tolerance": 1e-13, "max_pieces": 1024, **sections.pop("observer", {})}
    drive = {
        "circuit": circuit,
        "arrangement": arrangement,
        "stage": [{**WIDE, **s} for s in stages or ({},)],
    }
    return parse_joint(
        {"schema": 1, "name": "test joint", "drive": drive, "observer": observer, **sections}, "test"
    )


def pull_unit(config: JointConfig) -> float:
    """R T0 of the output stage [N m]."""
    stage = config.drive.stage[-1]
    return stage.output_radius_m * stage.pretension_N


def knots(values: Sequence[float], per_segment: int = 12) -> Array:
    """Straight segments through the given values."""
    places = np.arange(len(values))
    return np.interp(np.linspace(0, len(values) - 1, (len(values) - 1) * per_segment + 1), places, values)


def run(observer: Observer, load: Array, motor: Array, start: float = 0.0) -> dict[str, Array]:
    """Run an observer through loads [N m] and motor angles [rad], 1 ms apart."""
    time = start + 1e-3 * np.arange(len(load))
    return observer.run({"time_s": time, "motor_position_rad": motor, "joint_torque_Nm": load})
