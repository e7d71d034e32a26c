"""Where the recordings of real hardware lie: `CABLECOMP_RECORDINGS` names their folder; nothing of them is kept
here."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.config import JointConfig, in_session, load_joint, session_of
from cablecomp.diagnosis.body import Sessions
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Diagnosis
from cablecomp.observer import Observer
from cablecomp.recording.reader import read_all
from cablecomp.signal.smoothing import FloatArray, group_means

CONFIGS: Final = Path(__file__).parents[2] / "configs" / "hardware"
KINDS: Final = ("linear", "polynomial", "bouc-wen", "plays")
JOINT: Final = "joint_position_rad"
MOTOR: Final = "motor_torque_Nm"


def root() -> Path | None:
    """Folder of the recordings, or None if it is not there."""
    given = os.environ.get("CABLECOMP_RECORDINGS")
    return Path(given) if given and Path(given).is_dir() else None


def folder(name: str) -> Path:
    """One data set's folder."""
    found = root()
    assert found is not None, "set CABLECOMP_RECORDINGS to the folder of the recordings"
    return found / name


def joint(name: str) -> JointConfig:
    """What is known of the hardware: orders of magnitude."""
    return load_joint(CONFIGS / f"{name}.toml")


def diagnosed(config: JointConfig, paths: Sequence[Path], sessions: Sessions | None = None) -> Diagnosis:
    """What the command finds in these recordings."""
    return diagnose(config, {str(p): read_all(p).columns for p in paths}, sessions=sessions)


@cache
def coarse(path: Path, group: int) -> dict[str, FloatArray]:
    """A recording's channels, means of `group` samples, from the motor's first reversal on (a return by 2 % of
    its range after nine tenths of it): what lies before depends on a history that nobody recorded."""
    columns = {k: group_means(v, group) for k, v in read_all(path).columns.items()}
    away = np.abs(columns["motor_position_rad"] - columns["motor_position_rad"][0])
    farthest, span = np.maximum.accumulate(away), float(away.max())
    later = np.logical_or.accumulate((farthest >= 0.9 * span) & (farthest - away >= 0.02 * span))
    return {k: v[later] for k, v in columns.items()}


def replayed(config: JointConfig, path: Path, group: int) -> FloatArray:
    """What the joint leaves of a recording, as `replay` runs it: the session's zero, from the first reversal on."""
    own = in_session(config, session_of(config, path, None))
    columns = {k: group_means(v, group) for k, v in read_all(path).columns.items()}
    misfit = columns[JOINT] - Observer(own).run(columns)[JOINT] - own.sensors.joint_position_offset_rad
    return np.asarray(misfit[len(misfit) - len(coarse(path, group)[JOINT]) :], dtype=np.float64)


def degrees(misfits: Mapping[str, FloatArray]) -> float:
    """RMSE over all rows of all recordings [deg]."""
    return float(np.degrees(np.sqrt(np.mean(np.concatenate(list(misfits.values())) ** 2))))


def session_zero(misfits: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The same with the mean misfit of all these recordings for zero."""
    mean = float(np.mean(np.concatenate(list(misfits.values()))))
    return {name: m - mean for name, m in misfits.items()}


def own_zero(misfits: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The same with one encoder zero per recording in place of one per session."""
    return {name: m - m.mean() for name, m in misfits.items()}
