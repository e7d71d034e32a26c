"""A recording as frames: what a run would have given away of itself, to be played, paused and scrubbed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.monitor.frames import Frame, frame
from cablecomp.monitor.instrument import PER_SECOND
from cablecomp.observer import Observer
from cablecomp.recording.reader import Recording
from cablecomp.recording.table import Block

MOST: Final = 1_500
"""Frames of a recording; a longer one is shown at a lower rate."""
_SHOWN: Final = (
    "deflection_rad", "deflection_low_rad", "deflection_high_rad", "joint_torque_Nm", "tension_h_N", "tension_l_N",
)  # fmt: skip


def played(
    recording: Recording, joint: JointConfig, duration_s: float, bounds: bool = True
) -> Iterator[Frame]:
    """Frames of the recording's replay, as evenly in time as its samples allow; `duration_s`: of all of it.

    Raises InputError where the joint does not allow a prediction.
    """
    observer = Observer(joint, bounds=bounds)
    period = (1.0 - 1e-6) * max(1.0 / PER_SECOND, duration_s / MOST)  # times are rounded
    due = -np.inf
    for block in recording.blocks():
        start = 0
        time = block.columns["time_s"]
        for row in range(block.rows):
            if time[row] >= due or row == block.rows - 1:
                part = block.part(start, row + 1)
                found = observer.run(part.columns)
                start = row + 1
                if time[row] >= due:
                    due = time[row] + period
                    yield frame(_scalars(part, found, joint), observer.profiles())


def _scalars(part: Block, found: dict[str, Any], joint: JointConfig) -> dict[str, Any]:
    """The last row's numbers; NaN where nothing is known."""
    numbers = {name: float(found[name][-1]) if name in found else np.nan for name in _SHOWN}
    measured = part.columns.get("joint_position_rad")
    residual = np.nan
    if measured is not None:
        residual = float(
            measured[-1] - found["joint_position_rad"][-1] - joint.sensors.joint_position_offset_rad
        )
    return {
        "time_s": float(part.columns["time_s"][-1]),
        "joint": joint.name,
        "phase": "recording",
        "load_Nm": numbers.pop("joint_torque_Nm"),
        "residual_rad": residual,
        **numbers,
    }
