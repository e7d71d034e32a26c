"""Message tables of makers' drives: ODrive CANSimple, and the MIT frame with the ranges of one model.

Sources as in `odrive.py` and `mit.py`; where a signal sits is stated here once more, as a table, and the
tests compare
both with bytes worked out from the manuals.
"""

from __future__ import annotations

from firmware_sim.wire.dbc_text import Message, Signal
from firmware_sim.wire.mit import model_of

_AXIS_STATES = (
    (0, "undefined"),
    (1, "idle"),
    (3, "full_calibration"),
    (6, "encoder_index_search"),
    (8, "closed_loop_control"),
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
# command, name, length, whether the axis sends it, signals
_ODRIVE: tuple[tuple[int, str, int, bool, tuple[Signal, ...]], ...] = (
    (0x00, "Get_Version", 8, True, _VERSION),
    (0x01, "Heartbeat", 8, True, _HEARTBEAT),
    (0x02, "Estop", 0, False, ()),
    (0x03, "Get_Error", 8, True, _ERROR),
    (0x07, "Set_Axis_State", 4, False, (Signal("Axis_Requested_State", 0, 32, values=_AXIS_STATES),)),
    (0x09, "Get_Encoder_Estimates", 8, True, _ENCODER),
    (0x0B, "Set_Controller_Mode", 8, False, _MODE),
    (0x0C, "Set_Input_Pos", 8, False, _POSITION),
    (0x0D, "Set_Input_Vel", 8, False, (_real("Input_Vel", 0, "rev/s"), _real("Input_Torque_FF", 32, "Nm"))),
    (0x0E, "Set_Input_Torque", 4, False, (_real("Input_Torque", 0, "Nm"),)),
    (0x0F, "Set_Limits", 8, False, (_real("Velocity_Limit", 0, "rev/s"), _real("Current_Limit", 32, "A"))),
    (0x14, "Get_Iq", 8, True, (_real("Iq_Setpoint", 0, "A"), _real("Iq_Measured", 32, "A"))),
    (
        0x15,
        "Get_Temperature",
        8,
        True,
        (_real("FET_Temperature", 0, "degC"), _real("Motor_Temperature", 32, "degC")),
    ),
    (0x16, "Reboot", 1, False, (Signal("Action", 0, 8),)),
    (0x17, "Get_Bus_Voltage_Current", 8, True, (_real("Bus_Voltage", 0, "V"), _real("Bus_Current", 32, "A"))),
    (0x18, "Clear_Errors", 1, False, (Signal("Identify", 0, 8),)),
    (0x19, "Set_Absolute_Position", 4, False, (_real("Position", 0, "rev"),)),
    (0x1A, "Set_Pos_Gain", 4, False, (_real("Pos_Gain", 0),)),
    (0x1B, "Set_Vel_Gains", 8, False, (_real("Vel_Gain", 0), _real("Vel_Integrator_Gain", 32))),
    (0x1C, "Get_Torques", 8, True, (_real("Torque_Target", 0, "Nm"), _real("Torque_Estimate", 32, "Nm"))),
)


def odrive_table(nodes: int) -> tuple[Message, ...]:
    """CANSimple messages of nodes 1…`nodes`."""
    return tuple(
        Message(
            node << 5 | command,
            f"Axis{node}_{name}",
            length,
            f"ODrive_Axis{node}" if axis_sends else "Host",
            "Host" if axis_sends else f"ODrive_Axis{node}",
            signals,
        )
        for node in range(1, nodes + 1)
        for command, name, length, axis_sends, signals in _ODRIVE
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
