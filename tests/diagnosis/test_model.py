"""What a model has to be able to, beside predicting well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turning import JOINT

from cablecomp.config import JointConfig, with_values
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.model import Model, amount_resolved, bears, moves_rad, ranked
from cablecomp.diagnosis.explain.plausible import runs_away
from cablecomp.diagnosis.explain.scores import left_out
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.diagnosis.folds import make_groups
from cablecomp.errors import InputError
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import of_drive, vague_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.observer import Observer

ANGLE = "joint_position_rad"


def fitted(config: JointConfig, load_Nm: float) -> Fit:
    """The joint as a fit of a recording of its own at this load."""
    time = np.arange(0.0, 10.0, 0.02)
    columns = {
        "time_s": time,
        "motor_position_rad": 0.6 * np.sin(time),
        "joint_torque_Nm": load_Nm * np.sin(2.3 * time),
    }
    columns[ANGLE] = Observer(config).run(columns)[ANGLE]
    e = gather(config, "one", columns, "all", fine_rows=500, judged_rows=200)
    problem = Problem(config, (), (e,), Weighing({ANGLE: 1e-4}, {}))
    nothing = np.empty(0)
    return Fit(problem, nothing, problem.residual(nothing), np.empty((len(e.rows), 0)))


def test_of_a_weight_with_a_turning_base_and_without_one_stands() -> None:
    """A base that does not turn is none: two models alike would take both places that go on."""
    fit = fitted(JOINT, 1.0)
    time = fit.problem.evidence[0].columns["time_s"]
    other = {**fit.problem.evidence[0].columns, "other_1_rad": np.sin(0.7 * time)}
    evidence = (replace(fit.problem.evidence[0], columns=other),)
    plain, turned = (h for h in hypotheses(JOINT, evidence) if h.effect.id == "gravity_load")
    leak, _ = (h for h in hypotheses(JOINT, evidence) if h.effect.id == "crosstalk")
    groups = make_groups(fit)
    left = left_out(fit, groups)
    models = [Model((turned,), fit, left), Model((plain,), fit, left), Model((leak,), fit, left)]
    assert [m.name for m in ranked(models, groups)] == ["gravity_load:other_1_rad", "crosstalk:other_1_rad"]
    better = Model((plain,), fit, 0.5 * left)
    assert ranked([*models, better], groups)[0].name == "gravity_load"


def beside(effect: str, amount: dict[str, float], config: JointConfig = JOINT) -> tuple[Fit, Hypothesis]:
    """The joint's fit with an effect of these values beside it, and that effect as a hypothesis."""
    fit = fitted(config, 1.0)
    (h,) = [h for h in hypotheses(JOINT, fit.problem.evidence) if h.name == effect]
    problem = with_entry(fit.problem, h, h.entry({**h.starts[0].values, **amount}))
    problem = replace(problem, parameters=(*problem.parameters, *of_drive(config)))
    x = np.array([p.x(amount.get(p.name.rpartition(".")[2], p.start)) for p in problem.parameters])
    return Fit(problem, x, fit.residual, np.empty((0, len(x)))), h


def with_tolerance(relative: float) -> JointConfig:
    """The joint with cables known this well."""
    return JOINT.model_copy(update={"tolerance": {"EA_N": relative}})


def holding(force_N: float | None) -> JointConfig:
    """The joint with cables of this breaking force."""
    stages = tuple(s.model_copy(update={"breaking_force_N": force_N}) for s in JOINT.drive.stage)
    return JOINT.model_copy(update={"drive": JOINT.drive.model_copy(update={"stage": stages})})


def test_a_model_that_has_no_solution_just_beyond_its_loads_is_known() -> None:
    """Cables a hundred times too soft stretch off a drum at 6 N m and not at 5."""
    soft = with_values(holding(None), {"pretension_N": 5.0, "EA_N": 300.0})
    assert bears(fitted(soft, 2.5))
    assert not bears(fitted(soft, 4.0))


def test_a_stated_breaking_force_is_no_reason() -> None:
    """The limit is the cable's, and not the model's: this one holds the load, and not 1.5 times it."""
    fit = fitted(holding(None), 2.0)
    torque = {k: 1.5 * v if k == "joint_torque_Nm" else v for k, v in fit.problem.evidence[0].columns.items()}
    weak = holding(115.0)
    with pytest.raises(InputError, match="breaking force"):
        Observer(weak).run(torque)
    assert bears(fitted(weak, 2.0))


def test_a_cable_that_slackens_is_no_reason() -> None:
    """An open circuit's cable hangs slack beyond R T0, whatever else the drive has: this one is loaded to 0.8 of that,
    in the one direction and in the other."""
    one = holding(None)
    still = one.model_copy(update={"drive": one.drive.model_copy(update={"circuit": "open"})})
    near_Nm = 0.8 * still.drive.stage[0].pretension_moment_Nm
    fit = fitted(still, near_Nm)
    torque = {k: 1.5 * v if k == "joint_torque_Nm" else v for k, v in fit.problem.evidence[0].columns.items()}
    with pytest.raises(InputError, match="slacken"):
        Observer(still).run(torque)
    assert bears(fit)


@pytest.mark.parametrize(
    ("effect", "amount", "told"),
    [
        # plausible from 1e-5 to 1e3 EA/R: what delays a small joint is a thousandth of a thousandth of the largest
        ("viscous_slip", {"coefficient_Ns_per_m_rad": 1e-4 * 2e5 / 0.025}, True),
        ("viscous_slip", {"coefficient_Ns_per_m_rad": 0.0}, False),
        ("bearing_friction", {"torque_Nm": 2e-3, "presliding_rad": 1e-4}, True),
        ("bearing_friction", {"torque_Nm": 1e-9, "presliding_rad": 1e-4}, False),
        ("routing_friction", {"mu_angle": 0.02, "arc_length_m": 0.01}, True),
        ("routing_friction", {"mu_angle": 1e-5, "arc_length_m": 0.01}, False),
    ],
)
def test_an_amount_is_told_from_none_by_what_is_plausible(
    effect: str, amount: dict[str, float], told: bool
) -> None:
    fit, h = beside(effect, amount)
    assert amount_resolved(fit, h) is told


@pytest.mark.parametrize(
    ("effect", "amount", "away"),
    [
        # ends on its bound, many times the most that is plausible
        ("pulley_runout", {"eccentricity_m": 1.0}, True),
        ("pulley_runout", {"eccentricity_m": 1e-4}, False),
        # a share: its bound is the most that is plausible
        ("routing_friction", {"mu_angle": 1e3, "arc_length_m": 0.01}, False),
    ],
)
def test_an_amount_at_many_times_what_is_plausible_has_run_away(
    effect: str, amount: dict[str, float], away: bool
) -> None:
    fit, h = beside(effect, amount)
    assert runs_away(fit, h) is away


@pytest.mark.parametrize(("eccentricity_m", "away"), [(2e-4, False), (4e-3, True)])
def test_where_nothing_holds_the_drive_an_amount_runs_away_without_a_bound(
    eccentricity_m: float, away: bool
) -> None:
    """Plausible are up to 0.03 of the radius of 25 mm: a quarter of that may be, 4 mm are five times as much; the
    bound lies at 10 mm. A drive that is known holds it."""
    amount = {"eccentricity_m": eccentricity_m}
    fit, h = beside("pulley_runout", amount)
    assert not runs_away(fit, h)
    assert runs_away(*beside("pulley_runout", amount, with_tolerance(1.0))) is away


@pytest.mark.parametrize(("share", "away"), [(1.5, False), (3.0, True)])
def test_an_unseen_weight_may_be_as_large_as_the_loads_that_are_seen(share: float, away: bool) -> None:
    """A drive under loads far beyond what its pretension bears: a weight is judged by these."""
    loose = with_tolerance(1.0)
    largest = 1.5 * JOINT.drive.stage[0].pretension_moment_Nm  # plausible by the drive alone
    fit, h = beside("gravity_load", {"moment_Nm": share * 2.0 * largest, "phase_rad": 0.5}, loose)
    assert runs_away(fit, h)
    (e,) = fit.problem.evidence
    torque = e.columns["joint_torque_Nm"]
    heavy = {**e.columns, "joint_torque_Nm": torque * (2.0 * largest / np.max(np.abs(torque)))}
    loaded = fit.problem.with_evidence([replace(e, columns=heavy)])
    assert runs_away(replace(fit, problem=loaded), h) is away


@pytest.mark.parametrize(
    ("tolerance", "vague"), [({"EA_N": 1.0}, True), ({"mu_output": 1.0, "mu_input": 1.0}, False)]
)
def test_coefficients_of_friction_alone_leave_a_drive_known(tolerance: dict[str, float], vague: bool) -> None:
    assert vague_drive(of_drive(JOINT.model_copy(update={"tolerance": tolerance}))) is vague


def test_by_how_much_an_effect_moves_the_joint_hangs_on_no_scale_of_the_weights() -> None:
    """Of rows that stand for more time than usual, as where rests are kept for the end, or for less."""
    fit, term = beside("series_compliance", {"compliance_rad_per_Nm": 1e-3})
    (e,) = fit.problem.evidence
    moved = 1e-3 * e.at_rows("joint_torque_Nm")
    for scale in (1.0, 1.5):
        problem = fit.problem.with_evidence([replace(e, weight=scale * np.ones(len(e.rows)))])
        found = moves_rad(Model((term,), replace(fit, problem=problem), fit.residual), term)
        assert found == pytest.approx(np.std(moved), rel=0.02)
