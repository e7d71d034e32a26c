"""What each channel alone would have of an amount, and what is made of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from cablecomp.diagnosis.explain.by_channel import borne_by_torque, wishes
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import JOINT, MOTOR
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import Parameter

AMOUNT = "effect.bearing_friction.torque_Nm"
ROWS = 400


def _fit(by_angle: float, by_torque: float, torque_weight: float = 1.0) -> Fit:
    """A linear fit of two channels: along the amount's own column, the angle would have the amount changed by this
    share, the torque by that; a second column, like the first in part, is free as well."""
    rng, amount = np.random.default_rng(5), 0.2
    spans = {JOINT: slice(0, ROWS), MOTOR: slice(ROWS, 2 * ROWS)}
    weight = np.repeat([1.0, torque_weight], ROWS)
    own, other = rng.normal(size=(2, 2 * ROWS)) * weight
    own -= other * (other @ own) / (other @ other)
    J = np.column_stack([own + 0.7 * other, other])
    residual = -own * amount * np.repeat([by_angle, by_torque], ROWS)
    parameters = (
        Parameter(AMOUNT, amount, 0.0, 10.0, False, 1.0),
        Parameter("free_length_m", 1.0, 0.5, 2.0, False, 1.0),
    )
    problem = SimpleNamespace(parameters=parameters, spans=lambda: spans)
    return Fit(cast(Any, problem), np.array([amount, 1.0]), residual, J)


def _bearing() -> Hypothesis:
    effect = catalogue()["bearing_friction"]
    return Hypothesis(effect, "bearing_friction", effect.parameters[0], (), False)


def test_each_channel_says_what_it_alone_would_change_beside_what_others_can_do() -> None:
    found = wishes(_fit(-0.4, 0.3, torque_weight=2.0), AMOUNT)
    assert found[JOINT].change == pytest.approx(-0.4, rel=1e-9)
    assert found[MOTOR].change == pytest.approx(0.3, rel=1e-9)
    assert found[JOINT].deviation == pytest.approx(1.0 / (0.2 * ROWS**0.5), rel=0.1)
    assert found[MOTOR].deviation == pytest.approx(0.5 * found[JOINT].deviation, rel=0.1)
    assert found[JOINT].part + found[MOTOR].part == pytest.approx(1.0)
    assert found[MOTOR].part == pytest.approx(0.8, abs=0.03)
    assert wishes(_fit(0.0, 0.0), "effect.bearing_friction.presliding_rad") == {}


@pytest.mark.parametrize(
    ("by_angle", "by_torque", "torque_weight", "said"),
    [
        (-0.9, 0.4, 1.0, "would have 90% less of it"),
        (-1.5, 0.4, 1.0, "would have none of it"),
        (-0.9, 0.4, 0.2, ""),  # the torque tells next to nothing of it
        (0.4, -0.9, 1.0, ""),  # the cable bears more than the motor feels
        (-0.9, -0.9, 1.0, ""),  # they agree
        (-0.1, 0.9, 1.0, ""),  # by little, the angle
        (-0.25, 0.05, 1.0, ""),  # by chance
    ],
)
def test_a_friction_that_the_angle_hardly_knows_is_not_the_joints(
    by_angle: float, by_torque: float, torque_weight: float, said: str
) -> None:
    fit = _fit(by_angle, by_torque, torque_weight)
    found = borne_by_torque(fit, _bearing())
    assert bool(found) is bool(said)
    assert said in found


def test_only_a_friction_of_the_joint_itself_is_asked() -> None:
    assert [e.id for e in catalogue().values() if e.drags_joint] == ["bearing_friction"]
    gravity = catalogue()["gravity_load"]
    load = Hypothesis(gravity, "gravity_load", gravity.parameters[0], (), False)
    assert borne_by_torque(_fit(-0.9, 0.4), load) == ""
