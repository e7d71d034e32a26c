"""What an effect promises before it is fitted: held against the independent plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, closed
from small_drive import TOLERANT, calibrated, course, recorded

from cablecomp.config import parse_joint
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain import screening
from cablecomp.diagnosis.explain.hypotheses import OF_COURSE, hypotheses
from cablecomp.diagnosis.explain.linear import anchor, best_start, contribution
from cablecomp.diagnosis.explain.plausible import drags
from cablecomp.diagnosis.explain.screening import ask, ask_all, rough
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parameter import reach_of
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

EVENT_S = 11.0


@pytest.mark.parametrize(("form", "sign"), [("", 1.0), (":other_cable", -1.0)])
@pytest.mark.parametrize(
    ("effect", "amount", "true"), [("strand_break", "fraction", 0.15), ("clamp_slip", "slip_m", 1e-4)]
)
def test_an_event_is_promised_of_the_cable_that_it_happens_to(
    effect: str, amount: str, true: float, form: str, sign: float
) -> None:
    concealed = [EffectSpec(effect + form, {amount: true, "time_s": EVENT_S})]
    body, drive = calibrated(recorded(concealed, 20.0))
    (hypothesis,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == effect)
    answer = ask(anchor(drive.fit), hypothesis)
    assert answer is not None
    plain = answer.plain or answer
    promised = plain.problem.values(plain.starts[0])
    assert promised[f"effect.{effect}.{amount}"] == pytest.approx(sign * true, rel=0.1)
    assert promised[f"effect.{effect}.time_s"] == pytest.approx(EVENT_S, abs=0.2)
    assert plain.cost < 0.1 * drive.fit.cost


def test_an_event_leaves_recordings_that_ended_before_it_as_they_were_and_later_ones_alike() -> None:
    """Each of three recordings worked out once for an event anywhere, as if all were run for each."""
    columns = recorded([EffectSpec("clamp_slip", {"slip_m": 1e-4, "time_s": EVENT_S})], 27.0)
    parts = {}
    for k in range(3):
        kept = (columns["time_s"] >= 9.0 * k) & (columns["time_s"] < 9.0 * (k + 1))
        parts[f"small/{k}"] = {name: values[kept] for name, values in columns.items()}
    body = gather_body(TOLERANT, parts, None)
    drive = calibrate_drive(TOLERANT, body.used, np.random.default_rng(0))
    slip = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "clamp_slip")
    here = anchor(drive.fit)
    for instant, duration, taken_up in (
        (4.0, 0.0, 0.0),
        (12.5, 0.0, 0.0),
        (5.0, 0.0, 1.0),
        (6.0, 8.0, 0.0),
        (22.0, 0.0, 0.0),
    ):
        values = {"slip_m": 1e-4, "time_s": instant, "duration_s": duration, "taken_up": taken_up}
        found = here.with_event(slip, values)
        joint = drive.fit.problem.config.model_copy(update={"effect": (slip.entry(values),)})
        every = replace(drive.fit.problem, config=joint).misfits(drive.fit.x)
        assert found is not None
        for channel, misfits in every.items():
            for mine, theirs in zip(found[channel], misfits, strict=True):
                np.testing.assert_array_equal(mine, theirs)


def test_a_weight_on_a_linkage_is_promised_with_a_lever_that_grows() -> None:
    """The plant's linkage has a second harmonic, which no law of the catalogue has; a plain weight promises none."""
    law = {"moment_Nm": 0.15, "phase_rad": 0.4}
    second = {"second": 0.8, "second_phase_rad": 1.5}
    for spec, shaped in (
        (EffectSpec("gravity_load:linkage", {**law, **second}), True),
        (EffectSpec("gravity_load", law), False),
    ):
        body, drive = calibrated(recorded([spec], 30.0))
        weight = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "gravity_load")
        answer = ask(anchor(drive.fit), weight)
        assert answer is not None
        assert ("growth_per_rad" in answer.problem.config.effect[-1].parameters) == shaped
        if shaped:
            assert answer.plain is not None
            assert answer.cost < 0.5 * answer.plain.cost


def test_shapes_are_asked_for_at_a_further_anchor_only_where_it_comes_below_the_first() -> None:
    """Here the further one is the drive with other friction, once far off and once next to none."""
    law = {"moment_Nm": 0.15, "phase_rad": 0.4, "second": 0.8, "second_phase_rad": 1.5}
    body, drive = calibrated(recorded([EffectSpec("gravity_load:linkage", law)], 30.0))
    weight = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "gravity_load")
    problem, here = drive.fit.problem, anchor(drive.fit)
    rubs = [p.base.startswith("mu_") for p in problem.parameters]
    for further, shaped in ((1.5, False), (0.01, True)):
        x = drive.fit.x + further * np.array(rubs)
        there = anchor(Fit(problem, x, problem.residual(x), problem.jacobian(x)))
        alone = ask(there, weight)
        assert alone is not None
        assert alone.plain is not None
        assert (alone.plain.cost < drive.fit.cost) == shaped
        answers = ask_all([here, there], weight)
        assert [a.plain is not None for a in answers] == [True, shaped]


def test_a_gap_that_closes_within_a_narrow_moment_is_told_from_one_that_closes_at_once() -> None:
    """Springs that hold a key up to 2 % of R T0: the plant's law is a straight line up to there. tanh is 3/4 at M_c."""
    sprung = EffectSpec("termination_backlash:sprung", {"gap_rad": 2e-3, "closes_Nm": 0.04})
    body, drive = calibrated(recorded([sprung], 40.0, 0.4))
    gap = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "termination_backlash")
    answer = ask(anchor(drive.fit), gap)
    assert answer is not None
    (shaped, *_), (sudden, *_) = rough([answer], 8), rough([answer.plain or answer], 8)
    assert shaped.cost < 0.25 * sudden.cost
    assert shaped.values["effect.termination_backlash.gap_rad"] == pytest.approx(2e-3, rel=0.05)
    assert shaped.values["effect.termination_backlash.closes_Nm"] == pytest.approx(0.03, rel=0.25)


@pytest.mark.parametrize("vague", [False, True])
def test_beside_a_drive_known_by_order_of_magnitude_a_shape_is_fitted_whatever_it_promises(
    vague: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clearance crossed at finite speed promised 3 % beside a sheath's friction, and took off 37 %."""
    monkeypatch.setattr(screening, "worth_a_shape", lambda *_: False)
    body, drive = calibrated(recorded([EffectSpec("termination_backlash", {"gap_rad": 1e-3})], 12.0))
    problem = drive.fit.problem
    known = tuple(replace(p, sd=3.0 if vague else 0.1) for p in problem.parameters)
    fit = replace(drive.fit, problem=replace(problem, parameters=known))
    (gap,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == "termination_backlash")
    answer = ask(anchor(fit), gap)
    assert answer is not None
    assert (answer.plain is not None) is vague


def test_an_event_of_a_law_that_knows_no_duration_is_asked_at_once_alone() -> None:
    """A user's own event may have an instant and nothing of a course."""
    body, drive = calibrated(recorded([EffectSpec("clamp_slip", {"slip_m": 1e-4, "time_s": EVENT_S})], 20.0))
    (slip,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == "clamp_slip")
    kept = tuple(p for p in slip.effect.parameters if p.role not in OF_COURSE)
    sudden = replace(slip, effect=replace(slip.effect, parameters=kept))
    assert sudden.duration == ""
    answer = ask(anchor(drive.fit), sudden)
    assert answer is not None
    assert "duration_s" not in answer.problem.config.effect[-1].parameters


@pytest.mark.parametrize("share", [1e-3, 3e-3])
def test_an_amount_known_by_orders_of_magnitude_is_begun_about_where_it_is(share: float) -> None:
    """A hundredfold viscous slip delays what slides no hundredfold: a part of a large one tells nothing of a small."""
    long = {**SMALL, "wrap_output_rad": 18.0, "wrap_input_rad": 18.0, "mu_output": 0.06, "mu_input": 0.06}
    stated = parse_joint({**closed(long, "long"), "tolerance": {"pretension_N": 0.06}}, "long")
    stage = stated.drive.stage[-1]
    true = share * stage.EA_N / stage.output_radius_m
    slip = [EffectSpec("viscous_slip", {"coefficient_Ns_per_m_rad": true})]
    body, drive = calibrated(recorded(slip, 20.0, stage=long), stated)
    (viscous,) = (h for h in hypotheses(stated, body.used) if h.effect.id == "viscous_slip")
    answer = ask(anchor(drive.fit), viscous)
    assert answer is not None
    amount = "effect.viscous_slip.coefficient_Ns_per_m_rad"
    assert 0.2 * true < answer.problem.values(answer.starts[0])[amount] < 3.0 * true
    (fit, *_) = rough([answer], 8)
    assert fit.cost < 0.9 * drive.fit.cost
    assert fit.values[amount] == pytest.approx(true, rel=0.5)


@pytest.mark.parametrize(("true", "on_input"), [(1e6, 1.0), (3e6, 0.0), (1e8, 1.0)])
def test_an_amount_that_saturates_is_asked_for_far_beyond_what_shows(true: float, on_input: float) -> None:
    """Slip so viscous that one drum hardly slides in a stroke: the other shape, and less of it, show as much."""
    slip = [EffectSpec("viscous_slip:one_drum", {"coefficient_Ns_per_m_rad": true, "on_input": on_input})]
    body, drive = calibrated(recorded(slip, 20.0))
    (viscous,) = (h for h in hypotheses(TOLERANT, body.used) if h.effect.id == "viscous_slip")
    (fit, *_) = rough(ask_all([anchor(drive.fit)], viscous), 8)
    assert fit.cost < 0.05 * drive.fit.cost
    assert fit.values["effect.viscous_slip.drum"] == pytest.approx(1.0 - 2.0 * on_input, abs=0.05)


@pytest.mark.parametrize("times", [10.0, 300.0])
def test_an_amount_that_saturates_is_begun_at_less_than_a_straight_line_promises(times: float) -> None:
    """Of what hardly slides any more less shows as much, and no step leads from there to where it is."""
    true, amount = 1e6, "coefficient_Ns_per_m_rad"
    body, drive = calibrated(recorded([EffectSpec("viscous_slip", {amount: true})], 20.0))
    (viscous,) = (h for h in hypotheses(TOLERANT, body.used) if h.effect.id == "viscous_slip")
    fit = solve(drive.fit.problem.finely(), drive.fit.x, 4)
    here = anchor(fit)
    best = best_start(here, viscous)
    assert best is not None
    far = screening._answer(here, viscous, best._replace(values={**best.values, amount: times * true}))
    (found, *_) = rough([far], 5)
    assert found.cost < 0.01 * fit.cost
    assert found.values[f"effect.viscous_slip.{amount}"] == pytest.approx(true, rel=0.2)


@pytest.mark.parametrize("fine", [False, True])
def test_a_joint_in_grease_is_asked_for_also_where_every_sample_is_run(fine: bool) -> None:
    """Shapes are not, there, but one that goes with speed."""
    grease = [EffectSpec("joint_viscous_friction", {"coefficient_Nms_per_rad": 0.5})]
    columns = recorded(grease, 20.0)
    played = simulate(PlantConfig.from_dict(closed(SMALL)), *course(20.0), effects=grease).channels()
    noise = 1e-3 * np.random.default_rng(5).standard_normal(len(columns["time_s"]))
    body, drive = calibrated(columns | {"motor_torque_Nm": played["motor_torque_Nm"] + noise})
    fit = solve(drive.fit.problem.finely(), drive.fit.x) if fine else drive.fit
    bearing = next(h for h in hypotheses(TOLERANT, body.used) if h.effect.id == "bearing_friction")
    answer = ask(anchor(fit), bearing)
    assert answer is not None
    (found, *_) = rough([answer], 12)
    assert found.cost < 0.1 * fit.cost
    assert drags(found, bearing)


def test_an_effect_is_asked_for_at_no_size_that_its_fit_may_not_reach() -> None:
    """What shows next to nothing (an event just before the last rows) is not blown up until it does."""
    body, drive = calibrated(recorded([], 20.0))
    here = anchor(drive.fit)
    pool = hypotheses(TOLERANT, body.used)
    asked = {h.name: (h.amount, contribution(here, h, h.starts[-1])) for h in pool}
    sizes = {name: (amount, found[1]) for name, (amount, found) in asked.items() if found is not None}
    assert len(sizes) > len(pool) // 2
    for name, (amount, size) in sizes.items():
        low, high = reach_of(amount, TOLERANT)
        assert low <= size <= high, name
