"""The line under (stamp, logged): a sender's clock on the logger's, against clocks that were made up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from cablecomp.recording.clocks import clock_line


def logged(stamp_s: np.ndarray, rate: float, offset_s: float) -> np.ndarray:
    """Messages logged 2 ms late and more (exponential, mean 5 ms), every tenth of them by no more than that."""
    late = 0.002 + np.random.default_rng(4).exponential(0.005, len(stamp_s))
    late[::10] = 0.002
    return offset_s + rate * stamp_s + late


@pytest.mark.parametrize(
    ("span_s", "drift", "found"),
    [
        (60.0, 3e-4, 3e-4),
        (60.0, -3e-4, -3e-4),
        (10.1, 9e-3, 9e-3),
        (9.9, 9e-3, 0.0),  # too short to tell a drift
        (60.0, 1.1e-2, 0.0),  # no clock drifts so: it was set meanwhile
        (60.0, -1.1e-2, 0.0),
    ],
)
def test_a_drift_is_told_over_ten_seconds_and_up_to_one_percent(
    span_s: float, drift: float, found: float
) -> None:
    stamp = np.linspace(0.0, span_s, 2001)
    line = clock_line(stamp, logged(stamp, 1.0 + drift, 7.0))
    assert line.rate == pytest.approx(1.0 + found, abs=1e-9)
    if found == drift:
        assert line.logged(3.0) == pytest.approx(7.002 + 3.0 * (1.0 + drift), abs=1e-9)
        late = logged(stamp, 1.0 + drift, 7.0) - 7.002 - (1.0 + drift) * stamp
        assert line.delay_s == pytest.approx(np.median(late), abs=1e-9)


def test_the_line_is_that_of_the_linear_program() -> None:
    """Moon, Skelly, Towsley 1999: of all lines under the points the one that lies highest in their middle."""
    rng = np.random.default_rng(9)
    stamp = np.sort(rng.uniform(0.0, 40.0, 300))
    seen = logged(stamp, 0.9996, -3.0) + rng.exponential(0.01, len(stamp))
    line = clock_line(stamp, seen)
    under = np.stack([np.ones_like(stamp), stamp], axis=1)
    best = linprog([-1.0, -stamp.mean()], A_ub=under, b_ub=seen, bounds=[(None, None)] * 2).x
    assert (line.offset_s, line.rate) == pytest.approx(best, abs=1e-8)
