"""Several starts: the one that leaves least is gone on from, for each session its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cablecomp.errors import InputError
from cablecomp.estimation import multi_start as several
from cablecomp.estimation.multi_start import lowest, lowest_by_session
from cablecomp.signal.smoothing import FloatArray

ROWS = 5


def followed(x: FloatArray) -> FloatArray | None:
    """Misfit of two sessions of five rows: the first wants 1, the second 3, each by a value of its own; a common value
    below 0 cannot be followed."""
    return None if x[0] < 0.0 else np.repeat([x[1] - 1.0, x[2] - 3.0], ROWS)


PROBLEM: Any = SimpleNamespace(
    followed=followed,
    sessions=("a", "b"),
    parameters=[SimpleNamespace(session=s) for s in (None, "a", "b")],
    evidence=[SimpleNamespace(session=s) for s in ("a", "b")],
    spans=lambda: {"angle": slice(0, 2 * ROWS)},
    owners=lambda c: np.repeat([0, 1], ROWS),
)
STARTS = [np.array([c, v, v]) for c, v in ((-1.0, 2.0), (0.5, 1.0), (0.7, 3.2))]


def test_the_start_that_leaves_least_is_taken_and_its_residual_kept() -> None:
    x, residual = lowest(PROBLEM, STARTS)
    assert x is STARTS[1]
    assert residual is not None
    assert residual.tolist() == [0.0] * ROWS + [-2.0] * ROWS


def test_where_none_can_be_followed_the_first_is_handed_on_without_a_residual() -> None:
    x, residual = lowest(PROBLEM, STARTS[:1])
    assert x is STARTS[0]
    assert residual is None
    assert lowest_by_session(PROBLEM, STARTS[:1]) is None


def test_each_session_takes_its_own_from_the_start_that_suits_its_rows() -> None:
    found = lowest_by_session(PROBLEM, STARTS)
    assert found is not None
    cost, x = found
    assert x.tolist() == [0.5, 1.0, 3.2]
    assert cost == pytest.approx(0.5 * ROWS * 0.2**2)


def test_fits_come_best_first_without_what_cannot_be_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(problem: Any, x: FloatArray, evaluations: int, tolerance: float) -> Any:
        if x[0] < 0.0:
            raise InputError("cannot be followed")
        return SimpleNamespace(cost=float(x[1]))

    monkeypatch.setattr(several, "solve", solve)
    fits = several.multi_start(PROBLEM, STARTS[::-1], 3, 1e-3)
    assert [f.cost for f in fits] == [1.0, 3.2]
