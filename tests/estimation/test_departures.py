"""Recordings' zeros: what follows the load is no chance, what was set anew says nothing of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.estimation.departures import departures
from cablecomp.estimation.evidence import Evidence, gather
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray

ANGLE = "joint_position_rad"
SCATTER = 2e-5 * np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
"""Unrelated to the loads, RMS 2e-5 rad."""


@pytest.fixture(scope="module")
def ten() -> Problem:
    """Ten recordings of two sessions; the k-th at a steady load of 0.1 k N m."""
    one = gather(JOINT, "one", recorded(), "a", fine_rows=400, judged_rows=60)
    parts = tuple(loaded(one, 0.1 * k, f"{k}", "ab"[k // 5]) for k in range(10))
    return Problem(JOINT, of_drive(JOINT), parts, Weighing({ANGLE: 2e-5}, {ANGLE: 1e-4}))


def loaded(e: Evidence, load: float, name: str, session: str) -> Evidence:
    columns = {**e.columns, "joint_torque_Nm": np.full(len(e.columns["time_s"]), load)}
    return replace(e, name=name, session=session, columns=columns)


def zeros(problem: Problem, departed: FloatArray) -> dict[str, FloatArray]:
    """Zeros of the recordings and of their sessions [rad], which lie elsewhere."""
    session = {"a": 1e-2, "b": -3e-2}
    found = {name: np.array([zero]) for name, zero in session.items()}
    for e, d in zip(problem.evidence, departed, strict=True):
        found[e.name] = np.array([session[e.session] + d])
    return found


def test_what_follows_the_load_is_no_chance(ten: Problem) -> None:
    by_load = 1e-3 * np.linspace(-0.5, 0.5, 10)
    found = departures(ten, zeros(ten, by_load + SCATTER))
    assert found is not None
    assert found.sd == pytest.approx(2e-5, rel=0.3)
    assert not found.moved


def test_chance_alone_is_its_rms(ten: Problem) -> None:
    found = departures(ten, zeros(ten, SCATTER))
    assert found is not None
    assert found.sd == pytest.approx(2e-5, rel=0.3)
    assert not found.moved


def test_a_zero_set_anew_is_found_and_says_nothing_of_the_others(ten: Problem) -> None:
    departed = SCATTER + 1e-3 * np.linspace(-0.5, 0.5, 10)
    departed[3] += 2e-3
    found = departures(ten, zeros(ten, departed))
    assert found is not None
    assert found.moved == {"3"}
    assert found.sd == pytest.approx(2e-5, rel=0.4)


def test_few_recordings_tell_neither(ten: Problem) -> None:
    few = ten.with_evidence(ten.evidence[:5])
    departed = 1e-3 * np.linspace(-0.5, 0.5, 5)
    found = departures(few, zeros(few, departed))
    assert found is not None
    assert found.sd == pytest.approx(float(np.sqrt(np.mean(departed**2))))
    assert not found.moved


def test_one_recording_a_session_departs_from_nothing(ten: Problem) -> None:
    two = ten.with_evidence((ten.evidence[0], ten.evidence[9]))
    assert departures(two, zeros(two, np.zeros(2))) is None
