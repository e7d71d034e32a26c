"""Bytes of the simulated side against bytes worked out from the protocols' own documents."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import cantools
import pytest
from far_end import encode_command, read_state, read_status
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.errors import SimError
from firmware_sim.firmware import (
    Drive,
    DriveConfig,
    DriveState,
    Request,
    Sample,
    SensorFlag,
    Setpoint,
    Status,
)
from firmware_sim.plantlike import Readings
from firmware_sim.wire.base import Answer
from firmware_sim.wire.damiao import DamiaoWire
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import MODELS, MitWire, decode_command
from firmware_sim.wire.odrive import OdriveWire
from firmware_sim.wire.packed import PackedMessage
from firmware_sim.wire.sensor import state_frame, status_frame
from firmware_sim.wire.shipped import tables

LINKS = Path(__file__).resolve().parents[2] / "configs" / "links"
AT_REST = Readings(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 25.0)


def drive_at(position: float = 0.0, velocity: float = 0.0, torque: float = 0.0) -> Drive:
    drive = Drive(DriveConfig())
    drive.observe(
        AT_REST._replace(motor_position_rad=position, motor_velocity_rad_s=velocity, motor_torque_Nm=torque)
    )
    return drive


# ---- MIT -------------------------------------------------------------------------------------------
# All-zero command 7F FF 7F F0 00 00 07 FF: the field layout of CubeMars' AK manual V1.0.8 (5.3) with the
# truncating
# float_to_uint of the mini-cheetah firmware gives 0x7FFF, 0x7FF, 0, 0, 0x7FF; it is the frame that users of
# Damiao and
# CubeMars drives quote. Second row: -0.6 rad -> 31194 = 0x79DA, kp 100 of 500 -> 819 = 0x333, kd 2 of 5 ->
# 1638 = 0x666.
# Third: torque 0.2 of ±10 Nm -> 2088 = 0x828.
MIT_EXAMPLES = [
    ("AK80-9", Setpoint(), "7FFF7FF0000007FF"),
    ("DM4310", Setpoint(-0.6, 0.0, 0.0, 100.0, 2.0), "79DA7FF3336667FF"),
    ("DM4310", Setpoint(torque_Nm=0.2), "7FFF7FF000000828"),
    ("DM4310", Setpoint(-12.5, -30.0, -10.0, 0.0, 0.0), "0000000000000000"),
    ("DM4310", Setpoint(12.5, 30.0, 10.0, 500.0, 5.0), "FFFFFFFFFFFFFFFF"),
]


@pytest.mark.parametrize(("model", "target", "expected"), MIT_EXAMPLES)
def test_mit_command_bytes(model: str, target: Setpoint, expected: str) -> None:
    data = bytes.fromhex(expected)
    assert encode_command(MODELS[model], target) == data
    back = decode_command(MODELS[model], data)
    steps = Setpoint(
        25 / 65535, 2 * MODELS[model].velocity / 4095, 2 * MODELS[model].torque / 4095, 500 / 4095, 5 / 4095
    )
    for got, wanted, step in zip(back, target, steps, strict=True):
        assert wanted - step <= got <= wanted + 1e-9


@given(
    st.sampled_from(sorted(MODELS)),
    st.integers(0, 2**64 - 1),
)
def test_mit_decode_then_encode_gives_the_bytes_back_within_one(model: str, bits: int) -> None:
    data = bits.to_bytes(8, "big")
    again = int.from_bytes(encode_command(MODELS[model], decode_command(MODELS[model], data)), "big")
    for shift, mask in ((48, 0xFFFF), (36, 0xFFF), (24, 0xFFF), (12, 0xFFF), (0, 0xFFF)):
        # truncation of an exact value may fall one below it by rounding
        assert 0 <= (bits >> shift & mask) - (again >> shift & mask) <= 1


def test_mit_reply_bytes() -> None:
    # AK manual 5.3: byte 0 driver id, then position 16, velocity 12, torque 12 bits, temperature, error
    wire = MitWire(1, "AK80-9")
    assert wire.answer(Answer.STATE, Frame(1), drive_at()) == Frame(0, bytes.fromhex("017FFF7FF7FF1900"))
    # 12.5 rad, -50 rad/s, 18 Nm: full scale, none, full scale
    full = wire.answer(Answer.STATE, Frame(1), drive_at(12.5, -50.0, 18.0))
    assert full is not None
    assert full.data.hex().upper() == "01FFFF000FFF1900"
    # the six bytes of the original firmware
    original = MitWire(1, "mini-cheetah").answer(Answer.STATE, Frame(1), drive_at())
    assert original is not None
    assert original.data.hex().upper() == "017FFF7FF7FF"


def test_damiao_reply_carries_the_state_in_the_upper_four_bits() -> None:
    wire, drive = DamiaoWire(3, "DM-J4310-2EC", reply_id=0x13), drive_at()
    frame = wire.answer(Answer.STATE, Frame(3), drive)
    assert frame is not None
    assert (frame.identifier, frame.data[0]) == (0x13, 0x03)
    wire.hear(Frame(3, bytes.fromhex("FFFFFFFFFFFFFFFC")), drive, 0.0)
    frame = wire.answer(Answer.STATE, Frame(3), drive)
    assert frame is not None
    assert frame.data[0] == 0x13
    assert tuple(frame.data[6:]) == (25, 25)


@pytest.mark.parametrize(
    ("last", "state"), [(0xFC, DriveState.ENABLED), (0xFD, DriveState.DISABLED), (0xFE, DriveState.DISABLED)]
)
def test_mit_special_frames(last: int, state: DriveState) -> None:
    wire, drive = MitWire(1), drive_at(position=0.5)
    heard = wire.hear(Frame(1, b"\xff" * 7 + bytes((last,))), drive, 0.0)
    # TMotorCANControl, `zero`: "shut off communication with the motor for about a second"
    assert bool(heard.answers) == (last != 0xFE)
    assert bool(wire.hear(Frame(1, bytes(8)), drive, 0.9).answers) == (last != 0xFE)
    assert wire.hear(Frame(1, bytes(8)), drive, 1.1).answers
    assert not heard.steps
    assert drive.state is state
    assert drive.position_rad == (0.0 if last == 0xFE else 0.5)


def test_mit_models_and_ids_are_checked() -> None:
    with pytest.raises(SimError, match="unknown model"):
        MitWire(1, "AK47")
    with pytest.raises(SimError, match="1 to 15"):
        MitWire(16, "DM4310")


# ---- ODrive ----------------------------------------------------------------------------------------


def test_odrive_identifiers_and_payloads_of_the_documentation() -> None:
    # "CAN Protocol": axis 1, command 0x0C -> 0x2C; closed loop = state 8 as uint32; Set_Input_Vel = two
    # floats
    wire, drive = OdriveWire(1), drive_at()
    assert 0x01 << 5 | 0x0C == 0x2C
    assert 0x2C in set(wire.identifiers())
    wire.hear(Frame(0x27, bytes.fromhex("0800000000000000")), drive, 0.0)
    assert drive.state is DriveState.ENABLED
    wire.hear(Frame(0x2B, bytes.fromhex("0200000001000000")), drive, 0.0)
    wire.hear(Frame(0x2D, bytes.fromhex("0000803F000000BF")), drive, 0.0)  # 1.0 rev/s, -0.5 Nm (IEEE 754)
    assert drive.setpoint.velocity_rad_s == pytest.approx(2 * math.pi)
    assert drive.setpoint.torque_Nm == -0.5
    # input position 1.234 turns is B6 F3 9D 3F; velocity and torque feed-forward in thousandths: 500, -250
    wire.hear(Frame(0x2C, bytes.fromhex("B6F39D3FF40106FF")), drive, 0.0)
    assert drive.setpoint.position_rad == pytest.approx(1.234 * 2 * math.pi, rel=1e-7)
    assert drive.setpoint.velocity_rad_s == pytest.approx(0.5 * 2 * math.pi)
    assert drive.setpoint.torque_Nm == pytest.approx(-0.25)


def test_odrive_answers() -> None:
    wire, drive = OdriveWire(1), drive_at(position=2 * math.pi, velocity=-math.pi)
    heartbeat = wire.answer(Answer.ASKED, Frame(0x21, remote=True), drive)
    assert heartbeat == Frame(
        0x21, bytes.fromhex("0000000001000100")
    )  # no error, idle, success, no trajectory
    encoder = wire.answer(Answer.ASKED, Frame(0x29, remote=True), drive)
    assert encoder == Frame(0x29, bytes.fromhex("0000803F000000BF"))  # 1 rev, -0.5 rev/s
    drive.request(Request.STOP, 0.0)
    stopped = wire.answer(Answer.ASKED, Frame(0x21, remote=True), drive)
    assert stopped is not None
    assert struct.unpack_from("<I", stopped.data)[0] == 33554432  # ESTOP_REQUESTED
    assert stopped.data[4:6] == bytes((1, 3))  # idle, disarmed


def test_odrive_ignores_what_is_too_short() -> None:
    wire, drive = OdriveWire(2), drive_at()
    before = drive.setpoint
    wire.hear(Frame(0x4C, b"\x00\x00"), drive, 0.0)
    assert drive.setpoint == before


# ---- sensor node and tables ------------------------------------------------------------------------


def test_sensor_bytes() -> None:
    # 1.0 rad = 1 000 000 = 0x000F4240; -0.5 Nm = -50 000 = 0xFF3CB0; sequence 7
    frame = state_frame(1, Sample(1.0, -0.5, 7))
    assert frame == Frame(0x680, bytes.fromhex("40420F00B03CFF07"))
    # 1 000 000 us, 25.00 degC = 2500 = 0x09C4, flags 0x11, sequence 8; joint 3 is 0x20 further
    status = Status(1_000_000, 25.0, SensorFlag(0x11), 8)
    assert status_frame(3, status) == Frame(0x685, bytes.fromhex("40420F00C4091108"))
    assert read_status(status_frame(3, status)) == status


@given(st.floats(-2000, 2000), st.floats(-80, 80), st.integers(0, 255))
def test_sensor_state_there_and_back(angle: float, torque: float, sequence: int) -> None:
    back = read_state(state_frame(1, Sample(angle, torque, sequence)))
    assert back.joint_position_rad == pytest.approx(angle, abs=0.5001e-6)
    assert back.joint_torque_Nm == pytest.approx(torque, abs=0.5001e-5)
    assert back.sequence == sequence


def test_no_value_survives_the_wire() -> None:
    back = read_state(state_frame(1, Sample(math.nan, math.nan, 0)))
    assert math.isnan(back.joint_position_rad)
    assert math.isnan(back.joint_torque_Nm)


def test_shipped_tables_are_those_of_the_code() -> None:
    for name, text in tables().items():
        assert (LINKS / name).read_text(encoding="ascii") == text, (
            f"run python -m firmware_sim.wire.shipped {LINKS}"
        )


def test_shipped_tables_read_the_same_bytes_as_the_manuals() -> None:
    mit = cantools.database.load_file(LINKS / "cablecomp_mit_ak80_9.dbc")
    told = mit.decode_message(1, bytes.fromhex("79DA7FF3336667FF"))
    assert told["motor_position_target_rad"] == pytest.approx(-0.6, abs=4e-4)
    assert told["kp_Nm_per_rad"] == pytest.approx(100.0, abs=0.13)
    assert told["kd_Nms_per_rad"] == pytest.approx(2.0, abs=2e-3)
    odrive = cantools.database.load_file(LINKS / "cablecomp_odrive.dbc")
    told = odrive.decode_message(0x2C, bytes.fromhex("B6F39D3FF40106FF"))
    assert told == {"Input_Pos": pytest.approx(1.234), "Vel_FF": 0.5, "Torque_FF": -0.25}
    assert (
        odrive.decode_message(0x21, bytes.fromhex("0000000208030000"))["Axis_State"] == "CLOSED_LOOP_CONTROL"
    )
    joint = cantools.database.load_file(LINKS / "cablecomp_joint.dbc")
    told = joint.decode_message(0x680, bytes.fromhex("40420F00B03CFF07"))
    assert told == {"joint_position_rad": 1.0, "joint_torque_Nm": pytest.approx(-0.5), "sequence": 7}


@pytest.mark.parametrize("table", ["cablecomp_joint.dbc", "cablecomp_mit_ak80_9.dbc", "cablecomp_odrive.dbc"])
def test_packed_messages_agree_with_cantools(table: str) -> None:
    database = cantools.database.load_file(LINKS / table)
    data = bytes((0x93, 0x5A, 0x01, 0x40, 0xC4, 0x0F, 0x3E, 0x77))
    for message in database.messages:
        packed = PackedMessage(message)
        want = message.decode(data[: message.length], decode_choices=False)
        got = packed.decode(data[: message.length])
        assert got == pytest.approx(want)
        assert packed.encode(got) == message.encode(want, strict=False)
