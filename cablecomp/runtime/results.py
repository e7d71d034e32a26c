"""What a run comes to: errors of every joint, timing, events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, sqrt
from pathlib import Path
from typing import Any

from cablecomp.control.compensator import Gains
from cablecomp.control.options import ControlMode
from cablecomp.runtime.joint_loop import JointLoop
from cablecomp.runtime.loop import TIME_IS_OVER
from cablecomp.runtime.timing import TimingReport
from cablecomp.runtime.ways_out import ASKED_BY_USER


@dataclass(frozen=True)
class JointResult:
    """How one joint did under control, root mean squares over the run.

    Position: joint encoder less reference; `true_position_rad` the same with the simulation's truth
    (NaN on hardware); in force mode none is asked for, NaN. Torque: the observer's less the reference's, NaN but in
    force mode; `true_torque_Nm` with the truth. `residual_rad`: joint encoder less prediction, NaN where the load was
    found from both encoders: that leaves none.
    """

    name: str
    cycles: int
    position_rad: float
    true_position_rad: float
    torque_Nm: float
    true_torque_Nm: float
    residual_rad: float
    deflection_rad: float
    phases: dict[str, int]


@dataclass(frozen=True)
class RunReport:
    """What `run_joints` gives back; `folder` holds the files, `failures` says which of them are incomplete."""

    joints: tuple[JointResult, ...]
    timing: TimingReport
    stop_reason: str
    events: tuple[tuple[float, str, str], ...]
    gains: Gains
    folder: Path | None
    failures: tuple[str, ...] = ()

    @property
    def ended_well(self) -> bool:
        """Whether the run lasted as long as was asked, or was ended by the user, and all of it is recorded."""
        asked = self.stop_reason == TIME_IS_OVER or self.stop_reason.startswith(ASKED_BY_USER)
        return asked and not self.failures

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for `run.json`."""
        joints = [{k: _plain(v) for k, v in vars(j).items()} for j in self.joints]
        return {
            "schema": 1,
            "stop_reason": self.stop_reason,
            "failures": list(self.failures),
            "gains": self.gains._asdict(),
            "joints": joints,
            "timing": self.timing.as_dict(),
            "events": [{"time_s": t, "joint": j, "what": w} for t, j, w in self.events],
        }


class TruthTally:
    """Squares of true errors, joint by joint."""

    def __init__(self, names: Sequence[str]) -> None:
        self._sums = {name: [0.0, 0.0, 0] for name in names}

    def add(self, name: str, position_error: float, torque_error: float) -> None:
        """One cycle's errors (rad, Nm; NaN counts as 0)."""
        sums = self._sums[name]
        sums[0] += position_error * position_error
        sums[1] += torque_error * torque_error if torque_error == torque_error else 0.0
        sums[2] += 1

    def rms(self, name: str) -> tuple[float, float]:
        """Root mean squares of both."""
        position, torque, count = self._sums[name]
        return (sqrt(position / count), sqrt(torque / count)) if count else (nan, nan)


def result_of(joint: JointLoop, truths: TruthTally) -> JointResult:
    """How one joint did."""
    t = joint.tally

    def rms(square: float, count: int) -> float:
        return sqrt(square / count) if count else nan

    true_position, true_torque = truths.rms(joint.setup.name)
    asked = joint.setup.compensator.options.mode is not ControlMode.FORCE
    tested = joint.setup.config.observer.load != "both_encoders"
    return JointResult(
        joint.setup.name,
        t.cycles,
        rms(t.position_square, t.position_count) if asked else nan,
        true_position if asked else nan,
        rms(t.torque_square, t.torque_count),
        true_torque,
        rms(t.residual_square, t.position_count) if tested else nan,
        rms(t.deflection_square, t.cycles),
        t.phases_by_name(),
    )


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and value != value else value
