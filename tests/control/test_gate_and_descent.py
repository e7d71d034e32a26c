"""The last gate and the descent on old data: pure functions, and nothing gets past them."""

from __future__ import annotations

from itertools import groupby, pairwise
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.config import Limits
from cablecomp.control.command import Command
from cablecomp.control.degrade import (
    NORMAL,
    DegradeState,
    DegradeTimes,
    Phase,
    checked_times,
    degrade,
    feed_of,
)
from cablecomp.control.gate import (
    FAR_FROM_MOTOR,
    MUST_STOP,
    NOT_FINITE,
    POSITION_LIMITED,
    STALE,
    GateLimits,
    SafeCommand,
    gate,
)
from cablecomp.errors import InputError

LIMITS = GateLimits(-3.0, 3.0, 20.0, 1.5, 25.0, 400.0, 0.4, 0.05)
PERIOD = 1e-3
ANY = st.floats(allow_nan=True, allow_infinity=True)
REST = st.floats(-3.0, 3.0)


@given(ANY, ANY, ANY, REST, st.floats(-1.5, 1.5), ANY, st.floats(0.0, 1.0))
def test_nothing_outside_of_the_limits_passes(
    q: float, v: float, tau: float, last: float, last_tau: float, motor: float, age: float
) -> None:
    before = SafeCommand(last, 0.0, last_tau, 0)
    safe = gate(Command(q, v, tau), before, motor, age, PERIOD, LIMITS)
    assert -3.0 <= safe.motor_position_rad <= 3.0
    assert abs(safe.motor_velocity_rad_s) <= 20.0
    assert abs(safe.motor_torque_Nm) <= 1.5
    if safe.flags & MUST_STOP:
        assert safe[:3] == (last, 0.0, 0.0)
        return
    assert abs(safe.motor_torque_Nm - last_tau) <= 400.0 * PERIOD + 1e-12
    if not safe.flags & POSITION_LIMITED:
        assert abs(safe.motor_position_rad - motor) <= 0.4 + 1e-9
    if not safe.flags & FAR_FROM_MOTOR:
        assert abs(safe.motor_position_rad - last) <= 25.0 * PERIOD + 1e-12


@given(st.floats(-0.3, 0.3), st.floats(-20.0, 20.0), st.floats(-1.4, 1.4))
def test_what_is_within_the_limits_passes_unchanged(q: float, v: float, tau: float) -> None:
    before = SafeCommand(q, v, tau, 0)
    assert gate(Command(q, v, tau), before, 0.0, 0.0, PERIOD, LIMITS) == SafeCommand(q, v, tau, 0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_what_is_not_finite_repeats_the_last_position_without_force(bad: float) -> None:
    before = SafeCommand(0.1, 1.0, 0.5, 0)
    for command in (Command(bad, 0.0, 0.0), Command(0.0, bad, 0.0), Command(0.0, 0.0, bad)):
        assert gate(command, before, 0.1, 0.0, PERIOD, LIMITS) == SafeCommand(0.1, 0.0, 0.0, NOT_FINITE)


def test_a_stale_motor_position_stops() -> None:
    safe = gate(Command(0.0, 0.0, 0.0), SafeCommand(0.0, 0.0, 0.0, 0), 0.0, 0.06, PERIOD, LIMITS)
    assert safe.flags == STALE


def test_the_joint_s_own_limits_are_taken_over() -> None:
    limits = Limits(motor_position_min_rad=-1.0, motor_position_max_rad=2.0, motor_torque_max_Nm=0.5)
    assert GateLimits.of(limits, lead_max_rad=0.1) == GateLimits(
        -1.0, 2.0, torque_max_Nm=0.5, lead_max_rad=0.1
    )
    with pytest.raises(InputError, match="position_min_rad"):
        GateLimits(1.0, -1.0)


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


def test_times_out_of_order_are_refused() -> None:
    with pytest.raises(InputError, match="fresh <= hold < fade <= stop"):
        checked_times(TIMES._replace(fade_s=0.3))
    assert checked_times(TIMES) == TIMES
