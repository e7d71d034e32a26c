"""The verdict: one word for each case, and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from cablecomp.diagnosis.answer import verdict
from cablecomp.diagnosis.answer.verdict import (
    _not_followed,
    is_structured,
    not_carried,
    predicts,
    share_left,
    verdict_of,
)
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.result import Errors
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import JOINT as ANGLE

NOISE = 2e-5


@dataclass(frozen=True)
class Left:
    """A fit by what it leaves of each channel (RMS)."""

    rms: dict[str, float] = field(default_factory=dict)

    @property
    def problem(self) -> Any:
        return SimpleNamespace(channels=tuple(self.rms))


@pytest.fixture(autouse=True)
def _as_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verdict, "rms_left", lambda fit, channel="joint_position_rad": fit.rms[channel])


def leaving(rms: float, torque: float | None = None) -> Any:
    """A fit that leaves so much of the joint's angle, and of the motor's torque where there is one."""
    return Left({"joint_position_rad": rms} | ({} if torque is None else {"motor_torque_Nm": torque}))


def drive(nominal: float, calibrated: float) -> Any:
    return SimpleNamespace(nominal=leaving(nominal), fit=leaving(calibrated), floor_rad=NOISE)


def model(rms: float) -> Any:
    return SimpleNamespace(fit=leaving(rms))


@pytest.mark.parametrize(
    ("named", "structured", "calibrated", "word"),
    [
        (True, False, 1.0, "explained"),
        (True, True, 1.0, "partly explained"),
        (False, True, 0.1, "unexplained"),
        (False, False, 0.5, "recalibrate"),
        (False, False, 0.99, "consistent"),
    ],
)
def test_each_case_has_its_word(named: bool, structured: bool, calibrated: float, word: str) -> None:
    assert verdict_of(named, structured, drive(1.0, 1.0), model(calibrated)) == word


def having(rms: float, torque: float | None = None, *effects: str) -> Any:
    """A model that leaves so much of the angle (and of the motor's torque), with these effects."""
    terms = tuple(Hypothesis(catalogue()[e], e, catalogue()[e].parameters[0], (), False) for e in effects)
    fit = leaving(rms) if torque is None else leaving(rms, torque=torque)
    return SimpleNamespace(fit=fit, terms=terms)


def test_a_model_predicts_by_the_angle_left_out_or_by_another_channel_that_it_follows() -> None:
    before, worse, better = (
        Errors(1.0, 1.0, 1.0, 0.2),
        Errors(0.5, 1.1, 1.0, 0.19),
        Errors(0.5, 0.9, 1.0, 0.2),
    )
    far = 0.1
    assert predicts(leaving(1.0), having(0.5), before, better, far)
    assert not predicts(leaving(1.0), having(0.5), before, worse, far)
    assert predicts(leaving(1.0, torque=1.0), having(0.5, 0.5), before, worse, far)
    assert not predicts(leaving(1.0, torque=1.0), having(0.5, 0.95), before, worse, far)
    assert predicts(leaving(1.0), having(0.5), before, Errors(0.5, 1.1, 1.0, 0.17), far)


def test_near_the_noise_a_model_has_to_predict_the_angle_clearly_better() -> None:
    before, hardly, clearly = (
        Errors(1.0, 1.0, 1.0, 0.2),
        Errors(0.5, 0.97, 1.0, 0.2),
        Errors(0.5, 0.9, 1.0, 0.2),
    )
    far, near = 0.4, 0.6
    assert predicts(leaving(1.0), having(0.5), before, hardly, far)
    assert not predicts(leaving(1.0), having(0.5), before, hardly, near)
    assert predicts(leaving(1.0), having(0.5), before, clearly, near)
    # the motor's torque alone bears the name of what shows nowhere else, and of nothing that has to show in the angle
    torque = leaving(1.0, torque=1.0)
    assert not predicts(torque, having(0.5, 0.5, "bearing_friction"), before, hardly, near)
    assert predicts(torque, having(0.5, 0.5, "motor_friction"), before, hardly, near)


def test_the_share_left_is_all_of_it_where_nothing_was_won_and_none_where_noise_is_left() -> None:
    assert share_left(drive(1.0, 1e-3), model(1e-3)) == 1.0
    assert share_left(drive(1.0, 1e-3), model(NOISE)) == 0.0
    half = (0.5 * (1e-3**2 - NOISE**2) + NOISE**2) ** 0.5
    assert share_left(drive(1.0, 1e-3), model(half)) == pytest.approx(0.5)


def structured(
    times_noise: float,
    follows: bool,
    repeated_rad: float | None = None,
    usual_rad: float = 0.0,
    named: bool = False,
    share: float = 1.0,
) -> bool:
    rng = np.random.default_rng(1)
    residual = rng.standard_normal(4_000)
    series: Any = SimpleNamespace(
        residual=times_noise * NOISE * residual / np.sqrt(np.mean(residual**2)), sigma=np.full(4_000, NOISE)
    )
    mismatch = SimpleNamespace(covariate="time", share=share)
    location: Any = SimpleNamespace(significant=lambda level: (mismatch,) if follows else ())
    return is_structured(location, series, repeated_rad, usual_rad, named)


def test_what_follows_something_is_structured_sooner_than_what_follows_nothing() -> None:
    beyond = [
        LIMITS.structured, LIMITS.beyond_noise, LIMITS.far_beyond_noise
    ]  # fmt: skip
    assert beyond == sorted(beyond)
    for limit, follows, named in zip(beyond, (True, False, False), (True, True, False), strict=True):
        assert structured(1.01 * limit**0.5, follows, named=named)
        assert not structured(0.99 * limit**0.5, follows, named=named)


@pytest.mark.parametrize(
    ("times_noise", "share", "is_one"),
    [
        (1.4, 0.2, False),  # two fifths of noise's square
        (1.4, 0.3, True),
        (1.9, 0.1, False),
        (1.9, 0.2, True),
        (2.1, 0.01, True),  # this much is no noise, whatever part of it follows something
        (1.2, 1.0, False),
    ],
)
def test_near_the_noise_what_follows_something_has_to_be_a_good_part_of_it(
    times_noise: float, share: float, is_one: bool
) -> None:
    assert structured(times_noise, follows=True, share=share) == is_one
    of_repeats = structured(3.0 * times_noise, follows=True, repeated_rad=3.0 * NOISE, share=share)
    assert of_repeats == is_one


def test_what_the_machine_itself_does_not_repeat_is_no_structure() -> None:
    assert structured(6.0, follows=True)
    assert not structured(6.0, follows=True, repeated_rad=6.0 * NOISE)
    assert structured(6.0, follows=True, repeated_rad=0.1 * NOISE)


def test_far_more_than_noise_is_structure_where_repeats_differ_less_than_half_as_much() -> None:
    """Nothing named, nothing followed: an event makes repeats differ, too."""
    times = 1.2 * LIMITS.far_beyond_noise**0.5
    assert structured(times, follows=False, repeated_rad=0.4 * times * NOISE)
    assert not structured(times, follows=False, repeated_rad=0.6 * times * NOISE)


def test_what_the_joint_is_known_to_leave_is_no_structure() -> None:
    assert not structured(6.0, follows=True, usual_rad=6.0 * NOISE)
    assert not structured(6.0, follows=True, repeated_rad=0.1 * NOISE, usual_rad=6.0 * NOISE)
    assert structured(6.0, follows=True, usual_rad=0.1 * NOISE)


@pytest.mark.parametrize(("final_rad", "said"), [(4e-4, True), (2e-4, False), (5e-5, False)])
def test_a_model_that_does_not_carry_to_what_was_kept_for_the_end_is_warned_of(
    final_rad: float, said: bool
) -> None:
    lines = list(not_carried(Errors(9e-5, 1e-4, final_rad, 1e-4), 2e-5))
    assert bool(lines) is said
    assert not said or "4.0 times worse" in lines[0]
    assert not list(not_carried(Errors(9e-6, 1e-5, 5e-5, 1e-5), 2e-5))  # within what sensors leave of either


@pytest.mark.parametrize(("left", "said"), [(0.03, False), (0.6, False), (0.8, True), (283.0, True)])
def test_a_channel_that_is_not_followed_is_said(left: float, said: bool) -> None:
    """A torque of the motor that swings by 1 Nm RMS about 5 Nm, in some of the recordings."""
    swing = 5.0 + np.sqrt(2.0) * np.sin(np.linspace(0.0, 20.0 * np.pi, 2000))

    def at_rows(channel: str) -> Any:
        return swing

    counted = {"motor_torque_Nm": np.ones(2000, dtype=np.bool_)}
    evidence = [SimpleNamespace(at_rows=at_rows, counted=c) for c in (counted, {})]
    fit: Any = leaving(1e-5, left)
    problem = SimpleNamespace(channels=fit.problem.channels, evidence=evidence)
    lines, hurried = (
        list(_not_followed(cast(Any, SimpleNamespace(problem=problem, rms=fit.rms)), cut_short))
        for cut_short in (False, True)
    )
    assert bool(lines) is bool(hurried) is said
    assert all("its unit, sign or zero" in line for line in lines)
    assert all("unit" not in line and "give more time" in line for line in hurried)
    nowhere = [SimpleNamespace(at_rows=at_rows, counted={"motor_torque_Nm": np.zeros(2000, dtype=np.bool_)})]
    problem = SimpleNamespace(channels=fit.problem.channels, evidence=nowhere)
    assert not list(_not_followed(cast(Any, SimpleNamespace(problem=problem, rms=fit.rms)), False))
    assert all(line.startswith("motor_torque_Nm is not followed") for line in lines)


@pytest.mark.parametrize(
    ("apart_rad", "said"), [(0.5 * NOISE, []), (-40.0 * NOISE, ["s/2: its zero lies -0.8 mrad"])]
)
def test_a_zero_that_departs_by_less_than_what_is_left_is_no_clamp_that_slipped(
    monkeypatch: pytest.MonkeyPatch, apart_rad: float, said: list[str]
) -> None:
    """Four recordings alike to a tenth of a count, and one by half of what is left: far off the others, and nothing."""
    zeros = {ANGLE: {"s": np.zeros(1), "s/1": np.zeros(1), "s/2": np.array([apart_rad])}}
    evidence = [SimpleNamespace(name=n, session="s") for n in ("s/1", "s/2")]
    weighing = SimpleNamespace(moved={ANGLE: frozenset({"s/2"})})
    problem = SimpleNamespace(zeros=lambda x: zeros, evidence=evidence, weighing=weighing)
    monkeypatch.setattr(verdict, "rms_left", lambda fit: NOISE)
    lines = [*verdict._set_anew(cast(Any, SimpleNamespace(problem=problem, x=None)))]
    assert [line.partition(" from")[0] for line in lines] == said
