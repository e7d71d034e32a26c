"""CANSimple frames against ODrive's documentation, its message table, and bytes recorded from an ODrive."""

from __future__ import annotations

import math

import cantools
import pytest

from cablecomp.errors import InputError
from cablecomp.links import cansimple as c
from cablecomp.links.cansimple import AxisState, Cmd, ControlMode
from cablecomp.links.cansimple_firmware import FIRMWARES, error_of, error_words, state_of
from cablecomp.links.records import CLIP_POSITION, CLIP_TORQUE, CLIP_VELOCITY, REMOTE, DriveState

# Places of the signals as ODrive's CAN protocol page tables them (start bit = 8 x start byte).
TABLE = """VERSION ""
NS_ :
BS_:
BU_: H A
BO_ 1 Heartbeat: 8 A
 SG_ Error : 0|32@1+ (1,0) [0|0] "" H
 SG_ State : 32|8@1+ (1,0) [0|0] "" H
BO_ 7 Set_Axis_State: 8 H
 SG_ State : 0|32@1+ (1,0) [0|0] "" A
BO_ 9 Encoder: 8 A
 SG_ Pos : 0|32@1- (1,0) [0|0] "" H
 SG_ Vel : 32|32@1- (1,0) [0|0] "" H
BO_ 11 Mode: 8 H
 SG_ Control : 0|32@1+ (1,0) [0|0] "" A
 SG_ Input : 32|32@1+ (1,0) [0|0] "" A
BO_ 12 Input_Pos: 8 H
 SG_ Pos : 0|32@1- (1,0) [0|0] "" A
 SG_ Vel_FF : 32|16@1- (0.001,0) [0|0] "" A
 SG_ Torque_FF : 48|16@1- (0.001,0) [0|0] "" A
BO_ 13 Input_Vel: 8 H
 SG_ Vel : 0|32@1- (1,0) [0|0] "" A
 SG_ Torque_FF : 32|32@1- (1,0) [0|0] "" A
BO_ 14 Input_Torque: 8 H
 SG_ Torque : 0|32@1- (1,0) [0|0] "" A
BO_ 25 Absolute: 8 H
 SG_ Pos : 0|32@1- (1,0) [0|0] "" A
BO_ 15 Limits: 8 H
 SG_ Vel : 0|32@1- (1,0) [0|0] "" A
 SG_ Current : 32|32@1- (1,0) [0|0] "" A
SIG_VALTYPE_ 9 Pos : 1;
SIG_VALTYPE_ 9 Vel : 1;
SIG_VALTYPE_ 12 Pos : 1;
SIG_VALTYPE_ 13 Vel : 1;
SIG_VALTYPE_ 13 Torque_FF : 1;
SIG_VALTYPE_ 14 Torque : 1;
SIG_VALTYPE_ 25 Pos : 1;
SIG_VALTYPE_ 15 Vel : 1;
SIG_VALTYPE_ 15 Current : 1;
"""


@pytest.fixture(scope="module")
def table():
    return cantools.database.load_string(TABLE, "dbc")


def test_identifiers_of_the_documentation() -> None:
    # "0x01 << 5 | 0x0C = 0x2C"; node 63 asked for its bus voltage: 0x7F7
    assert c.identifier(1, 0x0C) == 0x2C
    assert c.identifier(63, Cmd.GET_BUS_VOLTAGE_CURRENT) == 0x7F7
    assert c.request(63, Cmd.GET_BUS_VOLTAGE_CURRENT) == (0x7F7 | REMOTE, b"")
    with pytest.raises(InputError, match="0 to 63"):
        c.identifier(64, 1)


def test_bytes_recorded_from_an_odrive() -> None:
    # ODrive forum, "CAN interface available for testing": 7F7 [8] 33 F5 42 41 00 00 00 00 was 12.1848… V
    voltage, current = c.parse_pair(bytes.fromhex("33 F5 42 41 00 00 00 00"))
    assert voltage == pytest.approx(12.184863090515137, rel=1e-15)
    assert current == 0.0
    # CAN guide: 021 [8] 00 00 00 00 08 00 00 00 is axis 1 in closed loop, 001 […] 01 is axis 0 idle
    closed = c.parse_heartbeat(bytes.fromhex("00 00 00 00 08 00 00 00"))
    idle = c.parse_heartbeat(bytes.fromhex("00 00 00 00 01 00 00 00"))
    assert closed[:2] == (0, AxisState.CLOSED_LOOP)
    for firmware in FIRMWARES.values():
        assert state_of(firmware, closed) == DriveState.ENABLED
        assert state_of(firmware, idle) == DriveState.DISABLED


def test_states() -> None:
    for firmware in FIRMWARES.values():
        assert state_of(firmware, c.Heartbeat(0x100, 8, bytes(3))) == DriveState.FAULT
        assert state_of(firmware, c.Heartbeat(0, 3, bytes(3))) == DriveState.CALIBRATING
        assert state_of(firmware, c.Heartbeat(0, 0, bytes(3))) == DriveState.UNKNOWN


def test_the_same_bytes_mean_other_things_to_the_two_firmwares() -> None:
    # 0.5.6: bytes 5, 6, 7 bit 0 are motor, encoder, controller error, bit 63 trajectory done;
    # 0.6.10: byte 5 is the result of the last procedure (13 = invalid state, 15 = not converging), 6 done
    old, new = FIRMWARES["0.5"], FIRMWARES["0.6"]
    refused = c.parse_heartbeat(bytes.fromhex("00 00 00 00 01 0D 00 00"))
    assert error_words(old, error_of(old, refused)) == "motor error"
    assert error_of(new, refused) == 0
    done = c.parse_heartbeat(bytes.fromhex("00 00 00 00 08 00 00 80"))
    assert state_of(old, done) == DriveState.ENABLED
    failed = c.parse_heartbeat(bytes.fromhex("00 02 00 00 01 00 01 01"))
    assert error_words(old, error_of(old, failed)) == "controller failed, encoder error, controller error"
    assert error_words(new, error_of(new, failed)) == "dc bus under voltage"
    expired = (0x800, 0x100_0000)
    assert [error_words(f, e) for f, e in zip((old, new), expired, strict=True)] == [
        "watchdog timer expired"
    ] * 2


def test_commands_lie_where_odrives_table_puts_them(table) -> None:
    frame, clipped = c.set_input_pos(3, 1.25, -0.5, 2.125)
    assert (frame.identifier, clipped) == (0x6C, 0)
    assert frame.data == table.encode_message("Input_Pos", {"Pos": 1.25, "Vel_FF": -0.5, "Torque_FF": 2.125})
    assert frame.data[:4] == bytes.fromhex("00 00 A0 3F")  # 1.25 in IEEE 754, little end first
    frame, _ = c.set_input_vel(3, 2.5, -0.75)
    assert frame.data == table.encode_message("Input_Vel", {"Vel": 2.5, "Torque_FF": -0.75})
    frame, _ = c.set_input_torque(3, 0.375)
    assert frame.data == table.encode_message("Input_Torque", {"Torque": 0.375})
    frame = c.set_limits(3, 20.0, 10.0)
    assert frame.data == table.encode_message("Limits", {"Vel": 20.0, "Current": 10.0})
    frame = c.set_controller_mode(3, ControlMode.TORQUE)
    assert frame.data == table.encode_message("Mode", {"Control": 1, "Input": 1})
    frame = c.set_axis_state(3, AxisState.CLOSED_LOOP)
    assert frame == (0x67, bytes.fromhex("08 00 00 00 00 00 00 00"))
    frame = c.set_absolute_position(3, -2.5)
    assert frame == (0x79, table.encode_message("Absolute", {"Pos": -2.5}))


def test_payloads_lie_where_odrives_table_puts_them(table) -> None:
    data = table.encode_message("Encoder", {"Pos": -7.5, "Vel": 0.125})
    assert c.parse_pair(data) == (-7.5, 0.125)
    data = table.encode_message("Heartbeat", {"Error": 0x2000000, "State": 1})
    assert c.parse_heartbeat(data)[:2] == (0x2000000, 1)


def test_frames_without_payload() -> None:
    assert c.estop(1) == (0x22, b"")


def test_saturation_is_reported() -> None:
    frame, clipped = c.set_input_pos(0, 0.0, 40.0, -40.0)
    assert clipped == CLIP_VELOCITY | CLIP_TORQUE
    assert frame.data[4:] == bytes.fromhex("FF 7F 00 80")
    assert c.set_input_pos(0, 1e39, 0.0, 0.0).clipped == CLIP_POSITION
    assert c.set_input_torque(0, -1e300).clipped == CLIP_TORQUE


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_nan_and_infinity_are_refused(bad: float) -> None:
    for call in (
        lambda: c.set_input_pos(0, bad, 0.0, 0.0),
        lambda: c.set_input_pos(0, 0.0, 0.0, bad),
        lambda: c.set_input_vel(0, bad, 0.0),
        lambda: c.set_input_torque(0, bad),
        lambda: c.set_limits(0, bad, 1.0),
        lambda: c.set_absolute_position(0, bad),
    ):
        with pytest.raises(InputError, match="accepted"):
            call()


@pytest.mark.parametrize("length", [0, 4, 7])
def test_short_payloads_are_refused(length: int) -> None:
    with pytest.raises(InputError, match="8 are accepted"):
        c.parse_pair(bytes(length))
    with pytest.raises(InputError, match="8 are accepted"):
        c.parse_heartbeat(bytes(length))
