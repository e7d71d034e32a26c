"""The descent on old data: pure, and a stop is never left."""

from __future__ import annotations

from itertools import groupby, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.control.degrade import (
    NORMAL,
    DegradeState,
    DegradeTimes,
    Phase,
    degrade,
    feed_of,
)

PERIOD = 1e-3
TIMES = DegradeTimes(0.004, 0.01, 0.1, 0.2, 0.1, 0.05)


def descend(ages: list[float], state: DegradeState = NORMAL) -> list[DegradeState]:
    found = []
    for age in ages:
        state = degrade(state, PERIOD, 0.0, age, TIMES)
        found.append(state)
    return found


def test_data_that_stop_are_held_then_faded_then_the_joint_stops() -> None:
    states = descend([PERIOD * k for k in range(300)])
    phases = [s.phase for s in states]
    order = [phase for phase, _ in groupby(phases)]
    assert order == [Phase.NORMAL, Phase.HELD, Phase.FADING, Phase.STOPPED]
    assert phases.count(Phase.NORMAL) == 5
    assert phases.index(Phase.FADING) == pytest.approx(11, abs=1)
    assert phases.index(Phase.STOPPED) == pytest.approx(200, abs=1)
    weights = [s.weight for s in states]
    assert all(a >= b for a, b in pairwise(weights))
    assert weights[9] == pytest.approx(1.0)
    assert weights[55] == pytest.approx(0.5, abs=0.01)
    assert weights[100] == pytest.approx(0.0, abs=1e-9)


def test_data_that_return_bring_the_feed_forward_back_without_a_step() -> None:
    down = descend([PERIOD * k for k in range(60)])
    up = descend([0.0] * 200, down[-1])
    weights = [down[-1].weight, *(s.weight for s in up)]
    assert max(abs(b - a) for a, b in pairwise(weights)) <= PERIOD / 0.1 + 1e-9
    assert up[0].phase is Phase.RECOVERING
    assert up[-1] == NORMAL


def test_data_that_keep_coming_but_keep_being_old_stop_the_joint_as_well() -> None:
    phases = [s.phase for s in descend([0.006] * 300)]
    assert phases[0] is Phase.HELD
    assert phases.index(Phase.STOPPED) == pytest.approx(195, abs=2)


def test_a_motor_that_is_not_heard_stops_the_joint_at_once() -> None:
    assert degrade(NORMAL, PERIOD, 0.051, 0.0, TIMES).phase is Phase.STOPPED


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=80))
def test_a_stop_is_never_left_and_the_weight_stays_a_share(ages: list[float]) -> None:
    stopped = False
    for state in descend(ages):
        assert 0.0 <= state.weight <= 1.0
        stopped = stopped or state.phase is Phase.STOPPED
        assert not stopped or state.phase is Phase.STOPPED
        assert feed_of(state).held == (state.phase in (Phase.HELD, Phase.FADING, Phase.STOPPED))


@pytest.mark.parametrize(
    ("motor_age_s", "load_age_s", "phase"),
    [
        (0.004, 0.004, Phase.NORMAL),
        (0.0, 0.0041, Phase.HELD),
        (0.01, 0.01, Phase.HELD),
        (0.0, 0.0101, Phase.FADING),
        (0.05, 0.0, Phase.FADING),
        (0.05, 0.1999, Phase.FADING),
        (0.0501, 0.0, Phase.STOPPED),
        (0.0, 0.2, Phase.STOPPED),
    ],
)
def test_every_age_belongs_to_the_phase_that_its_times_say(
    motor_age_s: float, load_age_s: float, phase: Phase
) -> None:
    """A time is the last of its phase; that of the stop the first of the stop."""
    assert degrade(NORMAL, PERIOD, motor_age_s, load_age_s, TIMES).phase is phase


def test_recovery_ends_where_the_whole_feed_forward_is_back() -> None:
    half = DegradeState(Phase.RECOVERING, 0.5, 0.02)
    assert degrade(half, 0.05, 0.0, 0.0, TIMES) == NORMAL == DegradeState(Phase.NORMAL, 1.0, 0.0)
    assert degrade(half, 0.025, 0.0, 0.001, TIMES) == DegradeState(Phase.RECOVERING, 0.75, 0.001)
    assert degrade(half, 0.05, 0.0, 0.006, TIMES) == DegradeState(Phase.HELD, 0.5, 0.006)


def test_phases_are_numbers_in_files() -> None:
    """`cycles.csv` holds them."""
    assert [phase.name for phase in map(Phase, range(5))] == [
        "NORMAL",
        "HELD",
        "FADING",
        "RECOVERING",
        "STOPPED",
    ]
    assert len(Phase) == 5
