"""The table of all comparisons: what is named is nowhere "not needed" on the way to the model that has it."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from cablecomp.diagnosis.answer import entries
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.outcome import Outcome


def _named(*names: str) -> tuple[Any, ...]:
    return tuple(SimpleNamespace(name=n) for n in names)


def _round(base: tuple[str, ...], *tried: str) -> Any:
    difference = SimpleNamespace(gain=0.5, z=4.0)
    rows = [SimpleNamespace(term=t, difference=difference, selected_in=0.9) for t in _named(*tried)]
    return SimpleNamespace(
        base=SimpleNamespace(name=" + ".join(base) or "calibrated drive", terms=_named(*base)), tried=rows
    )


def _outcomes(rounds: list[Any], final: tuple[str, ...], named: Sequence[str]) -> list[tuple[str, str, str]]:
    selection: Any = SimpleNamespace(rounds=rounds, final=SimpleNamespace(terms=_named(*final)))
    return [(t.beside, t.name, t.outcome) for t in entries.tested(selection, named)]


def test_steps_to_the_final_model_say_what_became_of_them() -> None:
    rounds = [
        _round((), "path", "bearing", "slip"),
        _round(("bearing",), "path"),
        _round(("path",), "motor", "slip"),
    ]
    assert _outcomes(rounds, ("path", "motor"), ("path",)) == [
        ("calibrated drive", "path", "named"),
        ("calibrated drive", "bearing", "not needed"),
        ("calibrated drive", "slip", "not needed"),
        ("bearing", "path", "not needed"),  # a model that went no further
        ("path", "motor", "candidate"),
        ("path", "slip", "not needed"),
    ]


def test_what_was_put_in_afterwards_is_named_wherever_it_was_asked_for() -> None:
    rounds = [_round((), "bearing"), _round(("bearing",), "path")]
    assert _outcomes(rounds, ("path",), ("path",))[1:] == [("bearing", "path", "named")]


def test_what_differs_between_sessions_is_no_candidate_where_the_answer_says_that_it_does() -> None:
    """Of the drive itself and of what is named; of a candidate it is none of the answer's."""
    path, slip = (SimpleNamespace(name=n, effect=SimpleNamespace(id=n)) for n in ("path", "slip"))
    depends = [Dependence(p, "session") for p in ("pretension_N", "effect.path.mu", "effect.slip.slip_m")]
    outcome: Any = SimpleNamespace(
        names=["path"], named=[SimpleNamespace(term=path)], kept=SimpleNamespace(terms=(path, slip, *depends))
    )
    told = Outcome.told.__get__(outcome)
    assert told == ["path", "pretension_N by session", "effect.path.mu by session"]
    rounds = [_round((), "pretension_N by session")]
    assert _outcomes(rounds, ("pretension_N by session",), told)[0][2] == "named"
