"""The derivative of a fitting problem by differences: whose recordings are run for it, and what a step tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_problem import ANGLE, SIGMA, SPREAD, problem, three_recordings
from turning import JOINT

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.limits import STEP
from cablecomp.estimation.parameter import of_drive, own_of
from cablecomp.estimation.problem import Problem, Weighing


@pytest.fixture(scope="module")
def three() -> tuple[Evidence, ...]:
    return three_recordings()


def test_what_one_session_alone_owns_is_differenced_on_its_recordings_alone(
    three: tuple[Evidence, ...],
) -> None:
    """The derivative by a session's own pretension is that of running every recording again."""
    free = tuple(
        q for p in of_drive(JOINT) for q in (own_of(p, ("a", "b")) if p.name == "pretension_N" else (p,))
    )
    p = Problem(JOINT, free, three, Weighing({ANGLE: SIGMA}, {ANGLE: SPREAD}))
    x, J = p.start, p.jacobian(p.start)
    for k in range(len(free)):
        moved = x.copy()
        moved[k] += STEP
        np.testing.assert_allclose(J[:, k], (p.residual(moved) - p.residual(x)) / STEP, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("sides", [(STEP,), (STEP, -STEP)])
def test_a_step_to_where_the_drive_cannot_follow_tells_no_slope(
    three: tuple[Evidence, ...], monkeypatch: pytest.MonkeyPatch, sides: tuple[float, ...]
) -> None:
    """One unsolvable sample beside the fit made a value known to a millionth: the other side tells the slope, or the
    prior alone."""
    p = problem(three)
    x, k = p.start, 1
    plain, run = p.jacobian(x), Problem.misfits
    moved = x.copy()
    moved[k] -= STEP
    backward = (p.residual(moved) - p.residual(x)) / -STEP

    def refusing(self: Problem, at: Any, *args: Any) -> Any:
        if any(abs(at[k] - x[k] - side) < 1e-9 for side in sides):
            raise InputError("unsolvable")
        return run(self, at, *args)

    monkeypatch.setattr(Problem, "misfits", refusing)
    J = p.jacobian(x)
    if len(sides) == 1:
        np.testing.assert_allclose(J[:, k], backward)
    else:
        assert not J[: len(J) - len(x), k].any()
        np.testing.assert_allclose(J[len(J) - len(x) :, k], plain[len(J) - len(x) :, k], atol=1e-9)
    others = [j for j in range(len(x)) if j != k]
    np.testing.assert_allclose(J[:, others], plain[:, others])
