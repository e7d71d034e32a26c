"""The best two steps of an event, held against least squares of every pair."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cablecomp.diagnosis.explain.steps import _best_two
from cablecomp.signal.smoothing import FloatArray


def best_of_all_pairs(columns: FloatArray, left: FloatArray) -> tuple[tuple[int, int], FloatArray, float]:
    """The pair of one sign that takes most off the square, each pair by least squares on its own columns."""
    found = []
    for pair in itertools.combinations(range(columns.shape[1]), 2):
        sizes, rest, *_ = np.linalg.lstsq(columns[:, pair], left)
        if np.all(sizes > 0.0):
            found.append((float(left @ left - rest[0]), pair, sizes))
    gone, pair, sizes = max(found, key=lambda f: f[0])
    return pair, sizes, gone


@pytest.mark.parametrize("seed", range(5))
def test_the_best_two_steps_are_those_of_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    does = 1.0 + 0.3 * rng.standard_normal(200)
    after = np.arange(200)[:, None] >= np.sort(rng.choice(np.arange(5, 195), 20, replace=False))
    columns = does[:, None] * after
    left = columns @ (rng.random(20) * (rng.random(20) < 0.3)) + 0.3 * rng.standard_normal(200)
    steps = _best_two(columns.T @ columns, columns.T @ left)
    pair, sizes, gone = best_of_all_pairs(columns, left)
    assert steps is not None
    assert steps.at == pair
    assert steps.sizes == pytest.approx(sizes, rel=1e-5)
    assert steps.taken == pytest.approx(gone, rel=1e-6)


def test_where_no_two_go_one_way_there_are_none() -> None:
    columns = np.tril(np.ones((30, 4)))
    assert _best_two(columns.T @ columns, columns.T @ -np.ones(30)) is None
    assert _best_two(np.zeros((4, 4)), np.zeros(4)) is None
