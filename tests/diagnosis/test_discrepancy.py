"""What a law leaves for its form alone is no reason for another name; what no form of it can do, is one."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from linear_fit import Linear
from turning import JOINT as CONFIG

from cablecomp.config import Remainder
from cablecomp.diagnosis.explain.discrepancy import left_out_with_discrepancy
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import left_out, score_difference
from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.parameter import Parameter
from cablecomp.signal.smoothing import FloatArray

FRICTION = "routing_friction.mu_angle"
BLOCKS, ROWS = 30, 20
COUNT = BLOCKS * ROWS
BLOCK = np.repeat(np.arange(BLOCKS), ROWS)
GROUPS = Groups(BLOCK, BLOCK % 6, "block", np.zeros_like(BLOCK))
TIME = np.linspace(0.0, 60.0, COUNT)
LOAD = 2.0 * np.sin(0.7 * TIME) * np.cos(0.11 * TIME)
MOTOR = 0.8 * np.sin(0.23 * TIME + 0.4)
LAW = 5.0 * np.sign(np.gradient(MOTOR))
"""What the law of a model does to its rows at its amount: friction that turns with the motor."""
ZERO = {"bearing_friction.torque_Nm": np.ones(COUNT)}
"""A column beside which everything is tried: what moves the zero alone."""


def model(y: FloatArray, columns: Mapping[str, FloatArray]) -> Model:
    """argmin |y - A x|^2 + |x/10|^2, a column each; named as parameters of effects."""
    A, n = np.stack(list(columns.values()), axis=1), len(columns)
    J = np.vstack([-A, 0.1 * np.eye(n)])
    x = np.linalg.lstsq(-J, np.concatenate([y, np.zeros(n)]), rcond=None)[0]
    recording = Evidence(
        "one", "s", {},
        {"time_s": TIME, "motor_position_rad": MOTOR, "joint_torque_Nm": LOAD, JOINT: MOTOR},
        np.arange(COUNT), {JOINT: np.ones(COUNT, dtype=np.bool_)}, np.ones(COUNT),
    )  # fmt: skip
    problem = SimpleNamespace(
        config=CONFIG,
        bounds=lambda: (np.full(n, -1e3), np.full(n, 1e3)),
        parameters=[Parameter(f"effect.{k}", 0.0, -1e3, 1e3, False, sd=1.0) for k in columns],
        channels=(JOINT,),
        evidence=(recording,),
        bases={JOINT: SimpleNamespace(penalty_rows=0)},
    )
    fit: Any = Linear(problem, x, np.concatenate([y - A @ x, 0.1 * x]), J)
    return Model((), fit, left_out(fit, GROUPS))


def in_a_joint(model: Model, remainder: Remainder) -> Model:
    """The model of a joint that is known to leave this."""
    problem = copy(model.fit.problem)
    problem.config = CONFIG.model_copy(update={"remainder": remainder})
    problem.rows = lambda columns: columns[JOINT][0]
    return replace(model, fit=replace(model.fit, problem=problem))


def named(effect: str, event: bool = False) -> Any:
    """A stand-in for an effect of a model."""
    return SimpleNamespace(effect=SimpleNamespace(id=effect), has_instant=event)


def gains(other: FloatArray, y: FloatArray) -> tuple[float, float]:
    """What another effect takes off beside the law: as the law is, and where it may have another form."""
    having, lacking = model(y, {FRICTION: LAW, "gravity_load.moment_Nm": other}), model(y, {FRICTION: LAW})
    as_it_is = score_difference(having.left_out, lacking.left_out, GROUPS)
    let = [left_out_with_discrepancy(m, [named("routing_friction")], GROUPS) for m in (having, lacking)]
    return as_it_is.gain, score_difference(*let, GROUPS).gain


@pytest.mark.parametrize(
    ("form", "most"),
    [(LOAD / 2.0, 0.1), (MOTOR / 0.8, 0.1), (TIME / 60.0, 0.1), (np.tanh(np.gradient(LOAD, TIME)), 0.3)],
    ids=["load", "angle", "time", "direction"],
)
def test_what_another_form_of_the_law_can_do_speaks_for_no_other_name(form: FloatArray, most: float) -> None:
    """The law does a tenth more or less with load, angle, time, or the load's direction, which is a steeper or a softer
    step than it is (seed 1)."""
    noise = 0.1 * np.random.default_rng(1).standard_normal(COUNT)
    as_it_is, let = gains(LAW * form, LAW * (1.0 + 0.1 * form) + noise)
    assert as_it_is > 0.4
    assert let < most * as_it_is


def test_what_no_form_of_the_law_can_do_keeps_its_evidence() -> None:
    """A second effect beside a law of another form (seed 2)."""
    noise = 0.1 * np.random.default_rng(2).standard_normal(COUNT)
    own = 0.3 * np.sin(6.0 * MOTOR + 1.0)
    as_it_is, let = gains(own, LAW * (1.0 + 0.1 * LOAD / 2.0) + own + noise)
    assert let > as_it_is > 0.2


def test_a_form_departs_by_a_tenth_and_not_by_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a law would have to be half itself for is left to another effect, the more the less it may depart."""
    noise = 0.1 * np.random.default_rng(3).standard_normal(COUNT)
    found = []
    for departs in (0.003, 0.03, 0.3):
        monkeypatch.setattr("cablecomp.diagnosis.explain.discrepancy.LIMITS", replace(LIMITS, form=departs))
        found.append(gains(LAW * LOAD, LAW * (1.0 + 0.5 * LOAD / 2.0) + noise)[1])
    assert found[0] > found[1] > found[2]
    assert found[0] > 0.5


def test_of_two_names_in_any_form_the_right_one_is_ahead_by_more() -> None:
    """A law of another form than the model's, against another effect that as it is fits about as well (seed 6)."""
    noise = 0.1 * np.random.default_rng(6).standard_normal(COUNT)
    y = LAW * (1.0 + 0.15 * LOAD / 2.0 + 0.15 * MOTOR / 0.8) + noise
    wrong = "gravity_load.moment_Nm"
    models = {FRICTION: model(y, {FRICTION: LAW}), wrong: model(y, {wrong: LAW + 0.5 * np.cos(5.0 * MOTOR)})}
    as_they_are = score_difference(*(m.left_out for m in models.values()), GROUPS)
    freely = [
        left_out_with_discrepancy(m, [], GROUPS, own=named(k.partition(".")[0])) for k, m in models.items()
    ]
    assert score_difference(*freely, GROUPS).z > 2.0 * as_they_are.z > 0.0


def test_beside_no_other_law_nothing_changes() -> None:
    found = model(LAW, {FRICTION: LAW})
    assert left_out_with_discrepancy(found, [], GROUPS) is found.left_out
    assert left_out_with_discrepancy(found, [named("gravity_load")], GROUPS) is found.left_out


def test_events_of_two_kinds_are_told_apart_by_what_they_do_whatever_their_course(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three steps of which either law knows one: what moves the zero does not grow with the load (seed 4)."""
    steps = [(t <= TIME).astype(np.float64) for t in (12.0, 30.0, 48.0)]
    does = {"clamp_slip": np.ones(COUNT), "strand_break": 1.0 + 0.1 * LOAD}
    y = sum(steps) * does["clamp_slip"] + 0.1 * np.random.default_rng(4).standard_normal(COUNT)
    amount = {"clamp_slip": "slip_m", "strand_break": "fraction"}
    models = {name: model(y, {f"{name}.{amount[name]}": own * steps[1]}) for name, own in does.items()}
    instants = np.linspace(2.0, 58.0, LIMITS.steps)
    monkeypatch.setattr(
        "cablecomp.diagnosis.explain.discrepancy._courses",
        lambda fit, event: [does[event.effect.id] * (t <= TIME) for t in instants],
    )
    as_they_are = score_difference(models["clamp_slip"].left_out, models["strand_break"].left_out, GROUPS)
    free = [left_out_with_discrepancy(models[e], [], GROUPS, event=named(e, event=True)) for e in does]
    assert score_difference(*free, GROUPS).gain > 0.3 > 3.0 * as_they_are.gain


def test_what_a_step_leaves_of_a_creeping_slip_speaks_for_no_other_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A slip at every quarter of a minute beside which another effect, a wave in time, fits what one step leaves of it;
    and one that is there (seed 5)."""
    noise = 0.1 * np.random.default_rng(5).standard_normal(COUNT)
    stairs, step = np.floor(TIME / 15.0), (TIME >= 30.0).astype(np.float64)
    wave, own = np.sin(2.0 * np.pi * TIME / 30.0), np.sin(6.0 * MOTOR + 1.0)
    monkeypatch.setattr(
        "cablecomp.diagnosis.explain.discrepancy._courses",
        lambda fit, event: [1.0 * (t <= TIME) for t in np.linspace(0.0, 60.0, LIMITS.steps + 2)[1:-1]],
    )

    def gain(other: FloatArray, y: FloatArray, event: bool) -> float:
        slip = {"clamp_slip.slip_m": step}
        having, lacking = model(y, {**slip, "gravity_load.moment_Nm": other}), model(y, slip)
        beside = [named("clamp_slip", event)]
        left = [left_out_with_discrepancy(m, beside, GROUPS) for m in (having, lacking)]
        return score_difference(*left, GROUPS).gain

    as_it_is, let = (gain(wave, stairs + noise, event) for event in (False, True))
    assert as_it_is > 0.2
    assert let < 0.2 * as_it_is
    assert gain(own, stairs + own + noise, event=True) > 0.5


def test_what_comes_again_each_cycle_hides_no_step() -> None:
    """A slip in a joint that is known to leave a wave by motor angle and direction, larger than the slip (seed 7):
    what lets that wave go sees the slip; where the joint is not known to leave it, nothing changes."""
    noise = 0.3 * np.random.default_rng(7).standard_normal(COUNT)
    step = (TIME >= 31.0).astype(np.float64)
    wave = 2.0 * np.sin(7.0 * MOTOR + 0.5 * np.sign(np.gradient(MOTOR)))
    slip = {"clamp_slip.slip_m": step}
    known = Remainder(joint_position_rad=1.4, follows=("motor_angle",))
    having, lacking = model(step + wave + noise, {**ZERO, **slip}), model(step + wave + noise, ZERO)
    gain = {}
    for remainder in (Remainder(), Remainder(joint_position_rad=1.4), known):
        knows = [in_a_joint(m, remainder) for m in (having, lacking)]
        left = [left_out_with_discrepancy(m, [], GROUPS, usual=True) for m in knows]
        gain[remainder] = score_difference(*left, GROUPS).gain
    assert gain[Remainder()] == gain[Remainder(joint_position_rad=1.4)] < 0.2
    assert gain[known] > 3.0 * gain[Remainder()]


@pytest.mark.parametrize(
    ("most", "follows", "goes"),
    [(1.4, "joint_angle", True), (0.001, "joint_angle", False), (1.4, "load", False), (1.4, "time", False)],
)
def test_what_is_let_go_is_as_large_as_known_and_goes_by_what_is_known(
    most: float, follows: str, goes: bool
) -> None:
    """A wave by motor angle in a joint that is known to leave that much, a hundredth of it, or as much by something
    else (seed 8)."""
    wave = 2.0 * np.sin(7.0 * MOTOR)
    found = model(wave + 0.3 * np.random.default_rng(8).standard_normal(COUNT), ZERO)
    joint = in_a_joint(found, Remainder(joint_position_rad=most, follows=(follows,)))
    left = float(np.std(left_out_with_discrepancy(joint, [], GROUPS, usual=True)))
    assert left < 0.4 * np.std(wave) if goes else left > 0.8 * np.std(wave)


def test_a_wave_by_the_load_is_let_go_by_the_load() -> None:
    """The same of a wave by load, each direction its own (seed 9)."""
    wave = np.sign(np.gradient(LOAD)) * np.cos(1.5 * LOAD)
    found = model(wave + 0.2 * np.random.default_rng(9).standard_normal(COUNT), ZERO)
    joint = in_a_joint(found, Remainder(joint_position_rad=1.0, follows=("load",)))
    assert np.std(left_out_with_discrepancy(joint, [], GROUPS, usual=True)) < 0.4 * np.std(wave)
