"""Recordings' zeros: what follows the load is no chance, what was set anew says nothing of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.effects.catalogue import catalogue
from cablecomp.estimation.departures import departures, set_anew
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.limits import FAR
from cablecomp.estimation.parameter import of_drive, of_effect
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
    assert found.moved is None


def test_one_recording_a_session_departs_from_nothing(ten: Problem) -> None:
    two = ten.with_evidence((ten.evidence[0], ten.evidence[9]))
    assert departures(two, zeros(two, np.zeros(2))) is None


WITHIN = 2e-5
"""RMS of what is left within recordings [rad]."""


def apart_by(problem: Problem, apart: float, history: float = 0.0) -> frozenset[str]:
    """Which of two recordings of one session was set anew, where their zeros lie so far apart [rad] and an unknown
    history moves them so far."""
    rng = np.random.default_rng(1)
    left = [WITHIN * rng.standard_normal(len(e.rows)) for e in problem.evidence]
    return set_anew(problem, ANGLE, zeros(problem, np.array([0.0, apart])), left, history)


def test_of_two_recordings_the_later_was_set_anew_where_nothing_within_moves_it_so(ten: Problem) -> None:
    one = ten.evidence[0]
    pair = ten.with_evidence((one, replace(one, name="1")))
    for way in (1.0, -1.0):
        assert apart_by(pair, way * 2.0 * FAR * WITHIN) == {"1"}
        assert not apart_by(pair, way * 0.5 * FAR * WITHIN)
        assert not apart_by(pair, way * 2.0 * FAR * WITHIN, FAR * WITHIN)


def test_of_two_recordings_at_two_steady_loads_the_drive_may_yield(ten: Problem) -> None:
    assert not apart_by(ten.with_evidence(ten.evidence[:2]), 100.0 * WITHIN)


def test_beside_an_event_of_the_model_nothing_more_was_set_anew(ten: Problem) -> None:
    one = ten.evidence[0]
    slip = next(e for e in catalogue().values() if e.id == "clamp_slip")
    instant = of_effect(slip, {"slip_m": 1e-4, "time_s": 5.0}, JOINT)
    pair = Problem(JOINT, instant, (one, replace(one, name="1")), ten.weighing)
    assert not apart_by(pair, 100.0 * WITHIN)
