"""Links to drives of one make each; the devices' bytes are worked out from the manuals by hand."""

from __future__ import annotations

import math
import struct

import pytest
from link_rig import TURN

from cablecomp.errors import InputError
from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links.records import (
    CLIP_TORQUE,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
)


def test_a_damiao_drive_tells_its_state(rigs) -> None:
    rig = rigs(
        "mit-virtual.toml", {'model = "AK80-9"': 'model = "DM4310"', "reply_id = 0": "reply_id = 0x11"}
    )
    link, joint = rig.link, rig.link.joints[0]
    for first, state, error in (
        (0x01, DriveState.DISABLED, 0),
        (0x11, DriveState.ENABLED, 0),
        (0xD1, DriveState.FAULT, 0xD),
    ):
        rig.tell(0x11, bytes([first, 0x80, 0, 0x80, 0x08, 0, 40, 55]))
        link.poll(0.0)
        assert (joint.state, joint.error) == (state, error)
    assert link.error_text(0) == "communication lost"
    assert joint.values[joint.index("other_motor_temperature_degC")] == 55.0
    link.request(0, Request.CLEAR_FAULTS)
    assert rig.heard() == [(1, bytes.fromhex("FFFFFFFFFFFFFFFB"))]


def test_an_odrive(rigs) -> None:
    rig = rigs(
        "odrive-virtual.toml",
        {'mode = "position"': 'gear_ratio = 8.0\nsign = -1\nmode = "position"'},
    )
    link, joint = rig.link, rig.link.joints[0]
    link.request(0, Request.ENABLE)
    assert rig.heard() == [
        (0x2B, bytes.fromhex("03 00 00 00 01 00 00 00")),
        (0x27, bytes.fromhex("08 00 00 00 00 00 00 00")),
    ]
    rig.tell(0x21, "00 00 00 00 08 00 00 00")
    rig.tell(0x29, struct.pack("<ff", 2.0, -0.5))
    rig.tell(0x3C, struct.pack("<ff", 0.5, 0.25))
    rig.tell(0x35, struct.pack("<ff", 30.0, 45.0))
    assert link.poll(1.0) == 4
    assert joint.state == DriveState.ENABLED
    assert joint.values[MOTOR_POSITION] == pytest.approx(-2.0 * TURN / 8)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(0.5 * TURN / 8)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(-2.0)
    assert joint.values[joint.index("other_motor_temperature_degC")] == 45.0
    assert link.send(0, MotorCommand(-TURN / 4, TURN / 8, -2.0)) == 0
    assert rig.heard() == [(0x2C, struct.pack("<fhh", 2.0, -1000, 250))]
    assert link.send(0, MotorCommand(0.0, 0.0, 1e3)) == CLIP_TORQUE
    link.request(0, Request.ENABLE, Mode.TORQUE)
    rig.heard()
    link.send(0, MotorCommand(torque_Nm=-4.0))
    assert rig.heard() == [(0x2E, struct.pack("<ff", 0.5, 0.0))]
    rig.tell(0x29, struct.pack("<ff", math.nan, 0.0))
    assert link.poll(2.0) == 0
    assert link.status().invalid == 1
    rig.tell(0x21, struct.pack("<I", 0x0100_2000) + bytes([1, 0, 0, 0]))
    link.poll(3.0)
    assert joint.state == DriveState.FAULT
    assert link.error_text(0) == "motor over temperature, watchdog timer expired"
    assert link.stop()
    assert rig.heard() == [(0x22, b""), (0x27, bytes.fromhex("01 00 00 00 00 00 00 00"))]


def test_an_odrive_is_asked_for_what_it_does_not_send(rigs) -> None:
    rig = rigs(
        "odrive-virtual.toml",
        {
            'cyclic = ["encoder", "torques", "temperature"]': 'polled = ["iq", "bus"]\n'
            "torque_constant_Nm_per_A = 0.5"
        },
    )
    joint = rig.link.joints[0]
    rig.link.send(0, MotorCommand())
    asked = []
    while (message := rig.client.recv(0)) is not None:
        asked.append((message.arbitration_id, message.is_remote_frame))
    assert asked == [(0x2C, False), (0x34, True), (0x37, True)]
    rig.tell(0x34, struct.pack("<ff", 0.0, 3.0))
    rig.tell(0x37, struct.pack("<ff", 24.0, 0.0))
    rig.link.poll(0.0)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(1.5)
    assert joint.values[joint.index("other_bus_voltage_V")] == 24.0


def test_a_drive_of_a_table(rigs) -> None:
    rig = rigs("dbc-virtual.toml")
    link, joint = rig.link, rig.link.joints[0]
    link.request(0, Request.ENABLE, Mode.IMPEDANCE)
    # enable = 2, impedance = 3, 200 / 0.05 = 4000, 2 / 0.001 = 2000
    assert rig.heard() == [(0x6C1, struct.pack("<BBHHH", 2, 3, 4000, 2000, 0))]
    assert link.send(0, MotorCommand(-1.5, 2.0, 3.25)) == 0
    assert rig.heard() == [(0x6C0, struct.pack("<ihh", -1_500_000, 1000, 3250))]
    assert link.send(0, MotorCommand(torque_Nm=33.0)) == CLIP_TORQUE
    assert rig.heard()[0][1][6:] == bytes.fromhex("FF 7F")
    with pytest.raises(InputError, match="cannot carry stiffness"):
        link.send(0, MotorCommand(stiffness_Nm_per_rad=100.0))
    with pytest.raises(InputError, match="nothing was sent"):
        link.send(0, MotorCommand(position_rad=math.inf))
    assert rig.heard() == []
    # int28 of 1e-6 rad, int12 of 0.025 rad/s, int16 of 1e-3 Nm, sequence
    word = (-1_000_000 & 0xFFFFFFF) | (-40 & 0xFFF) << 28 | (1500 & 0xFFFF) << 40 | 9 << 56
    rig.tell(0x6C2, word.to_bytes(8, "little"))
    rig.tell(0x6C3, struct.pack("<BHhhB", 0x32, 0x0005, 250, -32768, 9))
    assert link.poll(0.0) == 4
    assert joint.values[MOTOR_POSITION] == pytest.approx(-1.0)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(-1.0)
    assert joint.values[MOTOR_TORQUE] == pytest.approx(1.5)
    assert (joint.state, joint.error, joint.replies) == (DriveState.ENABLED, 5, 1)
    assert math.isnan(joint.values[joint.index("other_motor_temperature_degC")])
    assert link.error_text(0) == "error flags 0x5"
    assert link.stop()
    assert rig.heard()[0] == (0x6C1, struct.pack("<BBHHH", 0, 3, 0, 0, 0))
