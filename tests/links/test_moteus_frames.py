"""moteus registers: bytes of the maker's documents, and the maker's own client against ours."""

from __future__ import annotations

import contextlib
import io
import math
import struct
import warnings
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st
from link_rig import Rig

from cablecomp.errors import InputError
from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links import moteus as ours
from cablecomp.links.records import (
    EXTENDED,
    FD,
    JOINT_POSITION,
    JOINT_VELOCITY,
    MOTOR_CURRENT,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    SWITCH,
)

LINK = "moteus-socketcan.toml"
REPLY = 0x100
TURN = 2 * math.pi


def peer() -> Any:
    with warnings.catch_warnings():  # of the client's own imports
        warnings.simplefilter("ignore")
        return pytest.importorskip("moteus", reason="peer not installed: pip install 'cablecomp[peers]'")


def reply(
    mode: float, position: float, velocity: float, torque: float, current: float, *, fault: int = 0
) -> bytes:
    """Register reply laid out by hand: 5 float32 from 0, three int8 from 0x0D, a NOP."""
    head = struct.pack("<BBB5f", 0x2C, 5, 0, mode, position, velocity, torque, current)
    return head + struct.pack("<BBbbb", 0x23, 0x0D, 48, 31, fault) + b"\x50" * 4


def tell(rig: Rig, data: bytes, identifier: int = REPLY, extended: bool = False) -> None:
    message = can.Message(arbitration_id=identifier, is_extended_id=extended, is_fd=True, data=data)
    rig.client.send(message)


def sent(rig: Rig) -> list[can.Message]:
    out = []
    while (message := rig.client.recv(0)) is not None:
        out.append(message)
    return out


def test_the_documents_example_of_a_reply() -> None:
    # "CAN Protocol": 24 04 00 0a00 5000 0001 70ff 23 0d 18 14 00 -> int16 registers, then 12 V, 20 degC, no fault
    found = ours.parse(bytes.fromhex("2404000a005000000170ff230d181400"))
    assert found == {ours.Register.VOLTAGE: 12.0, ours.Register.TEMPERATURE: 20.0, ours.Register.FAULT: 0.0}


def test_identifiers_of_the_document() -> None:
    assert ours.identifier(1, 0) == 0x8001 | EXTENDED | FD | SWITCH
    assert ours.identifier(1, 0, reply=False) == 0x001 | FD | SWITCH
    assert set(ours.reply_identifiers(1, 0)) == {0x100 | FD, 0x100 | FD | EXTENDED}
    assert ours.reply_identifiers(8, 0) == (0x800 | FD | EXTENDED,)


@given(st.binary(max_size=64))
def test_no_reply_whatever_it_holds_does_more_than_be_refused(data: bytes) -> None:
    with contextlib.suppress(InputError):
        assert ours.parse(data).keys() <= {*range(5), *range(0x50, 0x56), 0x0D, 0x0E, 0x0F, 0x58}


def test_a_command_is_what_the_makers_client_sends(rigs: Any) -> None:
    theirs = peer()
    resolution = theirs.PositionResolution()
    for name in vars(theirs.PositionResolution):
        if not name.startswith("_"):
            setattr(resolution, name, theirs.F32)
    controller = theirs.Controller(id=1, position_resolution=resolution)
    rig: Rig = rigs(LINK)
    rig.link.send(0, MotorCommand(TURN / 4, TURN, 2.0, 1000.0 / TURN, 5.0 / TURN))
    (message,) = sent(rig)
    assert (message.arbitration_id, message.is_extended_id, message.is_fd, message.bitrate_switch) == (
        0x8001,
        True,
        True,
        True,
    )
    want = controller.make_position(
        position=0.25, velocity=1.0, feedforward_torque=2.0, kp_scale=1.0, kd_scale=0.5,
        maximum_torque=math.nan, ilimit_scale=0.0,
    )  # fmt: skip
    body = bytes(message.data)
    parsed = theirs.protocol.parse_registers(body)
    expected = theirs.protocol.parse_registers(want.data)
    assert parsed.command.keys() == expected.command.keys()
    for register, value in expected.command.items():
        assert parsed.command[register] == pytest.approx(value, nan_ok=True), register
    assert not parsed.errors
    assert len(body) in (48, 64)
    rig.link.request(0, Request.DISABLE)
    (message,) = sent(rig)
    assert bytes(message.data).startswith(controller.make_stop().data)
    rig.link.request(0, Request.SET_ZERO)
    (message,) = sent(rig)
    assert bytes(message.data).startswith(controller.make_set_output_exact(position=0.0).data)


@pytest.mark.parametrize(
    ("mode", "registers"),
    [
        (Mode.TORQUE, {0x20: math.nan, 0x21: 0.0, 0x22: 2.0, 0x23: 0.0, 0x24: 0.0}),
        (Mode.VELOCITY, {0x20: math.nan, 0x21: 1.0, 0x22: 2.0, 0x23: 1.0, 0x24: 1.0}),
        (Mode.POSITION, {0x20: 0.25, 0x21: 1.0, 0x22: 2.0, 0x23: 1.0, 0x24: 1.0, 0x2B: 1.0}),
    ],
)
def test_modes_by_the_drives_own_gains(rigs: Any, mode: Mode, registers: dict[int, float]) -> None:
    theirs = peer()
    own = {
        "kp_Nm_per_turn = 1000.0": "# kp",
        "kd_Nms_per_turn = 10.0": "# kd",
        'mode = "impedance"': 'mode = "position"',
        "stiffness_Nm_per_rad = 200.0": "",
        "damping_Nms_per_rad = 2.0": "",
    }
    rig: Rig = rigs(LINK, own)
    rig.link.request(0, Request.ENABLE, mode)
    sent(rig)
    rig.link.send(0, MotorCommand(TURN / 4, TURN, 2.0))
    (message,) = sent(rig)
    parsed = theirs.protocol.parse_registers(bytes(message.data)).command
    for register, value in registers.items():
        assert parsed[register] == pytest.approx(value, nan_ok=True), hex(register)
    with pytest.raises(InputError, match="kp_Nm_per_turn"):
        rig.link.request(0, Request.ENABLE, Mode.IMPEDANCE)
    with pytest.raises(InputError, match="finite"):
        rig.link.send(0, MotorCommand(math.inf))
    assert sent(rig) == []


def test_enabling_makes_no_force(rigs: Any) -> None:
    rig: Rig = rigs(LINK)
    rig.link.request(0, Request.ENABLE)
    (message,) = sent(rig)
    # mode 10; position NaN, then five zeros: velocity, torque, both gains, the most torque
    assert bytes(message.data).startswith(
        b"\x01\x00\x0a\x0c\x06\x20" + struct.pack("<6f", math.nan, *[0.0] * 5)
    )


@pytest.mark.parametrize("extended", [False, True])
def test_a_reply_laid_out_by_hand(rigs: Any, extended: bool) -> None:
    rig: Rig = rigs(LINK)
    joint = rig.link.joints[0]
    tell(rig, reply(10, 0.25, -1.5, 2.25, 3.5), extended=extended)
    assert rig.link.poll(1.0) == 6
    assert joint.values[MOTOR_POSITION] == pytest.approx(TURN / 4)
    assert joint.values[MOTOR_VELOCITY] == pytest.approx(-1.5 * TURN)
    assert (joint.values[MOTOR_TORQUE], joint.values[MOTOR_CURRENT]) == (2.25, 3.5)
    assert joint.values[joint.index("other_bus_voltage_V")] == 24.0
    assert joint.values[joint.index("other_driver_temperature_degC")] == 31.0
    assert (joint.state, joint.error) == (DriveState.ENABLED, 0)


@pytest.mark.parametrize(
    ("mode", "fault", "state", "text"),
    [
        (0, 0, DriveState.DISABLED, ""),
        (1, 34, DriveState.FAULT, "over voltage"),
        (3, 0, DriveState.CALIBRATING, ""),
        (10, 99, DriveState.ENABLED, ""),  # held by servo.max_current_A: no fault
        (11, 0, DriveState.FAULT, "no command came in time"),
    ],
)
def test_modes_and_faults(rigs: Any, mode: int, fault: int, state: DriveState, text: str) -> None:
    rig: Rig = rigs(LINK)
    tell(rig, reply(mode, 0.0, 0.0, 0.0, 0.0, fault=fault))
    rig.link.poll(1.0)
    assert (rig.link.joints[0].state, rig.link.error_text(0)) == (state, text)


def test_what_is_no_reply_of_this_drive_is_not_taken(rigs: Any) -> None:
    rig: Rig = rigs(LINK)
    joint, whole = rig.link.joints[0], reply(10, 0.25, 0.0, 0.0, 0.0)
    tell(rig, whole, identifier=0x200)
    tell(rig, whole, identifier=0x101)
    tell(rig, whole[:20])
    tell(rig, b"\x42" + whole[:7])
    rig.client.send(can.Message(arbitration_id=REPLY, is_extended_id=False, data=whole[:8]))
    assert rig.link.poll(1.0) == 0
    assert (joint.replies, math.isnan(joint.values[MOTOR_POSITION])) == (0, True)
    assert (rig.link.status().invalid, rig.link.status().ignored) == (2, 3)
    tell(rig, reply(10, math.nan, 0.0, 0.0, 0.0))
    rig.link.poll(2.0)
    assert math.isnan(joint.values[MOTOR_POSITION])


def test_a_reply_that_the_makers_writer_made(rigs: Any) -> None:
    theirs = peer()
    stream = io.BytesIO()
    writer = theirs.protocol.Writer(stream)
    for first, kind, values in ((0, 0x2C, (10.0, 0.5, -0.25, 1.5, 4.0)), (0x50, 0x2C, (0.1, 0.2))):
        writer.write_int8(kind)
        writer.write_varuint(len(values))
        writer.write_varuint(first)
        for value in values:
            writer.write_f32(value)
    rig: Rig = rigs(LINK)
    tell(rig, stream.getvalue())
    assert rig.link.poll(1.0) == 4
    read = theirs.protocol.parse_reply(stream.getvalue())
    assert read[theirs.Register.POSITION] * TURN == pytest.approx(rig.link.joints[0].values[MOTOR_POSITION])


# ---- the joint's encoder on the drive's second input --------------------------------------------------

DUAL = "moteus-dual-encoder.toml"


def dual_reply(turns: float, velocity: float, valid: int) -> bytes:
    second = struct.pack("<BB2f", 0x2E, 0x52, turns, velocity) + struct.pack("<BBb", 0x21, 0x58, valid)
    return reply(10, 0.25, 0.0, 0.0, 0.0)[:-4] + second + b"\x50" * 7


def test_the_second_encoder_is_the_joints(rigs: Any) -> None:
    rig: Rig = rigs(DUAL, {"position_offset_rad = 0.0": "position_offset_rad = 0.1\nposition_sign = -1"})
    joint = rig.link.joints[0]
    for turns, where in ((0.125, 0.125), (0.875, -0.125), (0.4999, 0.4999)):
        tell(rig, dual_reply(turns, 0.5, 0b1111))
        assert rig.link.poll(1.0) == 8
        assert joint.values[JOINT_POSITION] == pytest.approx(-where * TURN - 0.1, abs=1e-6)
        assert joint.values[JOINT_VELOCITY] == pytest.approx(-0.5 * TURN)
    before = joint.updates[JOINT_POSITION]
    tell(rig, dual_reply(0.3, 0.5, 0b0011))  # the drive calls it invalid
    assert rig.link.poll(2.0) == 6
    assert joint.updates[JOINT_POSITION] == before
    rig.link.send(0, MotorCommand())
    (message,) = sent(rig)
    theirs = peer()
    asked = {r for r, _ in theirs.protocol.parse_registers(bytes(message.data)).query}
    assert {0x52, 0x53, 0x58} <= {int(r) for r in asked}


def test_a_sensor_that_is_another_drive_is_refused(rigs: Any) -> None:
    with pytest.raises(InputError, match="is a drive, and not this joint's own"):
        rigs(
            DUAL, {'[joint.sensor]\ndevice = "drive"\nnode = 1': '[joint.sensor]\ndevice = "drive"\nnode = 2'}
        )


def test_a_bus_without_fd_is_refused(rigs: Any) -> None:
    with pytest.raises(InputError, match=r"needs CAN FD; set bus\.fd = true"):
        rigs(LINK, {"fd = true": "fd = false"})
