"""CubeMars drives on extended identifiers: bytes worked out from the manual's tables, and what is made of them."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest

from cablecomp.errors import InputError
from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links.records import (
    CLIP_TORQUE,
    EXTENDED,
    MOTOR_CURRENT,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
)

V3, SERVO = "cubemars-v3-socketcan.toml", "cubemars-servo-socketcan.toml"
STATUS = EXTENDED | 0x2901


def test_zero_force_control_has_the_gains_first(rigs: Any) -> None:
    rig = rigs(V3)
    rig.link.send(0, MotorCommand(0.0, 0.0, 0.0, 0.0, 0.0))
    # kp 000, kd 000, position 7FFF, velocity 7FF, torque 7FF
    assert rig.heard() == [(EXTENDED | 0x801, bytes.fromhex("00 00 00 7F FF 7F F7 FF"))]
    rig.link.send(0, MotorCommand(12.56, 65.0, -18.0, 500.0, 5.0))
    assert rig.heard() == [(EXTENDED | 0x801, bytes.fromhex("FF FF FF FF FF FF F0 00"))]
    assert rig.link.send(0, MotorCommand(0.0, 0.0, 18.1, 0.0, 0.0)) == CLIP_TORQUE


@pytest.mark.parametrize(
    ("mode", "function", "counts"),
    [
        ("position", 4, math.degrees(0.5) * 10_000),  # 1e-4 degrees of the output shaft
        ("velocity", 3, 0.25 * 60 / (2 * math.pi) * 21 * 9),  # electrical rpm: 21 pole pairs, 9:1
        ("torque", 1, -0.125 / 0.5701 * 1000),  # mA
    ],
)
def test_servo_commands_are_one_int32(rigs: Any, mode: str, function: int, counts: float) -> None:
    rig = rigs(SERVO)
    assert rig.link.request(0, Request.ENABLE, Mode(mode))
    assert rig.heard() == [(EXTENDED | 0x101, bytes(4))]
    rig.link.send(0, MotorCommand(0.5, 0.25, -0.125))
    assert rig.heard() == [(EXTENDED | function << 8 | 1, struct.pack(">i", round(counts)))]


@pytest.mark.parametrize("name", [V3, SERVO])
def test_the_status_that_comes_by_itself(rigs: Any, name: str) -> None:
    rig = rigs(name)
    joint = rig.link.joints[0]
    rig.link.request(0, Request.ENABLE)
    rig.tell(STATUS, struct.pack(">hhhbB", -1800, 945, 250, -5, 0))
    assert rig.link.poll(1.0) == 5
    assert joint.values[MOTOR_POSITION] == pytest.approx(-math.pi)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(9450 / 189 * 2 * math.pi / 60)
    assert joint.values[MOTOR_CURRENT] == pytest.approx(2.5)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(2.5 * 0.5701)
    assert joint.values[joint.index("other_driver_temperature_degC")] == -5.0
    assert (joint.state, joint.error) == (DriveState.ENABLED, 0)
    rig.tell(STATUS, struct.pack(">hhhbB", -1800, 945, 250, -5, 3))
    rig.link.poll(2.0)
    assert (joint.state, joint.error) == (DriveState.FAULT, 3)


def test_a_status_of_another_drive_another_length_or_identifier_is_not_taken(rigs: Any) -> None:
    rig = rigs(V3)
    joint = rig.link.joints[0]
    data = struct.pack(">hhhbB", -1800, 945, 250, 25, 0)
    rig.tell(STATUS + 1, data)
    rig.tell(STATUS, data[:7])
    rig.tell(0x101, data)
    assert rig.link.poll(1.0) == 0
    assert math.isnan(joint.values[MOTOR_POSITION])
    assert rig.link.status().invalid == 1


@pytest.mark.parametrize("ask", [Request.DISABLE, Request.STOP, Request.REPORT])
def test_letting_go_takes_the_current_away_before_it_leaves_the_mode(rigs: Any, ask: Request) -> None:
    rig = rigs(V3)
    assert rig.link.request(0, ask)
    assert rig.heard() == [(EXTENDED | 0x101, bytes(4)), (EXTENDED | 0xF01, bytes(8))]


def test_servo_mode_says_what_it_has_not(rigs: Any) -> None:
    rig = rigs(SERVO)
    with pytest.raises(InputError, match="no `impedance`; accepted: position, velocity, torque"):
        rig.link.request(0, Request.ENABLE, Mode.IMPEDANCE)
    with pytest.raises(InputError, match="takes no stiffness or damping"):
        rig.link.send(0, MotorCommand(0.1, 0.0, 0.0, 5.0, 1.0))
    with pytest.raises(InputError, match="finite"):
        rig.link.send(0, MotorCommand(math.nan))
    assert rig.heard() == []


def test_a_model_whose_motor_constants_are_not_known_needs_them(rigs: Any) -> None:
    with pytest.raises(InputError, match=r"electrical_turns .* state both"):
        rigs(SERVO, {'model = "AK80-9"': 'model = "AK70-9"'})
    rig = rigs(
        SERVO,
        {'model = "AK80-9"': 'model = "AK70-9"\nelectrical_turns = 100\ntorque_constant_Nm_per_A = 1.0'},
    )
    rig.link.request(0, Request.ENABLE, Mode.TORQUE)
    rig.heard()
    rig.link.send(0, MotorCommand(torque_Nm=2.0))
    assert rig.heard() == [(EXTENDED | 0x101, struct.pack(">i", 2000))]
