"""Message tables of makers' drives: ODrive CANSimple, and the MIT frame with the ranges of one model.

Sources as in `odrive.py` and `mit.py`; where a signal sits is stated here once more, as a table, and the
tests compare
both with bytes worked out from the manuals.
"""

from __future__ import annotations

from typing import NamedTuple

from firmware_sim.wire.dbc_text import Message, Signal
from firmware_sim.wire.mit import model_of

_AXIS_STATES = tuple(
    enumerate(
        (
            "UNDEFINED",
            "IDLE",
            "STARTUP_SEQUENCE",
            "FULL_CALIBRATION_SEQUENCE",
            "MOTOR_CALIBRATION",
            "SENSORLESS_CONTROL",
            "ENCODER_INDEX_SEARCH",
            "ENCODER_OFFSET_CALIBRATION",
            "CLOSED_LOOP_CONTROL",
            "LOCKIN_SPIN",
            "ENCODER_DIR_FIND",
            "HOMING",
        )
    )
)


def _real(name: str, start: int, unit: str = "") -> Signal:
    return Signal(name, start, 32, unit=unit, signed=True, real=True)


_POSITION = (
    _real("Input_Pos", 0, "rev"),
    Signal("Vel_FF", 32, 16, 1e-3, "rev/s", True),
    Signal("Torque_FF", 48, 16, 1e-3, "Nm", True),
)
_HEARTBEAT = (
    Signal("Axis_Error", 0, 32),
    Signal("Axis_State", 32, 8, values=_AXIS_STATES),
    Signal("Procedure_Result", 40, 8),
    Signal("Trajectory_Done_Flag", 48, 1),
)
_VERSION = tuple(
    Signal(name, 8 * i, 8)
    for i, name in enumerate(
        (
            "Protocol_Version",
            "Hw_Version_Major",
            "Hw_Version_Minor",
            "Hw_Version_Variant",
            "Fw_Version_Major",
            "Fw_Version_Minor",
            "Fw_Version_Revision",
            "Fw_Version_Unreleased",
        )
    )
)
_ERROR = (Signal("Active_Errors", 0, 32), Signal("Disarm_Reason", 32, 32))
_MODE = (Signal("Control_Mode", 0, 32), Signal("Input_Mode", 32, 32))
_ENCODER = (_real("Pos_Estimate", 0, "rev"), _real("Vel_Estimate", 32, "rev/s"))
_FET, _MOTOR = _real("FET_Temperature", 0, "degC"), _real("Motor_Temperature", 32, "degC")
_ENDPOINT = Signal("Endpoint_ID", 8, 16)


class _Entry(NamedTuple):
    command: int
    name: str
    length: int
    axis_sends: bool
    signals: tuple[Signal, ...]


_ODRIVE = (
    _Entry(0x00, "Get_Version", 8, True, _VERSION),
    _Entry(0x01, "Heartbeat", 8, True, _HEARTBEAT),
    _Entry(0x02, "Estop", 0, False, ()),
    _Entry(0x03, "Get_Error", 8, True, _ERROR),
    _Entry(0x04, "RxSdo", 8, False, (Signal("Opcode", 0, 8), _ENDPOINT, Signal("Value", 32, 32))),
    _Entry(0x05, "TxSdo", 8, True, (_ENDPOINT, Signal("Value", 32, 32))),
    _Entry(0x06, "Address", 8, True, (Signal("Node_ID", 0, 8), Signal("Serial_Number", 8, 48))),
    _Entry(0x07, "Set_Axis_State", 8, False, (Signal("Axis_Requested_State", 0, 32, values=_AXIS_STATES),)),
    _Entry(0x09, "Get_Encoder_Estimates", 8, True, _ENCODER),
    _Entry(0x0B, "Set_Controller_Mode", 8, False, _MODE),
    _Entry(0x0C, "Set_Input_Pos", 8, False, _POSITION),
    _Entry(
        0x0D, "Set_Input_Vel", 8, False, (_real("Input_Vel", 0, "rev/s"), _real("Input_Torque_FF", 32, "Nm"))
    ),
    _Entry(0x0E, "Set_Input_Torque", 8, False, (_real("Input_Torque", 0, "Nm"),)),
    _Entry(
        0x0F, "Set_Limits", 8, False, (_real("Velocity_Limit", 0, "rev/s"), _real("Current_Limit", 32, "A"))
    ),
    _Entry(0x11, "Set_Traj_Vel_Limit", 8, False, (_real("Traj_Vel_Limit", 0, "rev/s"),)),
    _Entry(
        0x12,
        "Set_Traj_Accel_Limits",
        8,
        False,
        (_real("Traj_Accel_Limit", 0, "rev/s^2"), _real("Traj_Decel_Limit", 32, "rev/s^2")),
    ),
    _Entry(0x13, "Set_Traj_Inertia", 8, False, (_real("Traj_Inertia", 0, "Nm/(rev/s^2)"),)),
    _Entry(0x14, "Get_Iq", 8, True, (_real("Iq_Setpoint", 0, "A"), _real("Iq_Measured", 32, "A"))),
    _Entry(0x15, "Get_Temperature", 8, True, (_FET, _MOTOR)),
    _Entry(0x16, "Reboot", 1, False, (Signal("Action", 0, 8),)),
    _Entry(
        0x17,
        "Get_Bus_Voltage_Current",
        8,
        True,
        (_real("Bus_Voltage", 0, "V"), _real("Bus_Current", 32, "A")),
    ),
    _Entry(0x18, "Clear_Errors", 1, False, (Signal("Identify", 0, 8),)),
    _Entry(0x19, "Set_Absolute_Position", 8, False, (_real("Position", 0, "rev"),)),
    _Entry(0x1A, "Set_Pos_Gain", 8, False, (_real("Pos_Gain", 0, "(rev/s) / rev"),)),
    _Entry(
        0x1B,
        "Set_Vel_Gains",
        8,
        False,
        (_real("Vel_Gain", 0, "Nm / (rev/s)"), _real("Vel_Integrator_Gain", 32, "Nm / rev")),
    ),
    _Entry(
        0x1C, "Get_Torques", 8, True, (_real("Torque_Target", 0, "Nm"), _real("Torque_Estimate", 32, "Nm"))
    ),
    _Entry(
        0x1D, "Get_Powers", 8, True, (_real("Electrical_Power", 0, "W"), _real("Mechanical_Power", 32, "W"))
    ),
)
"""Firmware 0.6.10, lengths as in ODrive's own table: 8 bytes even where 4 of them say nothing."""


def odrive_table(nodes: int) -> tuple[Message, ...]:
    """CANSimple messages of nodes 1…`nodes`."""
    return tuple(
        Message(
            node << 5 | e.command,
            f"Axis{node}_{e.name}",
            e.length,
            f"ODrive_Axis{node}" if e.axis_sends else "Host",
            "Host" if e.axis_sends else f"ODrive_Axis{node}",
            e.signals,
        )
        for node in range(1, nodes + 1)
        for e in _ODRIVE
    )


def _range(name: str, start: int, bits: int, top: float, unit: str, both_ways: bool = True) -> Signal:
    """A field of `bits` bits, most significant at `start` (Motorola), over ±top or 0…top."""
    low = -top if both_ways else 0.0
    scale = (top - low) / ((1 << bits) - 1)
    return Signal(name, start, bits, scale, unit, motorola=True, offset=low, low=low, high=top)


def mit_table(model: str, drives: int) -> tuple[Message, ...]:
    """Commands to drives 1…`drives` of one model, and their reply on identifier 0."""
    m = model_of(model)
    command = (
        _range("motor_position_target_rad", 7, 16, m.position, "rad"),
        _range("motor_velocity_target_rad_s", 23, 12, m.velocity, "rad/s"),
        _range("kp_Nm_per_rad", 27, 12, m.kp, "Nm/rad", both_ways=False),
        _range("kd_Nms_per_rad", 47, 12, m.kd, "Nms/rad", both_ways=False),
        _range("motor_torque_target_Nm", 51, 12, m.torque, "Nm"),
    )
    reply = (
        Signal("drive_id", 0, 8),
        _range("motor_position_rad", 15, 16, m.position, "rad"),
        _range("motor_velocity_rad_s", 31, 12, m.velocity, "rad/s"),
        _range("motor_torque_Nm", 35, 12, m.torque, "Nm"),
        Signal("temperature_degC", 48, 8, unit="degC"),
        Signal("error_code", 56, 8),
    )
    special = "eight bytes FF FF FF FF FF FF FF FC/FD/FE enter, leave, set zero"
    commands = tuple(
        Message(n, f"Drive{n}_Command", 8, "Host", f"Drive{n}", command, special)
        for n in range(1, drives + 1)
    )
    told = "drive_id says which drive replies"
    return (Message(0, "Drive_Reply", 8, "Drive1", "Host", reply, told), *commands)
