"""Bent valleys and false bottoms of a misfit, on misfits whose shape is known in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.fitting import Model, Problem, evaluate, sensitivities, solve
from cablecomp.diagnosis.starts import deepest
from cablecomp.diagnosis.valley import TWO_SIDED, walked
from cablecomp.identification.parameters import Parameter
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Shaped(Problem):
    """A problem whose weighted residual is a given function of its coordinates."""

    shape: Callable[[FloatArray], FloatArray] = np.asarray

    def joint(self, c: FloatArray, entries: Sequence[EffectEntry] = ()) -> Any:
        """The coordinates themselves."""
        return np.array(c)

    def residual(self, config: Any) -> FloatArray:
        """The given function."""
        return self.shape(config)

    def rough(self) -> Problem:
        """The same."""
        return self


def shaped(shape: Callable[[FloatArray], FloatArray], at: Sequence[float], sd: float) -> tuple[Shaped, Model]:
    """Such a problem, and the model at one place."""
    rows = len(shape(np.array(at)))
    own = tuple(Parameter(f"p{k}", 0.0, 1.0, False, sd, -1e3, 1e3) for k in range(len(at)))
    problem = Shaped(None, own, (), np.zeros(rows), np.ones(rows), (), 0.0, shape)  # type: ignore[arg-type]  # no joint
    z = np.array(at, dtype=np.float64)
    residual = evaluate(problem, (), z)
    assert residual is not None
    return problem, Model((), z, (), residual, sensitivities(problem, (), z, residual))


@pytest.mark.parametrize("bend", [0.0, 0.5, 2.0])
def test_a_walk_ends_where_the_misfit_of_a_bent_valley_has_risen(bend: float) -> None:
    """r = (a, 100 (b - bend a^2)): a stands for 1 sd of 1, b is free up to bend 1.96^2, whatever its curvature
    says."""
    problem, model = shaped(lambda z: np.array([z[0], 100.0 * (z[1] - bend * z[0] ** 2)]), [0.0, 0.0], np.inf)
    straight = np.diag([1.0, 1e-4])
    found = np.sqrt(np.diag(walked(problem, model, np.ones(2, dtype=np.bool_), straight)))
    assert found[0] == pytest.approx(1.0, rel=0.05)
    farthest = bend * TWO_SIDED**2
    assert found[1] * TWO_SIDED == pytest.approx(max(farthest, 0.01 * TWO_SIDED), rel=0.1)


def test_a_straight_valley_keeps_its_covariance() -> None:
    A = np.array([[2.0, 1.9, 0.0], [0.3, 1.0, 0.5], [0.0, 0.2, 3.0], [1.0, 1.0, 1.0]])
    problem, model = shaped(lambda z: A @ z, [0.0, 0.0, 0.0], np.inf)
    covariance = np.linalg.inv(A.T @ A)
    found = walked(problem, model, np.ones(4, dtype=np.bool_), covariance)
    assert found == pytest.approx(covariance, rel=0.02, abs=1e-6)


def test_the_deeper_of_two_valleys_is_found_from_the_shallow_one() -> None:
    """r = (5 (x^2 - 1), x - 1): a false bottom near x = -1, nothing left at x = 1."""
    problem, model = shaped(lambda z: np.array([5.0 * (z[0] ** 2 - 1.0), z[0] - 1.0]), [-1.0], 1.0)
    mask = np.ones(2, dtype=np.bool_)
    stuck = solve(problem, (), model.z, mask, iterations=30, renew=True)
    assert stuck is not None
    assert stuck.z[0] < -0.9
    assert deepest(problem, stuck, mask).z[0] == pytest.approx(1.0, abs=0.05)


def test_what_is_deepest_already_stays_as_it_is() -> None:
    problem, model = shaped(lambda z: np.array([z[0] - 0.3, 2.0 * z[1], 1.0]), [0.0, 0.0], 10.0)
    mask = np.ones(3, dtype=np.bool_)
    found = solve(problem, (), model.z, mask, iterations=30, renew=True)
    assert found is not None
    assert deepest(problem, found, mask) is found
