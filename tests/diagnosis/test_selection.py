"""Which model reigns after a round: one that extends the best, or one that takes off much that the best leaves."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from grouped import GROUPS, NOISE, WAVE

from cablecomp.diagnosis.explain import model as model_module
from cablecomp.diagnosis.explain import selection, ties
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.effects import catalogue
from cablecomp.signal.smoothing import FloatArray


def model(size: float, *names: str) -> Model:
    """A model with these terms that leaves noise of this size (seed 1: the same shape for all)."""
    terms: Any = tuple(SimpleNamespace(name=n) for n in names)
    fit: Any = SimpleNamespace(problem=SimpleNamespace(fine=False))
    return Model(terms, fit, size * NOISE)


@pytest.fixture(autouse=True)
def _as_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(selection, "reweighed", lambda m, weighing, groups: m)


def reigning(best: Model, *carried: Model) -> str:
    weights: Any = None
    return selection._reigning(best, carried, model(2.0), weights, GROUPS).name


def test_one_that_adds_to_the_best_and_predicts_better_reigns() -> None:
    assert reigning(model(1.0, "a"), model(0.9, "a", "b")) == "a + b"


def test_two_others_that_take_off_a_little_more_than_one_do_not() -> None:
    """The one takes off 3 of 4 (in squares), the two 0.1 more: less than a tenth of that."""
    assert reigning(model(1.0, "a"), model(0.95, "b", "c")) == "a"


def test_two_others_that_take_off_a_little_more_do_where_the_one_is_not_plausible(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(selection, "implausible", lambda m: sum(t.name == "a" for t in m.terms))
    assert reigning(model(1.0, "a"), model(0.9, "b", "c")) == "b + c"
    assert reigning(model(1.0, "a"), model(1.1, "b", "c")) == "a"  # not without predicting better


def test_two_others_that_take_off_much_more_do() -> None:
    assert reigning(model(1.0, "a"), model(0.5, "b", "c")) == "b + c"


def test_the_fewer_effects_are_given_up_the_less_has_to_be_gained() -> None:
    """Of what the best leaves 0.23 gone: more than a sixth, asked for one effect of three, less than for all three."""
    best = model(1.0, "a", "b", "c")
    assert reigning(best, model(0.88, "a", "b", "d", "e")) == "a + b + d + e"
    assert reigning(best, model(0.88, "d", "e")) == "a + b + c"


def test_where_others_are_not_enough_better_one_that_adds_to_the_best_is_taken() -> None:
    assert reigning(model(1.0, "a"), model(0.94, "b", "c"), model(0.95, "a", "c")) == "a + c"


@pytest.mark.parametrize(("more", "reigns"), [(0.02, "a + c"), (0.5, "b + c")])
def test_two_others_reign_where_they_predict_clearly_better_than_one_that_adds_to_the_best(
    more: float, reigns: str
) -> None:
    """All leave noise of half the size; what keeps the best leaves a wave more: of a twenty-fifth, or as large."""
    others, keeping = model(0.5, "b", "c"), model(0.5, "a", "c")
    keeping = replace(keeping, left_out=0.5 * NOISE + more * WAVE)
    assert reigning(model(1.0, "a"), others, keeping) == reigns


def test_what_adds_nothing_to_the_best_does_not_keep_two_others_from_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The two leave little more than half, with an amount that is not plausible: not far enough ahead of the one that
    keeps the best, which itself is no better than that."""
    monkeypatch.setattr(ties, "implausible", lambda m: sum(t.name == "b" for t in m.terms))
    keeping = model(0.999, "a", "c")
    assert not ties.outdoes(model(0.75, "b", "c"), keeping, GROUPS)
    assert reigning(model(1.0, "a"), model(0.75, "b", "c"), keeping) == "b + c"
    assert reigning(model(1.0, "a"), model(0.75, "b", "c"), model(0.9, "a", "c")) == "a + c"


def test_what_predicts_no_better_does_not() -> None:
    assert reigning(model(1.0, "a"), model(1.0, "a", "b")) == "a"


OWN = Dependence("pretension_N", "session")


def mounted_anew(left: FloatArray, *effects: str) -> Model:
    """A model in which each session has a pretension of its own, beside these effects."""
    bare = model(1.0, *effects)
    return Model((OWN, *bare.terms), bare.fit, left)


def first_of(*models: Model) -> str:
    return ties._mounted_anew_first(list(models), GROUPS)[0].name


@pytest.mark.parametrize("shared", [(), ("a",)])
def test_a_drive_mounted_anew_goes_before_an_effect_that_predicts_hardly_better(
    shared: tuple[str, ...],
) -> None:
    """Both leave the noise, the drive mounted anew a wave more: of a fiftieth, or of half of the noise's deviation."""
    effect = model(1.0, "effect", *shared)
    near, far = (mounted_anew(NOISE + share * WAVE, *shared) for share in (0.02, 0.5))
    assert first_of(effect, near) == near.name
    assert first_of(effect, far) == effect.name


def test_a_drive_mounted_anew_with_an_effect_of_its_own_takes_nobodys_place() -> None:
    effect = model(1.0, "effect")
    assert first_of(effect, mounted_anew(NOISE + 0.02 * WAVE, "other")) == effect.name
    assert first_of(effect, mounted_anew(NOISE + 0.02 * WAVE, "effect")) == effect.name


@pytest.mark.parametrize(("by_far", "left"), [("", "c"), ("a", "a + c")])
def test_what_alone_explains_by_far_the_most_is_not_left_out(
    monkeypatch: pytest.MonkeyPatch, by_far: str, left: str
) -> None:
    """Of three effects the first two are not missed beside the others; the last to come stays."""

    def without(m: Model, term: Any, groups: Any, known: Any) -> Model:
        return replace(m, terms=tuple(t for t in m.terms if t is not term))

    monkeypatch.setattr(selection, "without", without)
    monkeypatch.setattr(selection, "implausible", lambda m: 0)
    monkeypatch.setattr(selection, "alone_by_far", lambda rounds, term: term.name == by_far)
    assert selection._pruned(model(1.0, "a", "b", "c"), [], GROUPS).name == left


@pytest.mark.parametrize(
    ("term", "event", "known"),
    [
        (Dependence("pretension_N", "session"), True, False),
        (Dependence("pretension_N", "session"), False, True),
        (Dependence("effect.routing_friction.mu_angle", "session"), True, True),
        (None, True, True),
    ],
)
def test_an_event_elsewhere_does_not_stand_in_for_mounting_anew(
    monkeypatch: pytest.MonkeyPatch, term: Dependence | None, event: bool, known: bool
) -> None:
    """A slip found between two sessions is another one than that which the model has beside their own pretensions."""
    law = catalogue()["clamp_slip" if event else "nonlinear_cable"]
    other = Hypothesis(law, law.id, law.parameters[0], (), True)
    monkeypatch.setattr(selection, "without", lambda m, term, groups, known: known)
    with_it = replace(model(1.0), terms=(other, term or other))
    found: Any = selection._without(with_it, term or other, GROUPS, [model(1.0)])
    assert bool(found) is known


def fitted(left: Any, *names: str, fine: bool = False, weighing: str = "its own") -> Model:
    fit: Any = SimpleNamespace(problem=SimpleNamespace(fine=fine, weighing=weighing))
    return replace(model(1.0, *names), fit=fit, left_out=left)


@pytest.mark.parametrize(
    ("known", "left"),
    [
        ([], 1.0),
        ([fitted(NOISE + 0.1 * WAVE, "a")], 0.1),
        ([fitted(NOISE + 0.2 * WAVE, "a"), fitted(NOISE + 0.1 * WAVE, "a")], 0.1),
        ([fitted(NOISE + 3.0 * WAVE, "a")], 1.0),  # it predicts worse
        ([fitted(NOISE, "b"), fitted(NOISE, "a", "b"), fitted(NOISE, "a", fine=True)], 1.0),  # or is another
        ([fitted(NOISE[:-1], "a")], 1.0),  # or about other recordings
    ],
)
def test_an_effect_is_not_missed_for_the_valley_in_which_it_has_left_the_others(
    monkeypatch: pytest.MonkeyPatch, known: list[Model], left: float
) -> None:
    """A known model of the terms that are left, with the weights that are held against, where it predicts better."""

    def reweighed(m: Model, weighing: Any, groups: Any) -> Model:
        return fitted(m.left_out, *m.added, weighing=weighing)

    monkeypatch.setattr(model_module, "reweighed", reweighed)
    like = fitted(NOISE, "a", "b", weighing="like")
    stuck = fitted(NOISE + WAVE, "a", weighing="like")
    found = model_module.or_known(stuck, frozenset("a"), like, known, GROUPS)
    assert found is not None
    np.testing.assert_array_equal(found.left_out, NOISE + left * WAVE)
    assert found.fit.problem.weighing == "like"


def test_every_model_that_was_fitted_on_the_way_is_known() -> None:
    tried: Any = [SimpleNamespace(model=model(1.0, *names)) for names in ("a", "b", "ab")]
    rounds: Any = (SimpleNamespace(tried=tried[:2]), SimpleNamespace(tried=tried[2:]))
    found = model_module.Selection(model(1.0), rounds, model(1.0, "a"), GROUPS, Seen())
    assert [m.added for m in found.known] == [set(), {"a"}, {"b"}, {"a", "b"}]


def test_where_nothing_was_found_without_it_a_known_model_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_module, "reweighed", lambda m, weighing, groups: m)
    like, known = fitted(NOISE, "a", "b"), fitted(NOISE + WAVE, "a")
    assert model_module.or_known(None, frozenset("a"), like, [known], GROUPS) is known
    assert model_module.or_known(None, frozenset("c"), like, [known], GROUPS) is None


def test_what_the_last_round_demanded_and_the_best_lacks_is_asked_for_again() -> None:
    def tried(name: str, gain: float, z: float) -> Any:
        return SimpleNamespace(term=SimpleNamespace(name=name), difference=ScoreDifference(gain, z, z))

    latest: Any = [
        SimpleNamespace(tried=(tried("a", 0.3, 6.0), tried("b", 0.1, 4.0))),
        SimpleNamespace(tried=(tried("c", 0.01, 6.0), tried("d", 0.3, 1.0))),
    ]
    pool: Any = [SimpleNamespace(name=n) for n in "abcde"]
    again = selection._still_demanded(pool, latest, model(1.0, "a"))
    assert [h.name for h in again] == ["b"]


def test_of_a_drive_in_several_sessions_the_plausible_model_that_lies_lowest_is_carried_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of those that extend the one below: what extends another, or is not plausible, or has no answer, is not."""

    def of_cost(cost: float, *names: str) -> Model:
        bare = model(1.0, *names)
        fit: Any = SimpleNamespace(problem=bare.fit.problem, cost=cost)
        return replace(bare, fit=fit)

    plausible, bearing = {"wild": 1}, {"broken": False}
    monkeypatch.setattr(selection, "implausible", lambda m: max(plausible.get(t.name, 0) for t in m.terms))
    monkeypatch.setattr(selection, "bears", lambda fit: bearing.get(fit.name, True))
    monkeypatch.setattr(selection, "amount_resolved", lambda fit, term: term.name != "none")
    below, other = of_cost(50.0, "a"), of_cost(50.0, "z")

    def rounds_of(*found: tuple[float, str]) -> Any:
        models = [of_cost(cost, "a", name) for cost, name in found]
        for m, (_, name) in zip(models, found, strict=True):
            m.fit.__dict__["name"] = name
        theirs = [SimpleNamespace(model=of_cost(1.0, "z", "b"))]
        return [
            SimpleNamespace(base=below, tried=[SimpleNamespace(model=m) for m in models]),
            SimpleNamespace(base=other, tried=theirs),
        ]

    def further(*found: tuple[float, str]) -> str | None:
        weights: Any = None
        lower = selection._further_down(below, rounds_of(*found), weights, GROUPS)
        return None if lower is None else lower.name

    assert further((30.0, "b"), (20.0, "c"), (5.0, "wild"), (4.0, "broken")) == "a + c"
    assert further((30.0, "b"), (3.0, "none")) is None
    assert further((5.0, "wild")) is None


def test_the_plausible_one_is_carried_on_beside_one_that_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(selection, "implausible", lambda m: sum(t.name == "wild" for t in m.terms))
    sure, wild, below = model(1.0, "a", "b"), model(1.0, "a", "wild"), model(1.0, "a", "c")

    def carried(*models: Model, lower: Model | None = below) -> list[str]:
        return [m.name for m in selection._beside_doubtful(list(models), lower)]

    assert carried(sure, wild) == ["a + b", "a + wild", "a + c"]
    assert carried(sure) == ["a + b"]
    assert carried(wild, below) == ["a + wild", "a + c"]
    assert carried(wild, lower=None) == ["a + wild"]
