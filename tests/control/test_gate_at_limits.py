"""The last gate at a limit of position, worked out by hand: nothing leads on."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cablecomp.control.command import Command
from cablecomp.control.gate import (
    POSITION_LIMITED,
    TORQUE_LIMITED,
    VELOCITY_LIMITED,
    GateLimits,
    SafeCommand,
    gate,
)

T = 1e-3
FREE = GateLimits(-3.0, 3.0, position_rate_rad_s=1e6, lead_max_rad=100.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("asked", "before", "motor", "passed", "flags"),
    [
        ((3.0, 5.0, 0.5), 3.0, 2.9, (3.0, 0.0, 0.5), POSITION_LIMITED | VELOCITY_LIMITED),
        ((3.0, -5.0, 0.5), 3.0, 2.9, (3.0, -5.0, 0.5), 0),  # away from it
        ((2.99, 5.0, 0.0), 2.99, 3.01, (2.99, 0.0, 0.0), POSITION_LIMITED | VELOCITY_LIMITED),
        ((2.99, 5.0, 0.0), 2.99, 2.99, (2.99, 5.0, 0.0), 0),
    ],
)
def test_at_a_limit_of_position_no_velocity_leads_on(
    asked: tuple[float, float, float],
    before: float,
    motor: float,
    passed: tuple[float, ...],
    flags: int,
    sign: float,
) -> None:
    last = SafeCommand(sign * before, 0.0, 0.0, 0)
    safe = gate(Command(*(sign * x for x in asked)), last, sign * motor, 0.0, T, FREE)
    assert safe[:3] == pytest.approx([sign * x for x in passed])
    assert safe.flags == flags


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("asked", "motor", "passed", "flags"),
    [
        ((8.0, 0.5), 2.0, (8.0, 0.5), 0),
        ((8.0, 0.5), 2.9, (2.0, 0.5), POSITION_LIMITED | VELOCITY_LIMITED),  # 0.1 rad within 0.05 s
        ((8.0, 0.5), 3.0, (0.0, 0.0), POSITION_LIMITED | VELOCITY_LIMITED | TORQUE_LIMITED),
        ((-8.0, -0.5), 3.2, (-8.0, -0.5), 0),  # back
    ],
)
def test_a_drive_that_is_told_no_position_is_held_by_where_the_motor_is(
    asked: tuple[float, float], motor: float, passed: tuple[float, float], flags: int, sign: float
) -> None:
    limits = replace(FREE, tells_position=False)
    at = sign * min(motor, 3.0)
    safe = gate(
        Command(at, sign * asked[0], sign * asked[1]),
        SafeCommand(at, 0.0, 0.0, 0),
        sign * motor,
        0.0,
        T,
        limits,
    )
    assert safe[1:3] == pytest.approx([sign * x for x in passed])
    assert safe.flags == flags


@pytest.mark.parametrize(
    ("motor", "asked", "passed"),
    [
        (3.0, -2.0, -2.0),
        (3.0, 0.0, -1.2),
        (3.0, -1.1, -1.2),
        (-3.0, -1.2, -1.2),
        (-3.0, -1.4, -1.2),
        (-3.0, 0.5, 0.5),
    ],
)
def test_what_holds_an_open_circuits_pretension_leads_nowhere(
    motor: float, asked: float, passed: float
) -> None:
    """Balance is at -1.2 Nm: at the upper limit no more than that passes, at the lower one no less."""
    limits = replace(FREE, tells_position=False, balance_Nm=-1.2)
    safe = gate(Command(motor, 0.0, asked), SafeCommand(motor, 0.0, 0.0, 0), motor, 0.0, T, limits)
    assert safe.motor_torque_Nm == passed
