"""A fitting problem about three recordings, small enough to be solved anew in every test."""

from __future__ import annotations

from turning import JOINT, recorded

from cablecomp.config import JointConfig
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray

SIGMA, SPREAD = 2e-5, 1e-4
ANGLE = "joint_position_rad"


def evidence(columns: dict[str, FloatArray], name: str, session: str) -> Evidence:
    return gather(JOINT, name, columns, session, fine_rows=2000, judged_rows=160)


def three_recordings() -> tuple[Evidence, ...]:
    """Two recordings of one session, one of another, each with a zero of its own."""
    return tuple(
        evidence(recorded(offset_rad=zero, seed=k), f"{k}", s)
        for k, (zero, s) in enumerate(((1e-3, "a"), (1.2e-3, "a"), (-4e-3, "b")))
    )


def problem(parts: tuple[Evidence, ...], spread: float = SPREAD, joint: JointConfig = JOINT) -> Problem:
    return Problem(joint, of_drive(joint), parts, Weighing({ANGLE: SIGMA}, {ANGLE: spread} if spread else {}))
