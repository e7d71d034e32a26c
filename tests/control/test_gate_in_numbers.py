"""The last gate in numbers worked out by hand: every limit where it begins, every flag alone, every step of a wire."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from math import floor, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.config import Limits
from cablecomp.control.command import Command
from cablecomp.control.gate import (
    FAR_FROM_MOTOR,
    MUST_STOP,
    NOT_FINITE,
    POSITION_LIMITED,
    RATE_LIMITED,
    STALE,
    TORQUE_LIMITED,
    VELOCITY_LIMITED,
    GateLimits,
    SafeCommand,
    first_command,
    gate,
    gate_names,
)
from cablecomp.errors import InputError
from cablecomp.signals import Grid, Wire

LIMITS = GateLimits(-3.0, 3.0, 20.0, 1.5, 25.0, 400.0, 0.4, 0.05)
T = 1e-3
FREE = GateLimits(-3.0, 3.0, position_rate_rad_s=1e6, lead_max_rad=100.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("asked", "before", "motor", "passed", "flags"),
    [
        ((0.3, 0.0, 0.0), (0.19, 0.0, 0.0), -0.2, (0.2, 0.0, 0.0), FAR_FROM_MOTOR),
        ((3.2, 0.0, 0.0), (2.99, 0.0, 0.0), 3.0, (3.0, 0.0, 0.0), POSITION_LIMITED),
        ((0.0, 20.1, 0.0), (0.0, 0.0, 0.0), 0.0, (0.0, 20.0, 0.0), VELOCITY_LIMITED),
        ((0.0, 0.0, 1.6), (0.0, 0.0, 1.4), 0.0, (0.0, 0.0, 1.5), TORQUE_LIMITED),
        ((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, (0.025, 0.0, 0.0), RATE_LIMITED),
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.25), 0.0, (0.0, 0.0, 0.65), RATE_LIMITED),
        ((1.0, 30.0, 9.0), (0.0, 0.0, 0.0), 0.0, (0.025, 20.0, 0.4), 4 | 8 | 16 | 64),
        # on the limit, and not beyond it
        ((0.4, 20.0, 1.5), (0.4, 0.0, 1.5), 0.0, (0.4, 20.0, 1.5), 0),
        ((3.0, 0.0, 0.0), (3.0, 0.0, 0.0), 2.9, (3.0, 0.0, 0.0), 0),
        ((0.025, 0.0, 0.4), (0.0, 0.0, 0.0), 0.0, (0.025, 0.0, 0.4), 0),
    ],
)
def test_each_limit_cuts_to_itself_and_says_so(
    asked: tuple[float, ...],
    before: tuple[float, ...],
    motor: float,
    passed: tuple[float, ...],
    flags: int,
    sign: float,
) -> None:
    command = Command(*(sign * x for x in asked))
    last = SafeCommand(*(sign * x for x in before), 0)
    safe = gate(command, last, sign * motor, 0.0, T, LIMITS)
    assert safe[:3] == pytest.approx([sign * x for x in passed], abs=1e-15)
    assert safe.flags == flags
    assert (safe.spare_rad, safe.spare_Nm) == (0.0, 0.0)


@pytest.mark.parametrize(("age_s", "flags"), [(0.0, 0), (0.05, 0), (0.0501, STALE), (nan, STALE)])
def test_a_motor_position_may_be_as_old_as_its_limit(age_s: float, flags: int) -> None:
    before = SafeCommand(0.2, 1.0, 0.3, RATE_LIMITED, 0.01, 0.02)
    safe = gate(Command(0.2, 2.0, 0.3), before, 0.2, age_s, T, LIMITS)
    stands = SafeCommand(0.2, 0.0, 0.0, STALE, 0.01, 0.02)
    assert safe == (stands if flags else SafeCommand(0.2, 2.0, 0.3, 0))


def test_what_is_not_finite_is_named_before_what_is_old() -> None:
    before = SafeCommand(0.2, 1.0, 0.3, 0)
    for motor in (nan, 0.2):
        command = Command(0.1 if motor != motor else nan, 0.0, 0.0)
        assert gate(command, before, motor, 1.0, T, LIMITS) == SafeCommand(0.2, 0.0, 0.0, NOT_FINITE)


def test_every_flag_has_a_bit_and_a_word_of_its_own() -> None:
    flags = (
        NOT_FINITE, POSITION_LIMITED, VELOCITY_LIMITED, TORQUE_LIMITED, RATE_LIMITED, STALE, FAR_FROM_MOTOR
    )  # fmt: skip
    assert [flag.bit_length() - 1 for flag in flags] == list(range(7))
    assert all(flag.bit_count() == 1 for flag in flags)
    words = [word for flag in flags for word in gate_names(flag)]
    assert len(words) == len(set(words)) == 7
    assert gate_names(sum(flags)) == tuple(words)
    assert gate_names(0) == ()
    assert MUST_STOP == NOT_FINITE | STALE


GRIDS = st.builds(
    lambda origin, step, reach: Grid(origin, step, -reach, reach),
    st.floats(-0.5, 0.5),
    st.floats(0.03, 0.9),
    st.floats(1.0, 4.0),
)


def values(grid: Grid, low: float, high: float) -> list[float]:
    """All that a message can carry within limits."""
    low, high = max(low, grid.low), min(high, grid.high)
    count = floor((high - low) / grid.step) + 3
    first = floor((low - grid.origin) / grid.step)
    found = [grid.origin + grid.step * (first + k) for k in range(count)]
    return [x for x in found if low - 1e-6 * grid.step <= x <= high + 1e-6 * grid.step]


@given(GRIDS, GRIDS, GRIDS, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_what_passes_is_the_nearest_that_the_message_can_carry(
    position: Grid, velocity: Grid, torque: Grid, q: float, v: float, tau: float
) -> None:
    limits = replace(FREE, wire=Wire(position, velocity, torque), velocity_max_rad_s=2.2, torque_max_Nm=1.7)
    start = first_command(0.0, limits)
    for value, grid in zip(start[:3], limits.wire, strict=True):
        assert abs(value) == pytest.approx(min(map(abs, values(grid, -100.0, 100.0))), abs=1e-9)
    safe = gate(Command(q, v, tau), start, 0.0, 0.0, T, limits)
    # at a limit of position, within the message's step, no velocity leads on
    low = 0.0 if safe.motor_position_rad <= -3.0 + position.step else -2.2
    high = 0.0 if safe.motor_position_rad >= 3.0 - position.step else 2.2
    most = ((-3.0, 3.0), (low, high), (-1.7, 1.7))
    for value, asked, grid, (least, largest) in zip(safe[:3], (q, v, tau), limits.wire, most, strict=True):
        wanted = min(max(asked, least), largest)
        nearest = min((abs(x - wanted) for x in values(grid, least, largest)), default=abs(wanted))
        assert abs(value - wanted) == pytest.approx(nearest, abs=1e-5)


def test_after_a_command_that_never_went_out_there_is_none() -> None:
    safe = gate(Command(0.1, 0.0, 0.0), SafeCommand(nan, 0.0, 0.0, 0), 0.1, 0.0, T, LIMITS)
    assert safe.flags == NOT_FINITE


def test_what_is_finite_is_cut_however_large_it_is() -> None:
    huge = 1e200
    last = SafeCommand(0.0, 0.0, 0.0, 0)
    safe = gate(Command(huge, huge, huge), last, huge, 0.0, T, LIMITS)
    assert safe[:3] == (0.025, 0.0, 0.4), "a motor beyond its limit is not led on"
    assert safe.flags == POSITION_LIMITED | RATE_LIMITED | VELOCITY_LIMITED | TORQUE_LIMITED


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("step", "moved"), [(0.0, 0.025), (0.005, 0.025), (0.04, 0.0)])
def test_a_rate_that_cuts_says_so_on_any_wire(step: float, moved: float, sign: float) -> None:
    limits = replace(FREE, position_rate_rad_s=25.0, wire=Wire(Grid(0.0, step, -4.0, 4.0)))
    last = SafeCommand(0.0, 0.0, 0.0, 0)
    for asked, flags in ((0.02, 0), (0.03, RATE_LIMITED)):
        safe = gate(Command(sign * asked, 0.0, 0.0), last, 0.0, 0.0, T, limits)
        assert safe.flags == flags
    assert safe.motor_position_rad == pytest.approx(sign * moved)


def test_a_tie_between_two_steps_goes_down() -> None:
    """As where the wire itself rounds: 0.5 of a step above is the lower one."""
    limits = replace(FREE, wire=Wire(Grid(0.0, 0.5, -4.0, 4.0)))
    for asked, passed in ((0.25, 0.0), (0.2501, 0.5), (-0.25, -0.5), (-0.2499, 0.0), (0.75, 0.5)):
        assert gate(Command(asked, 0.0, 0.0), SafeCommand(0, 0, 0, 0), 0.0, 0.0, T, limits)[0] == passed


def test_on_a_coarse_wire_the_reach_is_saved_up_to_one_step() -> None:
    """25 rad/s, 1 ms: 0.025 rad a cycle, 0.04 rad a step: after k cycles as many steps as 0.025 k holds."""
    limits = replace(FREE, position_rate_rad_s=25.0, wire=Wire(Grid(0.0, 0.04, -4.0, 4.0)))
    last = SafeCommand(0.0, 0.0, 0.0, 0)
    for k in range(1, 40):
        last = gate(Command(2.0, 0.0, 0.0), last, 0.0, 0.0, T, limits)
        assert last.motor_position_rad == pytest.approx(0.04 * floor(0.625 * k + 1e-6))
        assert last.spare_rad == pytest.approx(0.025 * k - last.motor_position_rad)
        assert last.flags & RATE_LIMITED
    for _ in range(20):  # at rest
        last = gate(Command(last.motor_position_rad, 0.0, 0.0), last, 0.0, 0.0, T, limits)
    assert last.spare_rad == pytest.approx(0.04)
    gone = gate(Command(-2.0, 0.0, 0.0), last, 0.0, 0.0, T, limits)
    assert gone.motor_position_rad == pytest.approx(last.motor_position_rad - 0.04)
    assert gone.spare_rad == pytest.approx(0.025)


def test_nothing_is_saved_up_where_the_wire_is_fine() -> None:
    limits = replace(FREE, position_rate_rad_s=25.0, wire=Wire(Grid(0.0, 0.01, -4.0, 4.0)))
    last = SafeCommand(0.0, 0.0, 0.0, 0)
    for _ in range(5):
        last = gate(Command(0.0, 0.0, 0.0), last, 0.0, 0.0, T, limits)
        assert last.spare_rad == 0.0
    last = gate(Command(2.0, 0.0, 0.0), last, 0.0, 0.0, T, limits)
    assert last.motor_position_rad == pytest.approx(0.02)
    even = replace(FREE, position_rate_rad_s=32.0, wire=Wire(Grid(0.0, 1 / 32, -4.0, 4.0)))
    assert gate(Command(0.0, 0.0, 0.0), SafeCommand(0, 0, 0, 0), 0.0, 0.0, 1 / 1024, even).spare_rad == 0.0


def test_the_narrower_of_joint_and_wire_holds() -> None:
    joint = Limits(motor_position_min_rad=-1.0, motor_position_max_rad=2.0, motor_torque_max_Nm=0.5,
                   motor_velocity_max_rad_s=8.0)  # fmt: skip
    wide = Wire(*(Grid(0.0, 0.0, -9.0, 9.0) for _ in range(3)))
    found = GateLimits.of(joint, wide)
    assert found == GateLimits(-1.0, 2.0, 8.0, 0.5, 8.0, wire=wide)
    for low, high in ((-0.25, 0.4), (-0.4, 0.25)):
        narrow = Wire(*(Grid(0.0, 0.0, low, high) for _ in range(3)))
        found = GateLimits.of(joint, narrow)
        assert (found.position_min_rad, found.position_max_rad) == (low, high)
        assert found.velocity_max_rad_s == found.torque_max_Nm == 0.25
        assert found.position_rate_rad_s == 8.0


@pytest.mark.parametrize("bad", [0.0, -1.0, nan])
@pytest.mark.parametrize(
    "name",
    [
        *("velocity_max_rad_s", "torque_max_Nm", "position_rate_rad_s", "torque_rate_Nm_s"),
        *("lead_max_rad", "age_s"),
    ],
)
def test_a_limit_that_is_none_is_refused_by_name(name: str, bad: float) -> None:
    with pytest.raises(InputError, match=name):
        replace(LIMITS, **{name: bad})


@pytest.mark.parametrize(("low", "high"), [(1.0, 1.0), (1.0, -1.0), (nan, 1.0)])
def test_an_empty_range_is_refused(low: float, high: float) -> None:
    with pytest.raises(InputError, match="position_min_rad must lie below"):
        GateLimits(low, high)


def test_a_wire_that_cannot_say_zero_or_nearly_so_is_refused() -> None:
    """What it carries has to lie within the limits: 5 is beyond 1.5 Nm and 4 rad/s, and within 6 rad/s."""
    five = Grid(5.0, 20.0, -45.0, 45.0)
    with pytest.raises(InputError, match="carries no torque within"):
        replace(LIMITS, wire=Wire(torque=five))
    with pytest.raises(InputError, match="carries no velocity"):
        replace(LIMITS, velocity_max_rad_s=4.0, wire=Wire(velocity=five))
    assert replace(LIMITS, velocity_max_rad_s=6.0, wire=Wire(velocity=five)).wire.velocity is five
    below, beyond = Grid(-1.0, 20.0, -45.0, 45.0), Grid(0.0, 0.0, 50.0, 60.0)
    assert replace(LIMITS, wire=Wire(velocity=below, torque=below)).wire.torque is below
    with pytest.raises(InputError, match="carries no velocity"):
        replace(LIMITS, wire=Wire(velocity=beyond))


@pytest.mark.parametrize("at", [-3.0, 3.0, 0.7])
def test_the_first_command_is_given_anywhere_within_the_limits(at: float) -> None:
    assert first_command(at, LIMITS) == SafeCommand(at, 0.0, 0.0, 0)


def test_no_first_command_is_given_where_the_wire_has_none() -> None:
    """And one where joint and wire have a single angle in common."""
    for wire, at in ((Grid(0.0, 0.0, 3.0, 9.0), 3.0), (Grid(0.0, 0.0, -9.0, -3.0), -3.0)):
        assert first_command(at, replace(LIMITS, wire=Wire(wire))).motor_position_rad == at
    for at in (0.0, 3.0):
        with pytest.raises(InputError, match="the motor stands at"):
            first_command(at, replace(LIMITS, wire=Wire(Grid(0.0, 0.0, 5.0, 9.0))))


def test_a_limit_holds_to_a_millionth_of_the_wire_s_step() -> None:
    """A ten-thousandth of a step below 3 rad the next value that may be sent lies a whole step below."""
    limits = replace(LIMITS, position_max_rad=3.0 - 1e-6, wire=Wire(Grid(0.0, 0.01, -9.0, 9.0)))
    assert first_command(3.0 - 1e-6, limits).motor_position_rad == pytest.approx(2.99, abs=1e-9)
    near = replace(limits, position_max_rad=3.0 - 5e-9)
    assert first_command(3.0 - 5e-9, near).motor_position_rad == pytest.approx(3.0, abs=1e-9)


def test_unless_told_otherwise_a_motor_goes_anywhere_at_40_rad_s() -> None:
    limits = GateLimits()
    for at in (-1e3, 1e3):
        assert first_command(at, limits).motor_position_rad == at
        safe = gate(Command(at + 0.3, 50.0, 1e3), SafeCommand(at, 0.0, 0.0, 0), at, 0.1, T, limits)
        assert safe[:3] == pytest.approx([at + 0.04, 40.0, 1e3], abs=1e-9)
        assert gate(Command(at, 0.0, 0.0), safe, at, 0.101, T, limits).flags == STALE


def test_limits_stay_as_they_were_made() -> None:
    with pytest.raises(FrozenInstanceError):
        GateLimits().torque_max_Nm = 9.0  # type: ignore[misc]  # wrong on purpose


def test_unless_told_otherwise_no_command_is_more_than_half_a_radian_from_the_motor() -> None:
    limits = GateLimits(-3.0, 3.0, position_rate_rad_s=1e6)
    safe = gate(Command(2.0, 0.0, 0.0), SafeCommand(0.0, 0.0, 0.0, 0), 0.2, 0.0, T, limits)
    assert safe.motor_position_rad == pytest.approx(0.7)
