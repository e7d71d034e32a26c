"""When a rival is refuted: by a lead beyond chance that is no flaw of the law either."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.diagnosis.blocks import Layout, alternate_blocks
from cablecomp.diagnosis.fitting import Problem
from cablecomp.diagnosis.hypotheses import all_rows
from cablecomp.diagnosis.judge import compare
from cablecomp.diagnosis.rivals import APART, SURE, Candidate, lead

ROWS = 40_000


def ground(sigma: float) -> tuple[Problem, Layout]:
    """Rows of equal noise in blocks; nothing is simulated."""
    problem = Problem(None, (), (), np.zeros(ROWS), np.full(ROWS, sigma), (), sigma)  # type: ignore[arg-type]  # no joint
    direction = np.sign(np.sin(np.arange(ROWS) / 300.0))
    return problem, all_rows(alternate_blocks(np.array([0]), ROWS, direction))


@pytest.mark.parametrize(("share", "refuted"), [(0.3, False), (3.0, True)])
def test_a_lead_counts_only_from_a_share_of_the_noise_on(share: float, refuted: bool) -> None:
    """A rival that is worse by a steady wave of `share` times APART in mean square: plain in so many rows."""
    rng = np.random.default_rng(3)
    sigma = 2e-5
    problem, both = ground(sigma)
    best = sigma * rng.standard_normal(ROWS)
    wave = sigma * np.sqrt(2.0 * share * APART) * np.sin(np.arange(ROWS) / 40.0)
    rival = best + wave
    assert compare(rival, best, both, rng).z > SURE
    z = lead(problem, Candidate(best), Candidate(rival), both, rng)
    assert (z > SURE) == refuted


def test_who_trails_has_no_lead() -> None:
    rng = np.random.default_rng(4)
    problem, both = ground(1.0)
    good = rng.standard_normal(ROWS)
    poor = good + 0.5 * np.sin(np.arange(ROWS) / 40.0)
    assert lead(problem, Candidate(poor), Candidate(good), both, rng) < -SURE
    # where both were fitted to all rows, that decides
    assert lead(problem, Candidate(poor, good), Candidate(good, poor), both, rng) > SURE
    assert lead(problem, Candidate(poor, good), Candidate(good), both, rng) < -SURE
