"""The last gate: a pure function, and nothing gets past it."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.config import Limits, load_joint
from cablecomp.control.command import Command
from cablecomp.control.gate import (
    MUST_STOP,
    NOT_FINITE,
    POSITION_LIMITED,
    RATE_LIMITED,
    STALE,
    GateLimits,
    SafeCommand,
    first_command,
    gate,
)
from cablecomp.control.motors import control_for
from cablecomp.errors import InputError
from cablecomp.signals import ANY_WIRE, Grid, Wire

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
    assert abs(safe.motor_position_rad - last) <= 25.0 * PERIOD + 1e-12
    far = abs(safe.motor_position_rad - motor)
    if not safe.flags & POSITION_LIMITED:
        assert far <= max(0.4, abs(last - motor)) + 1e-9
    if not safe.flags & (POSITION_LIMITED | RATE_LIMITED):
        assert far <= 0.4 + 1e-9


WIRES = st.sampled_from(
    [
        ANY_WIRE,
        # 16 and 12 bits over +-12.5 rad, +-50 rad/s, +-18 Nm
        Wire(
            Grid(-12.5, 25 / 65535, -12.5, 12.5),
            Grid(-50, 100 / 4095, -50, 50),
            Grid(-18, 36 / 4095, -18, 18),
        ),
        # coarser than a cycle's reach in position and torque
        Wire(Grid(0.013, 0.04, -4.0, 4.0), Grid(0.0, 3.0, -30.0, 30.0), Grid(0.0, 0.7, -2.1, 2.1)),
        Wire(torque=Grid(0.0, 1e-3, -1.0, 1.0)),
    ]
)


@given(WIRES, st.lists(st.tuples(ANY, ANY, ANY, ANY), max_size=60))
def test_what_leaves_the_gate_is_on_the_wire_and_within_the_limits_there(
    wire: Wire, asked: list[tuple[float, float, float, float]]
) -> None:
    """Over any stretch of cycles position and torque have gone no further than rate times time, and one step
    of the wire where a step is more than a cycle's reach.
    """
    limits = GateLimits.of(Limits(motor_position_min_rad=-3.0, motor_position_max_rad=3.0), wire)
    limits = replace(limits, position_rate_rad_s=25.0, torque_rate_Nm_s=400.0, torque_max_Nm=1.5)
    last = first_command(0.2, limits)
    sent = [last]
    for q, v, tau, motor in asked:
        safe = gate(Command(q, v, tau), last, motor, 0.0, PERIOD, limits)
        if safe.flags & MUST_STOP:
            continue
        last = safe
        sent.append(safe)
    for safe in sent:
        for value, grid in zip(safe[:3], wire, strict=True):
            if grid.step > 0.0:
                n = (value - grid.origin) / grid.step
                assert abs(n - round(n)) < 1e-6
            assert grid.low - 1e-9 <= value <= grid.high + 1e-9
        assert abs(safe.motor_position_rad) <= 3.0 + 1e-6
        assert abs(safe.motor_velocity_rad_s) <= 40.0 + 1e-6
        assert abs(safe.motor_torque_Nm) <= 1.5 + 1e-6
    for place, rate, grid in ((0, 25.0, wire.position), (2, 400.0, wire.torque)):
        coarse = grid.step if grid.step > rate * PERIOD else 0.0
        for a, b in combinations(range(len(sent)), 2):
            gone = abs(sent[b][place] - sent[a][place])
            assert gone <= rate * PERIOD * (b - a) + coarse + 1e-6


def test_a_wire_coarser_than_a_cycle_s_reach_is_still_followed_at_the_full_rate() -> None:
    wire = Wire(Grid(0.0, 0.04, -4.0, 4.0))
    limits = replace(GateLimits.of(Limits(), wire), position_rate_rad_s=25.0)
    last = first_command(0.0, limits)
    for _ in range(64):
        last = gate(Command(3.0, 0.0, 0.0), last, last[0], 0.0, PERIOD, replace(limits, lead_max_rad=4.0))
    assert last.motor_position_rad == pytest.approx(25.0 * 64 * PERIOD, abs=0.04)


def test_the_first_command_is_where_the_motor_is_and_asks_for_nothing() -> None:
    assert first_command(0.3, LIMITS) == SafeCommand(0.3, 0.0, 0.0, 0)
    for outside in (3.1, -3.1, nan, inf):
        with pytest.raises(InputError, match=r"stands at .*, outside of -3 … 3 rad"):
            first_command(outside, LIMITS)


def test_a_wire_that_cannot_carry_what_the_limits_allow_is_refused() -> None:
    with pytest.raises(InputError, match="carries no torque"):
        replace(LIMITS, wire=Wire(torque=Grid(5.0, 10.0, -15.0, 15.0)))


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


@pytest.mark.parametrize("name", ["capstan-arm", "wrist-capstan", "snow-closed-rig"])
def test_no_speed_is_plausible_that_no_target_ever_has(name: str) -> None:
    joint = load_joint(Path(__file__).parents[2] / f"configs/joints/{name}.toml")
    rate = GateLimits.of(joint.limits).position_rate_rad_s
    assert rate < control_for(joint).health.motor_rate_rad_s <= 2.0 * rate
