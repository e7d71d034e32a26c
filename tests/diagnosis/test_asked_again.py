"""An event's course, asked for again with what was found since beside it."""

from __future__ import annotations

import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.asked_again import with_better_forms
from cablecomp.diagnosis.explain.events import course_of
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import left_out
from cablecomp.diagnosis.explain.screening import ask, rough, with_entry
from cablecomp.diagnosis.folds import make_groups
from cablecomp.estimation.least_squares import solve
from firmware_sim.plant import EffectSpec


def test_an_event_takes_the_course_that_another_effect_had_hidden() -> None:
    """The plant's clamp lets go three times beside a bearing's friction; the model has the friction, and a slip at once
    as it was found without it."""
    slips = {"slip_m": 6e-5, "time_s": 10.0, "duration_s": 22.0, "steps": 3.0, "growth": 0.8, "wait": 1.5}
    effects = [
        EffectSpec("clamp_slip:unequal_steps", slips),
        EffectSpec("bearing_friction", {"torque_Nm": 0.02, "presliding_rad": 2e-3}),
    ]
    body, drive = calibrated(recorded(effects, 45.0))
    slip, friction = (
        next(h for h in hypotheses(TOLERANT, body.used) if h.name == name)
        for name in ("clamp_slip", "bearing_friction")
    )
    begun = with_entry(drive.fit.problem, slip, slip.entry({"slip_m": 4e-5, "time_s": 18.0}))
    at_once = solve(begun, begun.start, 10)
    answer = ask(anchor(at_once), friction)
    assert answer is not None
    (fit,) = rough([answer], 20)
    groups = make_groups(drive.fit)
    model = Model((slip, friction), fit, left_out(fit, groups))
    better = with_better_forms(model, groups)
    course = course_of(better.fit, slip)
    assert better.name == model.name
    assert better.fit.cost < 0.2 * model.fit.cost
    assert course.instant_s == pytest.approx(10.0, abs=0.4)
    assert [after for after, _ in course.steps] == pytest.approx([22.0 / 2.5, 22.0], abs=0.4)
    assert better.fit.values["effect.clamp_slip.slip_m"] == pytest.approx(6e-5, rel=0.05)
    again = with_better_forms(better, groups)
    assert again is better


def test_a_law_takes_the_shape_that_it_has_once_it_is_fitted() -> None:
    """The plant's mount rests on a stop one way; the model has one that yields in proportion."""
    yields = EffectSpec("series_compliance:one_way", {"compliance_rad_per_Nm": 2e-3, "skew": -0.6})
    body, drive = calibrated(recorded([yields], 30.0))
    mount = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "series_compliance")
    begun = with_entry(drive.fit.problem, mount, mount.entry({"compliance_rad_per_Nm": 2e-3}))
    plain = solve(begun, begun.start, 10)
    groups = make_groups(drive.fit)
    better = with_better_forms(Model((mount,), plain, left_out(plain, groups)), groups)
    assert better.fit.cost < 0.2 * plain.cost
    assert better.fit.values["effect.series_compliance.skew"] == pytest.approx(-0.6, abs=0.05)
    assert with_better_forms(better, groups) is better


def test_a_path_is_looked_for_between_the_middle_and_the_end_of_the_cable() -> None:
    """Of the plant's two guides one lies at 0.7 of the free cable; at 0.85 of it a step promised nothing yet."""
    bent = {"mu_angle": 0.2, "arc_length_m": 0.005, "count": 2.0, "first": 0.7}
    body, drive = calibrated(recorded([EffectSpec("routing_friction:several_guides", bent)], 30.0))
    path = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "routing_friction")
    begun = with_entry(drive.fit.problem, path, path.entry({"mu_angle": 0.2, "arc_length_m": 0.005}))
    plain = solve(begun, begun.start, 15)
    groups = make_groups(drive.fit)
    better = with_better_forms(Model((path,), plain, left_out(plain, groups)), groups)
    assert better.fit.cost < 0.2 * plain.cost
    assert better.fit.values["effect.routing_friction.place"] > 0.6
    assert better.fit.values["effect.routing_friction.mu_angle"] == pytest.approx(0.2, rel=0.05)
