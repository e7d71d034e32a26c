"""Profile intervals: at their ends the best fit of all others is worse by 3.84, by a search that knows nothing of
them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.effects import catalogue
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit, covariance, solve, weighed
from cablecomp.estimation.parameter import of_drive, of_effect, own_of
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.estimation.profile import profile_interval

ANGLE, TORQUE = "joint_position_rad", "effect.bearing_friction.torque_Nm"
SIGMA = 2e-5
SHARP = {"torque_Nm": 0.0, "load_coefficient": 0.0, "presliding_rad": 2e-3}


def with_bearing(torque_Nm: float) -> JointConfig:
    entry = EffectEntry(id="bearing_friction", **{**SHARP, "torque_Nm": torque_Nm})
    return JOINT.model_copy(update={"effect": (entry,)})


def fitted(true_Nm: float) -> Fit:
    """The drive and a bearing's torque, fitted to a recording that this torque made."""
    e = gather(JOINT, "one", recorded(with_bearing(true_Nm)), "a", fine_rows=1500, judged_rows=150)
    start = with_bearing(0.02)
    torque = of_effect(catalogue()["bearing_friction"], {"torque_Nm": 0.02}, start)
    problem = Problem(start, (*of_drive(start), *torque), (e,), Weighing({ANGLE: SIGMA}, {}))
    fit = solve(problem, evaluations=30, tolerance=1e-7)
    fit = solve(fit.problem.with_weighing(weighed(fit, Weighing({ANGLE: SIGMA}, {}))), fit.x, 30, 1e-8)
    return solve(fit.problem, fit.x, 12, 1e-10)


def deviance(fit: Fit, name: str, value: float) -> float:
    """2 (cost with the parameter kept in a slit about the value - cost), by the solver alone, from two starts."""
    here = fit.problem.parameters
    slit = tuple(
        replace(p, low=value - 1e-9 * p.scale, high=value + 1e-9 * p.scale) if p.name == name else p
        for p in here
    )
    problem = replace(fit.problem, parameters=slit)
    costs = [solve(problem, x, 40, 1e-8).cost for x in (fit.x, problem.start)]
    return 2.0 * (min(costs) - fit.cost)


@pytest.fixture(scope="module")
def rubbing() -> Fit:
    return fitted(0.05)


def test_at_its_ends_the_deviance_is_that_of_95_percent(rubbing: Fit) -> None:
    found = profile_interval(rubbing, TORQUE)
    assert found is not None
    low, high = found
    assert low < rubbing.values[TORQUE] < high
    assert low < 0.05 < high
    for end in (low, high):
        assert deviance(rubbing, TORQUE, end) == pytest.approx(3.84, rel=0.15)


def test_where_the_fit_is_straight_it_is_two_standard_deviations(rubbing: Fit) -> None:
    """EA in its logarithm, told well."""
    found = profile_interval(rubbing, "EA_N")
    assert found is not None
    k = next(k for k, p in enumerate(rubbing.problem.parameters) if p.name == "EA_N")
    sd = float(np.sqrt(covariance(rubbing)[k, k]))
    assert np.log(found) == pytest.approx([rubbing.x[k] - 1.96 * sd, rubbing.x[k] + 1.96 * sd], abs=0.25 * sd)


def test_what_is_known_beforehand_counts_as_the_data_do(rubbing: Fit) -> None:
    """A stiffness that is stated as well as the recording tells it: half of the interval's square is the prior's."""
    here = rubbing.problem.parameters
    k = next(k for k, p in enumerate(here) if p.name == "EA_N")
    alone = float(np.sqrt(covariance(rubbing)[k, k]))
    stated = (*here[:k], replace(here[k], sd=alone), *here[k + 1 :])
    fit = solve(replace(rubbing.problem, parameters=stated), rubbing.x, 30, 1e-10)
    for wider, told in ((1.0, 3.84), (1.5, 1.5**2 * 3.84)):
        found = profile_interval(fit, "EA_N", wider)
        assert found is not None
        for end in found:
            assert deviance(fit, "EA_N", end) == pytest.approx(told, rel=0.15)


def test_an_amount_that_may_be_none_has_none_for_its_end() -> None:
    fit = fitted(0.0)
    found = profile_interval(fit, TORQUE)
    assert found is not None
    assert found[0] == 0.0
    assert deviance(fit, TORQUE, found[1]) == pytest.approx(3.84, rel=0.15)


def test_what_is_each_sessions_own_has_none(rubbing: Fit) -> None:
    mine = own_of(rubbing.problem.parameters[0], ("a",))
    own = replace(
        rubbing, problem=replace(rubbing.problem, parameters=(*mine, *rubbing.problem.parameters[1:]))
    )
    assert profile_interval(own, mine[0].name) is None
    assert profile_interval(rubbing, "nothing") is None
