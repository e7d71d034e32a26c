"""What ODrive's firmwares 0.5 and 0.6 do not share: error words, heartbeat flags, commands.

Sources: the message tables (DBC) of 0.5.6 and 0.6.10, with their value tables; ODrive documentation, "CAN
Protocol" of both versions; 0.5's published firmware (`can_simple.cpp`, heartbeat).
"""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

from cablecomp.links.cansimple import AxisState, Cmd, Cmd06, Heartbeat
from cablecomp.links.records import DriveState

FirmwareName = Literal["0.5", "0.6"]
Datum = Literal["encoder", "iq", "bus", "torques", "temperature", "powers"]

MOTOR_FLAG: Final = 1 << 32
ENCODER_FLAG: Final = 1 << 33
CONTROLLER_FLAG: Final = 1 << 34
_FLAGS_05: Final = ((0, 0x01, MOTOR_FLAG), (1, 0x01, ENCODER_FLAG), (2, 0x01, CONTROLLER_FLAG))


class Firmware(NamedTuple):
    """One firmware: what asks for each datum, payloads of Reboot and Clear_Errors, names of error bits."""

    name: FirmwareName
    data: dict[Datum, int]
    reboot: bytes
    clear: bytes
    errors: dict[int, str]


ERRORS_05: Final[dict[int, str]] = {
    0x1: "invalid state",
    0x40: "motor failed",
    0x80: "sensorless estimator failed",
    0x100: "encoder failed",
    0x200: "controller failed",
    0x800: "watchdog timer expired",
    0x1000: "minimum endstop pressed",
    0x2000: "maximum endstop pressed",
    0x4000: "estop requested",
    0x20000: "homing without endstop",
    0x40000: "over temperature",
    0x80000: "unknown position",
    MOTOR_FLAG: "motor error",
    ENCODER_FLAG: "encoder error",
    CONTROLLER_FLAG: "controller error",
}
"""Axis error bits of firmware 0.5, and the heartbeat's three flags above them."""

ERRORS_06: Final[dict[int, str]] = {
    0x1: "initializing",
    0x2: "system level",
    0x4: "timing error",
    0x8: "missing estimate",
    0x10: "bad config",
    0x20: "drv fault",
    0x40: "missing input",
    0x100: "dc bus over voltage",
    0x200: "dc bus under voltage",
    0x400: "dc bus over current",
    0x800: "dc bus over regen current",
    0x1000: "current limit violation",
    0x2000: "motor over temperature",
    0x4000: "inverter over temperature",
    0x8000: "velocity limit violation",
    0x10000: "position limit violation",
    0x1000000: "watchdog timer expired",
    0x2000000: "estop requested",
    0x4000000: "spinout detected",
    0x8000000: "brake resistor disarmed",
    0x10000000: "thermistor disconnected",
    0x40000000: "calibration error",
}
"""Axis error bits of firmware 0.6."""

FIRMWARES: Final[dict[FirmwareName, Firmware]] = {
    "0.5": Firmware(
        "0.5",
        {
            "encoder": Cmd.GET_ENCODER_ESTIMATES,
            "iq": Cmd.GET_IQ,
            "bus": Cmd.GET_BUS_VOLTAGE_CURRENT,
        },
        b"",
        b"",
        ERRORS_05,
    ),
    "0.6": Firmware(
        "0.6",
        {
            "encoder": Cmd.GET_ENCODER_ESTIMATES,
            "iq": Cmd.GET_IQ,
            "bus": Cmd.GET_BUS_VOLTAGE_CURRENT,
            "torques": Cmd06.GET_TORQUES,
            "temperature": Cmd06.GET_TEMPERATURE,
            "powers": Cmd06.GET_POWERS,
        },
        b"\x00",
        b"\x00",
        ERRORS_06,
    ),
}


def error_of(firmware: Firmware, heartbeat: Heartbeat) -> int:
    """Error bits of a heartbeat; 0.5 tells by flags in bytes 5 to 7 that motor, encoder or controller have
    errors of their own, 0.6 has the result of the last procedure there."""
    error = heartbeat.error
    if firmware.name == "0.5":
        for byte, mask, bit in _FLAGS_05:
            if heartbeat.rest[byte] & mask:
                error |= bit
    return error


def state_of(firmware: Firmware, heartbeat: Heartbeat) -> DriveState:
    """Canonical state: any error is FAULT, idle is DISABLED, closed loop is ENABLED, other sequences are
    CALIBRATING."""
    if error_of(firmware, heartbeat):
        return DriveState.FAULT
    if heartbeat.axis_state == AxisState.CLOSED_LOOP:
        return DriveState.ENABLED
    if heartbeat.axis_state == AxisState.IDLE:
        return DriveState.DISABLED
    return DriveState.UNKNOWN if heartbeat.axis_state == AxisState.UNDEFINED else DriveState.CALIBRATING


def error_words(firmware: Firmware, error: int) -> str:
    """The makers' words for error bits; an empty text for 0."""
    names = [name for bit, name in firmware.errors.items() if error & bit]
    return ", ".join(names) if names else (f"axis error 0x{error:X}" if error else "")
