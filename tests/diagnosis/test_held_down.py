"""What holds an effect down whatever its evidence is: little of what there is, chance, another's shape or form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain.held_down import (
    another,
    hardly_ahead,
    seen_once,
    slight,
    stands_in,
    tightened,
    too_little,
)
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.explain.ties import alone_by_far

LATE = {"late_rad_per_Nm": 1e-3, "lag_s": 0.05}
MOMENT = {"torque_Nm": 1e-3, "growth_per_Nm": 40.0, "presliding_rad": 1e-4}
"""A bearing that drags with its load alone; the test has the bound of its growth where that is."""


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
        ("termination_backlash", True, 0.2, 2.4, 0.01, "1.0% of the mismatch, which the form"),
        ("termination_backlash", True, 0.2, 2.6, 0.01, ""),
        ("termination_backlash", False, 0.2, 2.4, 0.01, ""),
        ("termination_backlash", True, 0.6, 2.4, 0.01, ""),
        ("termination_backlash", True, 0.2, 1.0, 0.10, ""),
        ("bearing_friction", True, 0.2, 1.0, 0.01, ""),
        ("bearing_friction", True, -0.01, -0.4, 0.11, "without it the others predict"),
        ("bearing_friction", False, -0.01, -0.4, 0.11, ""),
        ("clock_skew", True, 0.04, 1.0, 0.01, ""),
    ],
)
def test_what_takes_off_a_hundredth_beside_another_effect_may_be_the_others_form(
    name: str, beside: bool, gain: float, z: float, share: float, expected: str
) -> None:
    """Not alone, nor where it takes off most of what was left, or is missed as a further effect has to be, nor what
    does not give way in series; that none is missed is said of any."""
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    term = asked[name]
    model: Any = SimpleNamespace(terms=(asked["routing_friction"], term) if beside else (term,))
    said = slight(model, term, (), ScoreDifference(gain, z, z), share)
    assert bool(said) is bool(expected)
    assert expected in said


@pytest.mark.parametrize(
    ("beside", "put_in", "z", "held"),
    [(True, True, 1.3, True), (True, True, 2.6, False), (True, False, 1.3, False), (False, True, 1.3, False)],
)
def test_what_is_put_in_anothers_place_has_to_be_missed_beside_others(
    beside: bool, put_in: bool, z: float, held: bool
) -> None:
    """As a further effect has to be; alone its confidence says what it is worth."""
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    term = asked["bearing_friction"]
    model: Any = SimpleNamespace(terms=(asked["routing_friction"], term) if beside else (term,))
    said = stands_in(model, term, {term.name} if put_in else set(), ScoreDifference(0.2, z, z))
    assert said == (f"in another's place, z = {z:.1f}; 2.5 are asked for" if held else "")


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
        ("series_compliance", 1.5, False),
        ("clamp_slip", -0.3, True),
        ("clamp_slip", 2.4, False),
        ("bearing_friction", -0.3, False),
    ],
)
def test_what_bends_to_the_form_of_others_has_to_be_clearly_ahead_of_them(
    name: str, lead: float, hardly: bool
) -> None:
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    alone: Any = SimpleNamespace(terms=(asked[name],))
    beside: Any = SimpleNamespace(terms=(asked["routing_friction"], asked[name]))
    assert hardly_ahead(alone, asked[name], lead) == ""
    said = hardly_ahead(beside, asked[name], lead)
    assert bool(said) is hardly
    assert not hardly or (f"by {lead:.1f} standard errors; 1.5 are asked" in said)


@pytest.mark.parametrize(
    ("period_s", "lead", "hardly"),
    [(0.0, 0.5, False), (5.0, 0.5, False), (60.0, 0.5, True), (60.0, 1.9, True), (60.0, 2.0, False)],
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
    said = seen_once(model, weight, lead)
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
        # a bearing that drags with its load alone, far ahead of every other effect or not
        ("bearing_friction", MOMENT, False, 5.0, ""),
        ("bearing_friction", MOMENT, False, 4.9, "another effect is the better word"),
        (
            "bearing_friction",
            {"torque_Nm": 0.01, "presliding_rad": 1.0},
            False,
            9.0,
            "another effect is the better word",
        ),
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
    evidence = gather_body(JOINT, {"a/1": recorded()}).used
    asked = {h.name: h for h in hypotheses(JOINT, evidence)}
    term = asked[effect]
    most = shown.get("growth_per_Nm", 0.0)
    bound = SimpleNamespace(base=term.key("growth_per_Nm"), high=most, value=float, vague=False)
    model: Any = SimpleNamespace(
        terms=(term,),
        fit=SimpleNamespace(
            problem=SimpleNamespace(parameters=(bound,) if most else (), config=JOINT, evidence=evidence),
            x=np.full(int(most > 0.0), most),
            values={term.key(name): value for name, value in shown.items()},
        ),
    )
    alone = SimpleNamespace(term=term, model=model, difference=ScoreDifference(0.95, 9.0, 9.0))
    rounds: Any = [SimpleNamespace(tried=[alone])] if by_far else []
    found = another(model, term, rounds, lead, 1.0)
    assert said in found
    assert bool(found) is bool(said)
    # beside the clearance that a coupling would be, being ahead of others is not enough
    beside: Any = SimpleNamespace(terms=(term, asked["termination_backlash"]), fit=model.fit)
    assert bool(another(beside, term, rounds, lead, 1.0)) is (
        bool(said) or (term.effect.in_series and not by_far)
    )


@pytest.mark.parametrize(
    ("of_deflection", "lead", "removes", "held"),
    [
        (0.002, 5.0, 0.6, False),
        (0.002, 4.9, 0.6, True),
        (0.002, 9.0, 0.4, True),  # which the form of another friction may leave
        (0.2, 9.0, 1.0, True),  # a hysteresis of the drive
        (0.05, 0.0, 0.0, False),
    ],
)
def test_a_friction_that_leaps_at_each_reversal_has_its_name_where_it_is_most_and_nothing_comes_near(
    of_deflection: float, lead: float, removes: float, held: bool
) -> None:
    evidence = gather_body(JOINT, {"a/1": recorded()}).used
    term = next(h for h in hypotheses(JOINT, evidence) if h.name == "bearing_friction")
    values = {
        term.key("torque_Nm"): 1e-3,
        term.key("presliding_rad"): of_deflection * evidence[0].deflection_rad,
    }
    problem = SimpleNamespace(parameters=(), config=JOINT, evidence=evidence)
    fit = SimpleNamespace(problem=problem, x=np.empty(0), values=values)
    model: Any = SimpleNamespace(terms=(term,), fit=fit)
    assert bool(another(model, term, [], lead, removes)) is held


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


@pytest.mark.parametrize(
    ("effect", "anew", "said"),
    [
        ("thermal_pretension", True, True),
        ("pretension_relaxation", True, True),
        ("pretension_relaxation", False, False),
        ("termination_backlash", True, False),  # no mounting makes play
        ("clamp_slip", True, False),  # an event is held against it by its standard errors
    ],
)
def test_what_changes_slowly_has_no_name_where_a_drive_mounted_anew_does_as_well(
    effect: str, anew: bool, said: bool
) -> None:
    columns = recorded()
    columns["temperature_degC"] = 20.0 + 0.1 * columns["time_s"]
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": columns}).used)}
    found = tightened(asked[effect], ("a pretension of each session's own",) if anew else ())
    assert bool(found) is said
    assert not said or found.startswith("a pretension of each session's own predicts")
