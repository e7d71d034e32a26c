"""Late readings and a drag in proportion to speed: what is said of them is true of the plant."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, closed
from small_drive import calibrated, course, recorded

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.answer.alike import drag_alike
from cablecomp.diagnosis.answer.verdict import warnings_of
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

LATE_S = 0.004


def late(delay_s: float, motor_too: bool = False) -> Fit:
    """A fit to the small joint's plain recording, its readings said to be late; its motor's torque in it or not."""
    columns = recorded([], 12.0)
    if motor_too:
        columns["motor_torque_Nm"] = np.zeros(len(columns["time_s"]))
    fit = calibrated(columns)[1].fit
    entry = EffectEntry.model_validate({"id": "clock_skew", "delay_s": delay_s})
    joint = fit.problem.config.model_copy(update={"effect": (entry,)})
    return replace(fit, problem=replace(fit.problem, config=joint))


def test_the_drag_that_is_told_does_to_the_plants_angle_what_the_delay_does() -> None:
    said = drag_alike(late(LATE_S))
    assert said is not None
    assert "come 4 ms late" in said
    found = re.search(r"drag of (\S+) N m s/rad.*all but (\d+) % of the square", said)
    assert found is not None
    drag = EffectSpec("joint_viscous_friction", {"coefficient_Nms_per_rad": float(found[1])})
    time, motor, load = course(12.0)

    def angle(effects: list[EffectSpec]) -> FloatArray:
        return simulate(PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=effects).channels()[
            JOINT
        ]

    plain = angle([])
    delayed = np.interp(time - LATE_S, time, plain) - plain
    dragged = angle([drag]) - plain
    assert dragged @ delayed / (dragged @ dragged) == pytest.approx(1.0, abs=0.1)
    apart = np.sum((dragged - delayed) ** 2) / np.sum(delayed**2)
    assert apart == pytest.approx(0.01 * float(found[2]), abs=0.03)


@pytest.mark.parametrize(("delay_s", "motor_too"), [(0.0, False), (-LATE_S, False), (LATE_S, True)])
def test_nothing_is_said_of_early_readings_or_where_the_motors_torque_tells(
    delay_s: float, motor_too: bool
) -> None:
    assert drag_alike(late(delay_s, motor_too)) is None


def test_it_is_a_warning_of_a_diagnosis_that_found_the_delay() -> None:
    fit = late(LATE_S)
    effect = catalogue()["clock_skew"]
    found = Hypothesis(effect, effect.id, effect.parameters[0], (), False)
    assert drag_alike(fit) in warnings_of(Model((found,), fit, fit.residual))
    assert warnings_of(Model((), fit, fit.residual)) == ()  # a delay that the joint is known to have
