"""What comes and goes again and again: by inner products over short stretches of time."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.diagnosis.explain.cycles import Cycle, Products, gains, likeliest, there

ENDS_S = np.linspace(0.0, 30.0, 121)
MIDDLE_S = 0.5 * (ENDS_S[1:] + ENDS_S[:-1])


def products(rows: np.ndarray, left: np.ndarray) -> Products:
    """Of rows (all samples) x (cosine and sine) x (stretches)."""
    flat = rows.reshape(len(rows), -1)
    count = rows.shape[2]
    return Products((flat.T @ flat).reshape(2, count, 2, count), (flat.T @ left).reshape(2, count), ENDS_S)


def by_stretches(cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Rows of which each shows the stretch it lies in."""
    own = np.repeat(np.eye(len(MIDDLE_S)), len(cosine) // len(MIDDLE_S), axis=0)
    return np.stack([cosine[:, None] * own, sine[:, None] * own], axis=1)


def test_it_is_there_for_its_share_of_every_stretch() -> None:
    cycle = Cycle(7.0, 3.1, 0.4)
    fine = np.linspace(ENDS_S[0], ENDS_S[-1], 1200001)[:-1]
    held = np.mod(fine - cycle.start_s, cycle.period_s) < cycle.held * cycle.period_s
    expected = held.reshape(len(MIDDLE_S), -1).mean(axis=1)
    assert there(cycle, ENDS_S) == pytest.approx(expected, abs=1e-3)
    assert there(cycle.turned, ENDS_S) == pytest.approx(1.0 - expected, abs=1e-3)


def test_what_a_cycle_takes_off_is_that_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    rows = by_stretches(*rng.standard_normal((2, 1200)))
    left = rng.standard_normal(1200)
    for cycle in (Cycle(7.0, 3.1, 0.4), Cycle(50.0, 12.0, 0.5)):
        courses = np.stack([np.ones(len(MIDDLE_S)), there(cycle, ENDS_S)])
        A = np.einsum("rak,ik->ria", rows, courses).reshape(1200, 4)
        pairs, rest, *_ = np.linalg.lstsq(A, left)
        gone, found = gains(products(rows, left), [cycle])
        assert gone[0] == pytest.approx(0.5 * (left @ left - rest[0]), rel=1e-6)
        assert found[0] == pytest.approx(pairs, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize(
    "cycle", [Cycle(6.3, 2.0, 0.55), Cycle(90.0, 11.3, 0.5)], ids=["again and again", "once"]
)
def test_a_cycle_is_found_in_noise(cycle: Cycle) -> None:
    rng = np.random.default_rng(5)
    angle = 0.8 * np.sin(1.1 * np.linspace(0.0, 30.0, 1200)) + 0.3 * np.sin(
        2.3 * np.linspace(0.0, 30.0, 1200)
    )
    rows = by_stretches(np.cos(angle), np.sin(angle))
    course = 0.3 + 0.7 * there(cycle, ENDS_S)
    left = np.einsum("rak,a,k->r", rows, [0.6, 0.8], course) + 0.2 * rng.standard_normal(1200)
    found, pairs = likeliest(products(rows, left))
    assert there(found, ENDS_S) == pytest.approx(there(cycle, ENDS_S), abs=0.35)
    assert np.mean(np.abs(there(found, ENDS_S) - there(cycle, ENDS_S))) < 0.02
    assert pairs == pytest.approx([0.18, 0.24, 0.42, 0.56], abs=0.1)
