"""The table of all comparisons: what is named is nowhere "not needed" on the way to the model that has it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from cablecomp.diagnosis.answer import entries


def _named(*names: str) -> tuple[Any, ...]:
    return tuple(SimpleNamespace(name=n) for n in names)


def _round(base: tuple[str, ...], *tried: str) -> Any:
    difference = SimpleNamespace(gain=0.5, z=4.0)
    rows = [SimpleNamespace(term=t, difference=difference, selected_in=0.9) for t in _named(*tried)]
    return SimpleNamespace(
        base=SimpleNamespace(name=" + ".join(base) or "calibrated drive", terms=_named(*base)), tried=rows
    )


def _outcomes(
    rounds: list[Any], final: tuple[str, ...], named: tuple[str, ...]
) -> list[tuple[str, str, str]]:
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
