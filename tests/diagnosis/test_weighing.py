"""What is held against a name: a bound that its law ran into, but not a bound that is an answer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from turning import hypothesis

from cablecomp.diagnosis.answer import entries
from cablecomp.diagnosis.explain import weighing
from cablecomp.diagnosis.explain.confidence import learnt
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.explain.weighed import Weighed, in_order, one_in_series
from cablecomp.diagnosis.explain.weighing import _against, _at_bound, _follows, _unfollowed


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


def _weighed(name: str, removes: float, confidence: float) -> Weighed:
    even, effect = ScoreDifference(0.5, 9.0, 9.0), hypothesis(name.partition(":")[0], name)
    return Weighed(effect, None, {}, confidence, {}, even, "", removes)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        # RMS that it moves the joint by [rad], None: as much as the drive cannot follow; its confidence
        ((3e-4, 0.9), (2e-4, 0.9)),
        ((2e-4, 0.94), (3.6e-4, 0.62)),  # sure, and hardly less
        ((4e-4, 0.62), (1e-4, 0.94)),  # less sure, and far more
        ((3e-4, 0.9), (8e-5, 1.0)),  # no name is beyond doubt
        ((None, 0.6), (3e-4, 0.99)),
    ],
)
def test_what_moves_the_joint_most_for_how_sure_it_is_stands_first(
    first: tuple[float | None, float], second: tuple[float, float]
) -> None:
    def moving(name: str, moves_rad: float | None, confidence: float) -> Weighed:
        w = _weighed(name, 0.5, confidence)
        moves = {} if moves_rad is None else {"moves_rad": moves_rad}
        return replace(w, evidence={**w.evidence, "gain": 0.5, **moves})

    found = in_order([moving("clamp_slip", *second), moving("gravity_load", *first)])
    assert [w.term.name for w in found] == ["gravity_load", "clamp_slip"]


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
    found = one_in_series([_weighed(name, *size) for name, size in sizes.items()])
    assert [w.term.name for w in found] == list(sizes)
    assert {w.term.name for w in found if w.confidence >= 0.5} == named
    for w in found:
        was = sizes[w.term.name][1]
        assert (w.confidence == was) is (w.term.name in named or was < 0.5)
        assert ("one curve of the load" in w.why_not) is (w.confidence != was)


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
    ("ahead", "said"),
    [
        (1.4, "tell them apart by 1.4 standard errors"),
        (-2.3, "strand_break predicts data left out better, by 2.3"),
    ],
)
def test_what_stands_in_for_an_effect_is_told_with_how_far_data_tell_these_apart(
    ahead: float, said: str
) -> None:
    """By the rival that is nearest among them, whatever is nearest of all that was tried."""
    weighed = replace(_weighed("clamp_slip", 0.5, 0.9), rivals={"gravity_load": 3.0, "strand_break": ahead})
    ((names, why),) = entries.tied_of([weighed], cast(Any, SimpleNamespace(rounds=[])))
    assert names == ("clamp_slip", "gravity_load", "strand_break")
    assert said in why


@pytest.mark.parametrize(
    ("without", "share"),
    [
        (8.0, 0.5),  # of 10, of which the model leaves 3
        (9.9, 0.69),
        (40.0, 0.7),  # the others alone are worse than none, and 3 are left for all that
        (None, 0.7),  # the drive cannot be followed without it
    ],
)
def test_an_effect_takes_off_no_more_than_the_whole_model(
    monkeypatch: pytest.MonkeyPatch, without: float | None, share: float
) -> None:
    monkeypatch.setattr(weighing, "_mean_squares", lambda model, groups, tail=3.0: np.array([model]))
    selection: Any = SimpleNamespace(baseline=10.0, final=3.0, groups=None)
    gone = weighing._gone(selection, cast(Any, without), selection.final)
    assert weighing._of_all(selection, gone) == pytest.approx(share)


def test_what_is_said_to_go_counts_in_full_what_the_model_misses_by_far() -> None:
    """Of 100 rows all by 10 before; after by 1, but five by 20: of 100 squares 20.95 are left."""

    def leaving(left: np.ndarray) -> Any:
        spans = {"joint_position_rad": slice(0, 100)}
        weighing_ = SimpleNamespace(sigma={"joint_position_rad": 1.0})
        return SimpleNamespace(
            left_out=left,
            fit=SimpleNamespace(problem=SimpleNamespace(spans=lambda: spans, weighing=weighing_)),
        )

    final = leaving(np.where(np.arange(100) < 5, 20.0, 1.0))
    groups = SimpleNamespace(block=np.arange(100) // 10, channel=np.zeros(100, dtype=np.int64))
    selection: Any = SimpleNamespace(baseline=leaving(np.full(100, 10.0)), final=final, groups=groups)
    gone = weighing._gone(selection, selection.baseline, final)
    assert weighing._of_all(selection, gone) == pytest.approx(
        1.0 - (5 * 20.0**2 + 95 * 1.0**2) / (100 * 10.0**2)
    )


def test_what_alone_has_to_be_larger_than_is_plausible_takes_off_what_it_does_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All of a jaw's recordings: its bearing's friction, one of four effects, ends alone just beyond what is plausible,
    and by last digits just below it."""
    monkeypatch.setattr(weighing, "_gone", lambda selection, before, after: before - after.left)
    models = {
        name: SimpleNamespace(terms=(SimpleNamespace(name=name),), left=left)
        for name, left in (("path", 3.0), ("jaw", 4.0))
    }
    first = SimpleNamespace(tried=[SimpleNamespace(model=models["path"])], away=(models["jaw"],))
    selection: Any = SimpleNamespace(baseline=10.0, rounds=(first,))
    assert {n: [*weighing._alone(selection, n)] for n in ("path", "jaw", "motor")} == {
        "path": [7.0], "jaw": [6.0], "motor": []
    }  # fmt: skip


@pytest.mark.parametrize(
    ("alone", "scores", "surest", "by"),
    [
        ({"a": 0.6, "b": 0.5}, {"b": -0.1}, False, "b"),
        ({"a": 0.6, "b": 0.5}, {"b": 0.1}, False, ""),
        ({"a": 0.6, "b": 0.5}, {"b": -0.007}, False, ""),  # a tie
        ({"a": 0.6, "b": 0.1}, {"b": -0.1}, False, ""),  # what explains most by far alone stands
        ({"a": 0.0}, {"b": -0.1}, False, "b"),  # what nobody tried alone does not
        ({"a": 0.6, "b": 0.5, "c": 0.5}, {"b": -0.1, "c": -0.4}, False, "c"),
        # what nearly all data choose alone: by one standard error, by two
        ({"a": 0.6, "b": 0.5}, {"b": -0.1}, True, ""),
        ({"a": 0.6, "b": 0.5}, {"b": -0.2}, True, "b"),
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
