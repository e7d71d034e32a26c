"""Late readings and a drag in proportion to speed: what is said of them is true of the plant."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, closed
from scipy.interpolate import CubicSpline
from small_drive import calibrated, course, recorded

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.answer.alike import drag_alike
from cablecomp.diagnosis.answer.verdict import warnings_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

LATE_S = 0.004


def dragging(drag: float) -> list[EffectSpec]:
    """The plant's drag in proportion to the joint's speed [N m s/rad]."""
    return [EffectSpec("joint_viscous_friction", {"coefficient_Nms_per_rad": drag})]


def late(columns: dict[str, FloatArray], delay_s: float = LATE_S) -> Fit:
    """A fit of the drive to such a recording in whose joint the readings are late."""
    fit = calibrated(columns)[1].fit
    entry = EffectEntry.model_validate({"id": "clock_skew", "delay_s": delay_s})
    joint = fit.problem.config.model_copy(update={"effect": (entry,)})
    return solve(replace(fit.problem, config=joint))


def read_late() -> dict[str, FloatArray]:
    """The plain plant's recording with its joint read late, noise and all."""
    columns = recorded([], 12.0)
    time = columns["time_s"]
    columns[JOINT] = CubicSpline(time, columns[JOINT])(time - LATE_S)
    return columns


def told(said: str | None) -> tuple[float, float]:
    """The drag that a line tells [N m s/rad], and by how much it differs [rad]."""
    found = re.search(r"drag of (\S+) N m s/rad.*differ by (\S+) mrad", said or "")
    assert found is not None, said
    return float(found[1]), 1e-3 * float(found[2])


def done(drag: float, loads: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """What the delay and what that drag do to the plant's angle [rad]."""
    time, motor, load = course(12.0, loads)

    def angle(effects: list[EffectSpec]) -> FloatArray:
        return simulate(PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=effects).channels()[
            JOINT
        ]

    plain = angle([])
    return CubicSpline(time, plain)(time - LATE_S) - plain, angle(dragging(drag)) - plain


def test_the_drag_that_is_told_does_to_the_plants_angle_what_the_delay_does() -> None:
    drag, differs = told(drag_alike(late(recorded(dragging(0.7), 12.0))))
    delayed, dragged = done(drag)
    assert dragged @ delayed / (dragged @ dragged) == pytest.approx(1.0, abs=0.1)
    assert differs == pytest.approx(np.sqrt(np.mean((dragged - delayed) ** 2)), rel=0.2)


def test_the_drag_is_told_of_a_joint_that_is_only_moved_too() -> None:
    """Nobody hung a load on it, and none is recorded: the drag alone deflects it."""
    columns = recorded(dragging(0.7), 12.0, 0.0)
    del columns["joint_torque_Nm"]
    drag, _ = told(drag_alike(late(columns)))
    delayed, dragged = done(drag, 0.0)
    assert dragged @ delayed / (dragged @ dragged) == pytest.approx(1.0, abs=0.1)


def test_of_readings_that_are_late_no_drag_is_told() -> None:
    assert drag_alike(late(read_late())) is None


def test_of_early_readings_no_drag_is_told() -> None:
    assert drag_alike(late(recorded(dragging(0.7), 12.0), -LATE_S)) is None


def test_where_the_motors_torque_tells_no_drag_is_told() -> None:
    columns = recorded(dragging(0.7), 12.0)
    columns["motor_torque_Nm"] = np.zeros(len(columns["time_s"]))
    assert drag_alike(late(columns)) is None


def test_it_is_a_warning_of_a_diagnosis_that_found_the_delay() -> None:
    fit = late(recorded(dragging(0.7), 12.0))
    effect = catalogue()["clock_skew"]
    found = Hypothesis(effect, effect.id, effect.parameters[0], (), False)
    assert drag_alike(fit) in warnings_of(Model((found,), fit, fit.residual), cut_short=False)
    assert (
        warnings_of(Model((), fit, fit.residual), cut_short=False) == ()
    )  # a delay that the joint is known to have
