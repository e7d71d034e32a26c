"""What is held against a name: a bound that its law ran into, but not a bound that is an answer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from turning import JOINT, hypothesis, recorded

from cablecomp.diagnosis.answer import entries
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain import weighing
from cablecomp.diagnosis.explain.confidence import learnt
from cablecomp.diagnosis.explain.held_down import another, hardly_ahead, slight, too_little
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.explain.ties import alone_by_far
from cablecomp.diagnosis.explain.weighing import (
    Weighed,
    _against,
    _at_bound,
    _follows,
    _unfollowed,
    one_in_series,
)


@pytest.mark.parametrize(
    ("effect", "bounds", "held"),
    [
        ("routing_friction", (), False),
        ("clamp_slip", ("effect.clamp_slip.time_s", "effect.clamp_slip.duration_s"), False),
        ("clamp_slip", ("effect.clamp_slip.slip_m",), True),
        ("routing_friction", ("effect.routing_friction.arc_length_m",), False),
        ("routing_friction", ("effect.routing_friction.mu_angle",), True),
        ("routing_friction", ("effect.routing_friction.mu_angle@Tool_4.2",), True),
        ("routing_friction", ("effect.routing_friction.mu_angle~bend_rad",), True),
        ("routing_friction", ("effect.nonlinear_cable.stiffening", "mu_output"), False),
        ("nonlinear_cable", ("effect.nonlinear_cable.stiffening", "mu_output"), True),
    ],
)
def test_that_all_of_a_cable_lies_on_its_guides_is_held_against_no_name(
    effect: str, bounds: tuple[str, ...], held: bool
) -> None:
    model: Any = SimpleNamespace(fit=SimpleNamespace(at_bound=lambda: bounds))
    term = cast(Hypothesis, SimpleNamespace(effect=SimpleNamespace(id=effect)))
    assert _at_bound(model, term) is held


LATE = {"late_rad_per_Nm": 1e-3, "lag_s": 0.05}
STRONG = {"follows": 0.0, "selected_in": 1.0, "share_left": 0.0, "unfollowed": 0.001}


@pytest.mark.parametrize(
    ("instead", "z", "weak", "said"),
    [
        (("clamp_slip",), 9.0, {}, "clamp_slip in its place"),
        ((), 1.2, {}, "z = 1.2"),
        ((), 9.0, {"follows": 0.6}, "60% of what is left still follows"),
        ((), 9.0, {"unfollowed": 0.4}, "does not follow, beyond chance, what it acts through"),
        ((), 9.0, {"selected_in": 0.2}, "the best of its round in 20%"),
        ((), 9.0, {"share_left": 0.7}, "70% of the mismatch is left over"),
        ((), 9.0, {}, "weak in every respect"),
    ],
)
def test_what_speaks_against_a_name_is_said_and_nothing_else(
    instead: tuple[str, ...], z: float, weak: dict[str, float], said: str
) -> None:
    reason = _against(instead, ScoreDifference(0.5, z, z), {**STRONG, **weak})
    assert said in reason
    assert ";" not in reason


@pytest.mark.parametrize(
    ("sizes", "named"),
    [
        # share of the mismatch that it takes off, its confidence
        ({"termination_backlash": (0.7, 0.98), "series_compliance": (0.2, 0.96)}, {"termination_backlash"}),
        ({"termination_backlash": (0.2, 0.98), "series_compliance": (0.3, 0.6)}, {"series_compliance"}),
        ({"termination_backlash": (0.7, 0.4), "series_compliance": (0.2, 0.96)}, {"series_compliance"}),
        (
            {"series_compliance": (0.2, 0.9), "gravity_load": (0.7, 0.9)},
            {"series_compliance", "gravity_load"},
        ),
        # what yields at once and what yields late is one coupling
        (
            {"series_compliance": (0.2, 0.9), "series_compliance:late_rad_per_Nm": (0.7, 0.9)},
            {"series_compliance", "series_compliance:late_rad_per_Nm"},
        ),
    ],
)
def test_of_a_coupling_and_a_clearance_one_has_the_name(
    sizes: dict[str, tuple[float, float]], named: set[str]
) -> None:
    def weighed(name: str, removes: float, confidence: float) -> Weighed:
        even = ScoreDifference(0.5, 9.0, 9.0)
        return Weighed(hypothesis(name.partition(":")[0], name), None, {}, confidence, (), even, "", removes)

    found = one_in_series([weighed(name, *size) for name, size in sizes.items()])
    assert [w.term.name for w in found] == list(sizes)
    assert {w.term.name for w in found if w.confidence >= 0.5} == named
    for w in found:
        was = sizes[w.term.name][1]
        assert (w.confidence == was) is (w.term.name in named or was < 0.5)
        assert ("one curve of the load" in w.why_not) is (w.confidence != was)


@pytest.mark.parametrize(
    ("removes", "left", "little"),
    [(0.1, 0.85, True), (0.1, 0.4, False), (0.03, 0.0, False), (0.3, 0.7, False)],
)
def test_an_effect_has_to_stand_out_of_what_is_left(removes: float, left: float, little: bool) -> None:
    said = too_little(removes, left)
    assert bool(said) is little
    assert not little or (f"{removes:.0%}" in said and f"{left:.0%}" in said)


@pytest.mark.parametrize(
    ("name", "beside", "gain", "z", "share", "expected"),
    [
        ("bearing_friction", True, 0.2, 2.4, 0.01, "1.0% of the mismatch, which the form"),
        ("bearing_friction", True, 0.2, 2.6, 0.01, ""),
        ("bearing_friction", False, 0.2, 2.4, 0.01, ""),
        ("bearing_friction", True, 0.6, 2.4, 0.01, ""),
        ("bearing_friction", True, 0.2, 1.0, 0.10, ""),
        ("bearing_friction", True, 0.04, 1.0, 0.05, "5.0% of the mismatch, z = 1.0"),
        ("bearing_friction", True, 0.04, 4.0, 0.05, ""),
        ("bearing_friction", False, 0.04, 1.0, 0.05, ""),
        ("bearing_friction", True, -0.01, -0.4, 0.11, "without it the others predict"),
        ("bearing_friction", False, -0.01, -0.4, 0.11, ""),
        ("clock_skew", True, 0.04, 1.0, 0.01, "1.0% of the mismatch, z = 1.0"),
        ("clock_skew", True, 0.04, 4.0, 0.01, ""),
    ],
)
def test_what_takes_off_a_hundredth_beside_another_effect_may_be_the_others_form(
    name: str, beside: bool, gain: float, z: float, share: float, expected: str
) -> None:
    """Not alone, nor where it takes off most of what was left, or is missed as a further effect has to be, nor a delay;
    more may be chance's, a delay too."""
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    term = asked[name]
    model: Any = SimpleNamespace(terms=(asked["series_compliance"], term) if beside else (term,))
    said = slight(model, term, (), ScoreDifference(gain, z, z), share)
    assert bool(said) is bool(expected)
    assert expected in said


def test_only_what_follows_an_effects_own_covariates_beyond_chance_counts() -> None:
    """Of three covariates one is another effect's, one follows by chance."""
    left: Any = SimpleNamespace(
        mismatch=[
            SimpleNamespace(covariate="temperature", share=0.9, p_value=0.001),
            SimpleNamespace(covariate="load", share=0.5, p_value=0.4),
            SimpleNamespace(covariate="reversal", share=0.2, p_value=0.001),
        ]
    )
    term = cast(Hypothesis, SimpleNamespace(acts_through=("load", "reversal")))
    assert _follows(term, left) == 0.2
    assert _unfollowed(term, left) == 0.001
    other = cast(Hypothesis, SimpleNamespace(acts_through=("velocity", "load", "temperature")))
    assert _follows(other, left) == 0.0
    assert _unfollowed(other, left) == 0.4
    assert _unfollowed(cast(Hypothesis, SimpleNamespace(acts_through=("velocity",))), left) == 1.0


def test_confidence_goes_the_way_that_each_sign_points() -> None:
    """The model that ships, from a case amid those that it was learnt on."""
    middle = learnt().centre
    usual = learnt().probability(middle)
    for sign, better in {
        "lead": 1,
        "selected_in": 1,
        "unfollowed_rest": -1,
        "tries_rest": -1,
    }.items():
        moved = {**middle, sign: middle[sign] + learnt().scale[sign]}
        assert (learnt().probability(moved) - usual) * better > 0.01, sign


@pytest.mark.parametrize(("confidence", "said"), [(0.3, True), (0.9, False)])
def test_what_trials_say_not_to_exclude_is_told_where_nothing_has_a_name(
    monkeypatch: pytest.MonkeyPatch, confidence: float, said: bool
) -> None:
    """Three explanations asked alone, one of them far behind the two others."""
    monkeypatch.setattr(entries, "learnt_level", lambda: 2.0)
    tried = [
        SimpleNamespace(term=SimpleNamespace(name=name), difference=ScoreDifference(0.5, z, z))
        for name, z in (("gravity_load", 9.0), ("pulley_runout", 8.0), ("clock_skew", 1.0))
    ]
    selection: Any = SimpleNamespace(rounds=[SimpleNamespace(tried=tried)])
    found: Any = [SimpleNamespace(confidence=confidence, rivals=())]
    told = [names for names, _ in entries.tied_of(found, selection)]
    assert told == ([("gravity_load", "pulley_runout")] if said else [])


@pytest.mark.parametrize(
    ("alone", "scores", "surest", "by"),
    [
        ({"a": 0.6, "b": 0.5}, {"b": -0.1}, False, "b"),
        ({"a": 0.6, "b": 0.5}, {"b": 0.1}, False, ""),
        ({"a": 0.6, "b": 0.5}, {"b": -0.007}, False, ""),  # a tie
        ({"a": 0.6, "b": 0.1}, {"b": -0.1}, False, ""),  # what explains most by far alone stands
        ({"a": 0.0}, {"b": -0.1}, False, "b"),  # what nobody tried alone does not
        ({"a": 0.6, "b": 0.5, "c": 0.5}, {"b": -0.1, "c": -0.4}, False, "c"),
        (
            {"a": 0.6, "b": 0.5},
            {"b": -0.1},
            True,
            "",
        ),  # by one standard error, nearly all data choose the first
        ({"a": 0.6, "b": 0.5}, {"b": -0.2}, True, "b"),  # by two
    ],
)
def test_an_effect_in_whose_place_another_predicts_better_is_beaten_by_it(
    monkeypatch: pytest.MonkeyPatch, alone: dict[str, float], scores: dict[str, float], surest: bool, by: str
) -> None:
    def tried_alone(selection: Any, name: str) -> Any:
        return iter([alone[name]] if name in alone else [])

    monkeypatch.setattr(weighing, "_alone", tried_alone)
    monkeypatch.setattr(weighing, "_share", lambda selection, gone: gone)
    monkeypatch.setattr(weighing, "surest_alone", lambda rounds, term: surest)
    term = cast(Hypothesis, SimpleNamespace(name="a"))
    differences = {name: ScoreDifference(gain, 10.0 * gain, 0.0) for name, gain in scores.items()}
    selection: Any = SimpleNamespace(rounds=())
    assert weighing._beaten(selection, term, differences) == by


@pytest.mark.parametrize(
    ("gap", "coupling", "by_far"), [(0.92, 0.47, True), (0.95, 0.97, False), (0.6, 0.5, False)]
)
def test_what_alone_explains_by_far_the_most_is_its_own_word(
    gap: float, coupling: float, by_far: bool
) -> None:
    """Shares of the loss that a gap and a coupling take off alone; what is asked of one effect by two
    amounts is one."""
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    gains = {
        "termination_backlash": gap,
        "series_compliance": coupling,
        "series_compliance:late_rad_per_Nm": 0.3,
    }
    tried = [
        SimpleNamespace(
            term=asked[name],
            model=SimpleNamespace(terms=(asked[name],)),
            difference=ScoreDifference(gain, 5.0, 5.0),
        )
        for name, gain in gains.items()
    ]
    selection: Any = SimpleNamespace(rounds=[SimpleNamespace(tried=tried)])
    assert alone_by_far(selection.rounds, asked["termination_backlash"]) is by_far
    assert not alone_by_far(selection.rounds, asked["series_compliance:late_rad_per_Nm"])


@pytest.mark.parametrize(
    ("name", "lead", "hardly"),
    [
        ("series_compliance", 1.2, True),
        ("series_compliance", 2.0, False),
        ("clamp_slip", -0.3, True),
        ("clamp_slip", 2.4, False),
        ("bearing_friction", -0.3, False),
    ],
)
def test_what_bends_to_the_form_of_others_has_to_be_clearly_ahead_of_them(
    name: str, lead: float, hardly: bool
) -> None:
    evidence = gather_body(JOINT, {"a/1": recorded()}).used
    asked = {h.name: h for h in hypotheses(JOINT, evidence)}
    problem = SimpleNamespace(evidence=evidence)
    model: Any = SimpleNamespace(fit=SimpleNamespace(problem=problem, values={}))
    said = hardly_ahead(model, asked[name], lead)
    assert bool(said) is hardly
    assert not hardly or (f"by {lead:.1f} standard errors; 2 are asked" in said)


@pytest.mark.parametrize(
    ("period_s", "lead", "hardly"),
    [(0.0, 0.5, False), (5.0, 0.5, False), (60.0, 0.5, True), (60.0, 2.5, False)],
)
def test_a_payload_of_which_no_recording_shows_a_cycle_has_to_be_ahead_of_a_load_read_with_a_drift(
    period_s: float, lead: float, hardly: bool
) -> None:
    columns = recorded()
    assert 5.0 < float(np.ptp(columns["time_s"])) < 60.0
    evidence = gather_body(JOINT, {"a/1": columns, "a/2": columns}).used
    weight = next(h for h in hypotheses(JOINT, evidence) if h.name == "gravity_load")
    values = {weight.key("period_s"): period_s}
    fit = SimpleNamespace(problem=SimpleNamespace(evidence=evidence), values=values)
    model: Any = SimpleNamespace(terms=(weight,), fit=fit)
    said = hardly_ahead(model, weight, lead)
    assert ("no recording shows a whole cycle" in said) is hardly
    assert bool(said) is hardly


@pytest.mark.parametrize(
    ("effect", "shown", "by_far", "lead", "said"),
    [
        # all of it swings, slowly: a drag of the joint, which no effect is
        (
            "inertial_load",
            {"swings": 1.0, "swings_rad_s": 0.3, "damping_ratio": 0.7},
            True,
            9.0,
            "no name here",
        ),
        ("inertial_load", {"swings": 0.6, "swings_rad_s": 9.0, "damping_ratio": 0.7}, True, 9.0, ""),
        # a coupling that reads late, alone by far, or ahead of its rivals, or neither
        ("series_compliance:late_rad_per_Nm", LATE, True, 0.0, ""),
        ("series_compliance:late_rad_per_Nm", LATE, False, 2.5, ""),
        ("series_compliance:late_rad_per_Nm", LATE, False, 1.5, "another effect is the better word"),
        # which is no coupling's or clearance's
        (
            "strand_friction",
            {"fraction": 0.2, "yield_N": 1e-6},
            False,
            9.0,
            "another effect is the better word",
        ),
    ],
)
def test_a_shape_at_which_another_effect_is_the_better_word_has_no_name_but_alone_or_far_ahead_of_it(
    effect: str, shown: dict[str, float], by_far: bool, lead: float, said: str
) -> None:
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    term = asked[effect]
    model: Any = SimpleNamespace(
        terms=(term,),
        fit=SimpleNamespace(
            problem=SimpleNamespace(parameters=(), config=JOINT),
            x=np.empty(0),
            values={term.key(name): value for name, value in shown.items()},
        ),
    )
    alone = SimpleNamespace(term=term, model=model, difference=ScoreDifference(0.95, 9.0, 9.0))
    rounds: Any = [SimpleNamespace(tried=[alone])] if by_far else []
    found = another(model, term, rounds, lead)
    assert said in found
    assert bool(found) is bool(said)
    # beside the clearance that a coupling would be, being ahead of others is not enough
    beside: Any = SimpleNamespace(terms=(term, asked["termination_backlash"]), fit=model.fit)
    assert bool(another(beside, term, rounds, lead)) is (bool(said) or (term.effect.in_series and not by_far))


def test_what_nearly_all_data_choose_alone_is_not_held_down_where_others_do_as_well_together() -> None:
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    first, other = asked["bearing_friction"], asked["series_compliance"]
    large = ScoreDifference(0.9, 9.0, 9.0)

    def rounds(share: float) -> Any:
        tried = [
            SimpleNamespace(term=h, model=SimpleNamespace(terms=(h,)), difference=large, selected_in=s)
            for h, s in ((first, share), (other, 1.0 - share))
        ]
        return [SimpleNamespace(tried=tried)]

    model: Any = SimpleNamespace(terms=(other, first))
    none = ScoreDifference(-0.01, -0.4, -0.4)
    assert slight(model, first, rounds(0.95), none, 0.11) == ""
    assert "without it the others predict" in slight(model, first, rounds(0.8), none, 0.11)
    assert "without it the others predict" in slight(model, other, rounds(0.95), none, 0.11)
