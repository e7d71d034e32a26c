"""A sparse law finds what was put into a residual, with honest errors, and nothing else."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from cablecomp.diagnosis.describe.law import MOST_TERMS, LawTerm, SparseLaw, equation, sparse_law
from cablecomp.diagnosis.describe.terms import Term
from cablecomp.diagnosis.folds import Layout, alternate_blocks
from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.diagnosis.locate.series import Series
from cablecomp.signal.smoothing import FloatArray

N = 3_000
SIGMA = 1e-5
START = np.zeros(1, dtype=np.int64)
WAVES = np.stack([np.sin(2.0 * np.pi * np.arange(N) * (61.0 + 17.0 * k) / N + k) for k in range(8)], axis=1)
"""Regressors that have nothing in common, quicker than a block is long."""
LIBRARY = [Term((f"w{k}",), "N·m", WAVES[:, k : k + 1]) for k in range(WAVES.shape[1])]


def layout() -> Layout:
    return alternate_blocks(START, N, np.sign(np.sin(2.0 * np.pi * np.arange(N) * 40.0 / N)))


def law_of(planted: FloatArray, library: list[Term] = LIBRARY, seed: int = 0) -> SparseLaw | None:
    """The law of what was planted under white noise."""
    rng = np.random.default_rng(seed)
    none = np.zeros(N)
    covariates = Covariates({"time": np.arange(float(N))}, none, none, START, 0.0)
    residual = planted + SIGMA * rng.standard_normal(N)
    return sparse_law(Series(residual, np.full(N, SIGMA), covariates), library, layout(), rng)


def test_what_was_planted_is_read_off_with_its_coefficients_and_its_share() -> None:
    planted = 3e-5 * WAVES[:, 1] - 2e-5 * WAVES[:, 4]
    found = law_of(planted)
    assert found is not None
    assert {t.symbol for t in found.terms} == {"1", "w1", "w4"}
    values = {t.symbol: t for t in found.terms}
    for symbol, exact in (("w1", 3e-5), ("w4", -2e-5)):
        assert abs(values[symbol].coefficient - exact) < 4.0 * values[symbol].sd
        assert values[symbol].unit == "rad/(N·m)"
    assert found.supported
    assert found.heldout_gain == pytest.approx(1.0 - SIGMA**2 / np.mean((planted**2) + SIGMA**2), abs=0.05)
    np.testing.assert_allclose(found.prediction, planted, atol=3e-6)


def test_coefficients_scatter_as_their_sd_says() -> None:
    z = []
    for seed in range(40):
        found = law_of(3e-5 * WAVES[:, 1], seed=seed)
        assert found is not None
        term = found.terms[1]
        z.append((term.coefficient - 3e-5) / term.sd)
    assert 0.75 < float(np.sqrt(np.mean(np.square(z)))) < 1.4  # of 40 values: 1 +- 0.11, sd from blocks


def test_a_term_that_later_ones_make_idle_is_dropped() -> None:
    own = np.sin(2.0 * np.pi * np.arange(N) * 53.0 / N)[:, None]
    both = Term(("both",), "N·m", WAVES[:, 1:2] + WAVES[:, 4:5] + own)
    found = law_of(3e-5 * WAVES[:, 1] + 3e-5 * WAVES[:, 4], [both, *LIBRARY])
    assert found is not None
    assert {t.symbol for t in found.terms} == {"1", "w1", "w4"}


def test_what_one_block_alone_shows_is_no_law() -> None:
    plan = layout()
    first = plan.block == plan.block[plan.training][0]
    burst = np.where(first, WAVES[:, 7], 0.0)
    assert law_of(20.0 * SIGMA * burst, [Term(("burst",), "", burst[:, None])]) is None
    assert law_of(np.zeros(N)) is None


def test_a_law_has_few_terms_the_largest_of_them() -> None:
    sizes = 1e-5 * np.array([9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0])
    found = law_of(WAVES @ sizes)
    assert found is not None
    chosen = [t.symbol for t in found.terms if t.symbol != "1"]
    assert chosen == [f"w{k}" for k in range(MOST_TERMS)]
    assert all(a.coefficient > b.coefficient for a, b in pairwise(found.terms[1:]))


def test_an_equation_leaves_out_a_constant_that_is_none() -> None:
    slope = LawTerm("M", 2e-3, 1e-5, "rad/(N·m)")
    assert equation((LawTerm("1", 1e-6, 1e-6, "rad"), slope)) == "residual = (0.002 ± 1e-05) rad/(N·m) M"
    assert equation((LawTerm("1", 1e-5, 1e-6, "rad"),)) == "residual = (1e-05 ± 1e-06) rad"
    assert equation((LawTerm("1", 0.0, 1e-6, "rad"),)) == "residual = 0"
