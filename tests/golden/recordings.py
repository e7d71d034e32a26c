"""Where the recordings of real hardware lie: `CABLECOMP_RECORDINGS` names their folder; nothing of them is
kept here."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.recording.reader import read_all
from cablecomp.signal.smoothing import FloatArray

CONFIGS: Final = Path(__file__).parents[2] / "configs" / "hardware"
KINDS: Final = ("linear", "polynomial", "bouc-wen", "plays")
_CHANNELS: Final = (
    "time_s", "motor_position_rad", "joint_position_rad", "joint_torque_Nm", "motor_torque_Nm",
    "other_sheath_angle_rad",
)  # fmt: skip


def root() -> Path | None:
    """Folder of the recordings, or None if it is not there."""
    given = os.environ.get("CABLECOMP_RECORDINGS")
    return Path(given) if given and Path(given).is_dir() else None


def folder(name: str) -> Path:
    """One data set's folder."""
    found = root()
    assert found is not None, "set CABLECOMP_RECORDINGS to the folder of the recordings"
    return found / name


def read(path: Path) -> dict[str, FloatArray]:
    """The channels that the fits use."""
    columns = read_all(path).columns
    return {k: columns[k] for k in _CHANNELS if k in columns}


def degrees(misfits: Mapping[str, FloatArray]) -> float:
    """RMSE over all rows of all recordings [deg]."""
    return float(np.degrees(np.sqrt(np.mean(np.concatenate(list(misfits.values())) ** 2))))


def own_zero(misfits: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The same with one encoder zero per recording in place of one per session."""
    return {name: m - m.mean() for name, m in misfits.items()}
