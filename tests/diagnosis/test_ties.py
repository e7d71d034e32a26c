"""What goes first where data left out do not tell models apart."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from grouped import GROUPS, NOISE, WAVE

from cablecomp.diagnosis.explain import ties
from cablecomp.diagnosis.explain.model import Model, Round, Tried
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.folds import Groups


def model(more: float, *names: str, parameters: int = 2) -> Model:
    """A model with these terms that leaves noise of deviation one and a wave of this size."""
    terms: Any = tuple(
        SimpleNamespace(name=n, effect=SimpleNamespace(id=n.partition(":")[0]), has_instant=n == "slip")
        for n in names
    )
    fit: Any = SimpleNamespace(problem=SimpleNamespace(parameters=range(parameters)), values={})
    return Model(terms, fit, NOISE + more * WAVE)


@pytest.fixture(autouse=True)
def _by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Amounts are implausible by name here; how plausible they are is held by `test_model.py`."""
    monkeypatch.setattr(ties, "implausible", lambda m: sum(t.name.startswith("absurd") for t in m.terms))
    monkeypatch.setattr(ties, "Hypothesis", SimpleNamespace)


@pytest.mark.parametrize(("more", "first"), [(0.0, "plausible"), (0.7, "plausible"), (3.0, "absurd")])
def test_a_plausible_effect_goes_before_one_that_does_not_predict_better_by_far(
    more: float, first: str
) -> None:
    """It leaves as much, a quarter more (clearly worse, for all that), and five times as much."""
    absurd, plausible = model(0.0, "absurd"), model(more, "plausible")
    assert ties._plausible_first([absurd, plausible], GROUPS)[0].name == first
    assert ties.outdoes(model(0.0, "other"), plausible, GROUPS) is (more > 0.0)


def test_no_second_effect_is_taken_for_being_plausible() -> None:
    models = [model(0.0, "absurd"), model(0.0, "plausible", "two")]
    assert ties._plausible_first(models, GROUPS)[0].name == "absurd"


@pytest.mark.parametrize(
    ("more", "parameters", "first"), [(0.25, 2, "sure"), (0.25, 3, "chance"), (0.7, 2, "chance")]
)
def test_what_resampled_data_choose_goes_before_what_ends_a_little_lower(
    more: float, parameters: int, first: str
) -> None:
    """It leaves 3 % more, with as many parameters or one more, or a quarter more."""
    models = [model(0.0, "chance"), model(more, "sure", parameters=parameters)]
    shares = {frozenset({"chance"}): 0.2, frozenset({"sure"}): 0.7}
    assert ties.in_order(models, GROUPS, shares)[0].name == first


def rounds(*alone: tuple[str, float]) -> list[Round]:
    """A first round in which these effects were tried, each the best in so many resampled data."""
    large = ScoreDifference(0.9, 20.0, 10.0)
    tried = [Tried(m.terms[0], m, large, share) for name, share in alone if (m := model(1.0, name))]
    return [Round(model(5.0), tuple(tried), tried[0])]


def test_one_effect_is_not_put_beside_itself_by_another_of_its_amounts() -> None:
    found = model(0.02, "path:late", "motor")
    assert ties.with_the_first(found, rounds(("path", 0.9), ("motor", 0.1)), GROUPS) is found


@pytest.mark.parametrize(
    ("more", "parameters", "final"),
    [(0.02, 2, "path + motor"), (0.7, 2, "jaw + motor"), (0.02, 3, "path + motor")],
)
def test_what_explains_most_alone_stands_where_it_predicts_as_well(
    monkeypatch: pytest.MonkeyPatch, more: float, parameters: int, final: str
) -> None:
    """In the jaw's place the path predicts as well, or clearly worse (a quarter of the square more); in the motor's,
    which was not tried alone, nothing is put."""
    replaced = []

    def in_its_place(m: Model, term: Any, other: Any, values: Any, groups: Groups) -> Model:
        replaced.append(term.name)
        return model(more, other.name, "motor", parameters=parameters)

    monkeypatch.setattr(ties, "_in_its_place", in_its_place)
    two = model(0.0, "jaw", "motor", parameters=3)
    assert ties.with_the_first(two, rounds(("jaw", 0.1), ("path", 0.9)), GROUPS).name == final
    assert replaced == ["jaw"]


@pytest.mark.parametrize(
    ("name", "share", "final"), [("path", 0.9, "path"), ("path", 0.7, "jaw"), ("slip", 0.9, "jaw")]
)
def test_what_nearly_all_data_choose_alone_need_not_be_the_simpler_law(
    monkeypatch: pytest.MonkeyPatch, name: str, share: float, final: str
) -> None:
    """With a parameter more than what is in its place, and as good; an event is the best of many."""

    def in_its_place(m: Model, term: Any, other: Any, values: Any, groups: Groups) -> Model:
        return model(0.02, other.name, "motor", parameters=4)

    monkeypatch.setattr(ties, "_in_its_place", in_its_place)
    two = model(0.0, "jaw", "motor", parameters=3)
    found = ties.with_the_first(two, rounds(("jaw", 1.0 - share), (name, share)), GROUPS)
    assert found.name == f"{final} + motor"


def test_what_explains_most_alone_but_is_not_plausible_takes_no_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ties, "_in_its_place", lambda *_: model(0.0, "absurd", "motor"))
    found = model(0.02, "jaw", "motor")
    assert ties.with_the_first(found, rounds(("absurd", 0.9), ("jaw", 0.1)), GROUPS) is found


def test_a_model_that_has_what_explains_most_alone_stays() -> None:
    two = model(0.0, "path", "motor")
    assert ties.with_the_first(two, rounds(("jaw", 0.1), ("path", 0.9)), GROUPS) is two
    assert ties.with_the_first(two, [Round(model(5.0), (), None)], GROUPS) is two
