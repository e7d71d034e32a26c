"""Which hypotheses a round tries."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joints import SMALL, closed

from cablecomp.config import parse_joint
from cablecomp.diagnosis.explain import model, rounds
from cablecomp.diagnosis.explain.beginning import _far as far_off
from cablecomp.diagnosis.explain.dependence import Dependence, gain_is_told, tell_a_gain
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import catalogue


def beginning(sessions: int, **further: Any) -> Any:
    """A later round beside a model of cost 100."""
    problem = SimpleNamespace(fine=False, parameters=(), repeated=("session",) * sessions)
    return SimpleNamespace(
        number=2, cost=100.0, cold={}, pace=SimpleNamespace(over=False), tell=lambda what: None, groups=None,
        model=SimpleNamespace(fit=SimpleNamespace(problem=problem), terms=()), **further,
    )  # fmt: skip


@pytest.mark.parametrize(("sessions", "further"), [(1, 0), (2, LIMITS.tried_trading)])
def test_what_trades_places_with_a_drive_that_is_not_known_is_tried_beside_what_promises_more(
    sessions: int, further: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def rough(answers: Any, evaluations: int, further: Any) -> list[Any]:
        tried.append(answers[0].hypothesis.name)
        return []

    monkeypatch.setattr(rounds, "rough", rough)
    monkeypatch.setattr(rounds, "ask_dependences", lambda *_: [])
    monkeypatch.setattr(rounds, "further", lambda h, at: [])
    plain = [f"event {k}" for k in range(LIMITS.tried_later + 2)]
    trading = [f"friction {k}" for k in range(LIMITS.tried_trading + 1)]
    answers: Any = [
        [SimpleNamespace(cost=50.0 + k, hypothesis=SimpleNamespace(name=n, trades=n in trading))]
        for k, n in enumerate((*plain, *trading))
    ]
    at = beginning(sessions, trades=lambda h: h.trades)
    at.groups = SimpleNamespace(by="block")
    worth, others = rounds._worth(at, answers)
    rounds._begun(at, worth)
    assert sorted(tried) == [*plain[: LIMITS.tried_later], *trading[:further]]
    assert [a[0].hypothesis.name for a in others] == [*plain[LIMITS.tried_later :], *trading[further:]]
    at.number = 0
    assert rounds._worth(at, answers) == (answers, [])  # all are tried at first


@pytest.mark.parametrize(("number", "kept"), [(0, ["coat"]), (1, [])])
def test_what_alone_leaves_what_is_plausible_is_no_answer_and_is_kept_apart(
    number: int, kept: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside other effects it is not kept at all."""
    law = catalogue()["pressure_dependent_friction"]
    coat, path = (Hypothesis(law, n, law.parameter("exponent"), (), True) for n in ("coat", "path"))
    for place in (rounds, model):
        monkeypatch.setattr(place, "runs_away", lambda fit, h: h.name == "coat")
    monkeypatch.setattr(model, "no_answer", lambda fit, term: "")
    monkeypatch.setattr(rounds, "no_answer", lambda fit, term: "")
    monkeypatch.setattr(rounds, "solve", lambda problem, *_: SimpleNamespace(values={}))
    monkeypatch.setattr(rounds, "left_out", lambda fit, groups: np.zeros(1))
    monkeypatch.setattr(rounds, "ranked_models", lambda models, groups: models)
    monkeypatch.setattr(rounds, "_compared", lambda models, at, fine, rng: models)
    at: Any = SimpleNamespace(
        number=number, pool=(), groups=None, tell=lambda what: None, pace=SimpleNamespace(over=False),
        model=SimpleNamespace(terms=()),
    )  # fmt: skip
    begun: Any = [SimpleNamespace(terms=(h,), problem=None, x=None, J=None) for h in (coat, path)]
    split: Any = rounds._tried(rounds._ended(begun, at, None), at, None, np.random.default_rng(0))
    assert [[m.name for m in models] for models in split] == [["path"], kept]


def test_an_effect_that_is_asked_for_by_several_amounts_takes_one_place() -> None:
    """A coat by its power and where it is pressed through had taken two of three from a stiffening cable."""
    law = catalogue()["pressure_dependent_friction"]
    amounts = [Hypothesis(law, name, law.parameter("exponent"), (), True) for name in ("a", "b")]
    cable = catalogue()["nonlinear_cable"]
    others: list[Any] = [
        Dependence("pretension_N", "session"),
        Hypothesis(cable, "c", cable.parameters[0], (), True),
    ]
    begun: list[Any] = [SimpleNamespace(terms=(t,)) for t in (*amounts, *others)]
    assert [c.terms[0].name for c in rounds._of_so_many(begun, 2)] == ["a", "b", others[0].name]
    assert len(rounds._of_so_many(begun, 3)) == 4


def test_a_drive_mounted_anew_takes_no_effects_place() -> None:
    """What differs between sessions is fitted to the end whatever promises more, if it lies lower than without."""
    law = catalogue()["nonlinear_cable"]
    effects = [Hypothesis(replace(law, id=f"e{k}"), f"e{k}", law.parameters[0], (), True) for k in range(12)]
    anew, by_posture = Dependence("pretension_N", "session"), Dependence("pretension_N", "bend_rad")

    def chosen(cost: float) -> list[str]:
        begun: list[Any] = [SimpleNamespace(terms=(h,), cost=10.0 + k) for k, h in enumerate(effects)]
        begun += [SimpleNamespace(terms=(d,), cost=cost) for d in (anew, by_posture)]
        return [c.terms[0].name for c in rounds._chosen(begun, [], beginning(1))]

    best = chosen(101.0)
    assert best == [h.name for h in effects[: len(best)]] != []
    assert chosen(99.0) == [*best, anew.name]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ([0.0, 1.0, 2.0], True),
        ([0.0, 0.0, 1.0, 1.0], True),
        ([0.0, 0.0, 1.0], False),
        ([1.0, 1.0], False),
        ([1.0], False),
    ],
)
def test_a_gain_by_a_condition_wants_three_values_or_two_of_two_recordings_each(
    values: list[float], told: bool
) -> None:
    assert tell_a_gain(values) is told


@pytest.mark.parametrize(
    ("values", "sessions", "told"),
    [
        ([0.0, 1.0], ["all", "all"], True),
        ([0.0, 0.0, 1.0], ["all", "all", "all"], True),
        ([1.0, 1.0], ["all", "all"], False),
        ([0.0, 1.0], ["a", "b"], False),
        ([0.0, 0.0, 0.0, 1.0], ["all"] * 4, False),
    ],
)
def test_two_values_of_a_condition_are_enough_in_one_session_of_which_blocks_are_left_out(
    values: list[float], sessions: list[str], told: bool
) -> None:
    """The rest of either recording shows its own value still; of two sessions either is mounted anew as well, and of
    four recordings whole ones are left out."""
    names = tuple(dict.fromkeys(sessions))
    problem: Any = SimpleNamespace(
        evidence=[SimpleNamespace(condition={"bend_rad": v}) for v in values],
        sessions=names,
        parameters=(),
        repeated=tuple(s for s in names if sessions.count(s) > 1),
    )
    assert gain_is_told(problem, "bend_rad") is told


@pytest.mark.parametrize(
    ("effect", "share"), [("nonlinear_cable", 0.63), ("bearing_friction", None), ("routing_friction", None)]
)
def test_a_share_with_a_bound_is_begun_with_most_of_it_as_well(effect: str, share: float | None) -> None:
    """0.7 of the 0.9 that is plausible of a cable's stiffening; a moment, or a coefficient without a bound, is not."""
    config = parse_joint({**closed(SMALL, "small"), "tolerance": {"EA_N": 1.0}}, "small")
    law = catalogue()[effect]
    amount = law.parameters[0]
    h = Hypothesis(law, effect, amount, (Start({p.name: p.neutral for p in law.parameters}),), False)
    fit: Any = SimpleNamespace(values={"EA_N": 2e4}, problem=SimpleNamespace(config=config))
    at: Any = SimpleNamespace(model=SimpleNamespace(fit=fit))
    found = far_off(h, at)
    if share is None:
        assert found == []
    else:
        (values,) = found
        assert values["EA_N"] == 2e4
        assert values[h.key(amount.name)] == pytest.approx(share)


def test_what_is_no_answer_takes_nobodys_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two delays beyond what is plausible had kept a clearance from being tried on a sheath."""
    begun = [SimpleNamespace(name=n, cost=50.0) for n in ("delay", "drift", "friction")]
    compared: list[str] = []

    def ended(chosen: Any, *_: Any) -> list[Any]:
        return [None if c.name in ("delay", "drift") else c.name for c in chosen]

    def tried(found: list[Any], *_: Any) -> tuple[list[Any], list[Any]]:
        compared.extend(name for name in found if name is not None)
        return [
            SimpleNamespace(difference=ScoreDifference(0.3, 9.0, 9.0), term=n, model=n) for n in compared
        ], []

    monkeypatch.setattr(rounds, "_asked", lambda at: [])
    monkeypatch.setattr(rounds, "_worth", lambda at, answers: ([], ["third", "fourth", "fifth"]))
    monkeypatch.setattr(rounds, "_begun", lambda at, worth: (begun, []))
    monkeypatch.setattr(rounds, "_chosen", lambda first, second, at: first)
    monkeypatch.setattr(
        rounds, "_rough", lambda at, others: ([SimpleNamespace(name=n, cost=60.0) for n in others], [])
    )
    monkeypatch.setattr(rounds, "_ended", ended)
    monkeypatch.setattr(rounds, "_tried", tried)
    at: Any = SimpleNamespace(model="before", number=1, cost=100.0)
    rounds.one_round(at, np.random.default_rng(0))
    assert compared == ["friction", "third", "fourth"]


@pytest.mark.parametrize(("z", "both"), [(0.0, True), (4.0, True), (6.0, False)])
def test_an_effect_with_pretensions_of_each_sessions_own_is_tried_beside_what_hardly_helps_alone(
    z: float, both: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two in turn that of which more is taken off is accepted; what surely helps alone is."""

    def tried(chosen: list[str], *_: Any) -> tuple[list[Any], list[Any]]:
        found = {"alone": ScoreDifference(0.1, z, z), "together": ScoreDifference(0.3, 4.0, 4.0)}
        return [SimpleNamespace(difference=found[c], term=c, model=c) for c in chosen], []

    for name, answer in {
        "_asked": [],
        "_worth": ([], []),
        "_begun": ([], []),
        "_chosen": ["alone"],
        "_pairs": ["together"],
    }.items():
        monkeypatch.setattr(rounds, name, lambda *_, answer=answer: answer)
    monkeypatch.setattr(rounds, "_ended", lambda chosen, *_: list(chosen))
    monkeypatch.setattr(rounds, "_tried", tried)
    at: Any = SimpleNamespace(model="before", number=1)
    found = rounds.one_round(at, np.random.default_rng(0))
    assert [t.term for t in found.tried] == (["together", "alone"] if both else ["alone"])
    assert found.accepted is found.tried[0]
