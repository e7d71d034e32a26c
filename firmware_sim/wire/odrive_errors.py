"""Error words of ODrive's two firmwares, made from the simulated drive's flags.

Sources: value tables of ODrive's message tables (`odrive-cansimple.dbc`) of 0.5.6 and 0.6.10.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from firmware_sim.firmware import DriveFlag, DriveReport, DriveState

Bits = dict[DriveFlag, int]


@dataclass(frozen=True)
class Codes:
    """Bits of each error word, and the commands that feed the watchdog (0.5: any message does)."""

    axis_bits: Bits
    motor_bits: Bits = field(default_factory=dict)
    encoder_bits: Bits = field(default_factory=dict)
    controller_bits: Bits = field(default_factory=dict)
    feeding: tuple[int, ...] = ()

    def axis(self, report: DriveReport) -> int:
        """Errors of the axis; 0 unless the drive is in a fault."""
        return _word(self.axis_bits, report)

    def motor(self, report: DriveReport) -> int:
        """Errors of the motor (0.5 only)."""
        return _word(self.motor_bits, report)

    def encoder(self, report: DriveReport) -> int:
        """Errors of the encoder (0.5 only)."""
        return _word(self.encoder_bits, report)

    def controller(self, report: DriveReport) -> int:
        """Errors of the controller (0.5 only)."""
        return _word(self.controller_bits, report)


def _word(bits: Bits, report: DriveReport) -> int:
    if report.state is not DriveState.FAULT:
        return 0
    word = 0
    for flag, bit in bits.items():
        if report.flags & flag:
            word |= bit
    return word


V06 = Codes(
    axis_bits={
        DriveFlag.MOTOR_ENCODER: 0x8,  # MISSING_ESTIMATE
        DriveFlag.BAD_MODE: 0x10,  # BAD_CONFIG
        DriveFlag.OVER_TEMPERATURE: 0x2000,  # MOTOR_OVER_TEMP
        DriveFlag.OVER_VELOCITY: 0x8000,  # VELOCITY_LIMIT_VIOLATION
        DriveFlag.POSITION_LIMIT: 0x1_0000,  # POSITION_LIMIT_VIOLATION
        DriveFlag.COMMAND_TIMEOUT: 0x100_0000,  # WATCHDOG_TIMER_EXPIRED
        DriveFlag.EMERGENCY_STOP: 0x200_0000,  # ESTOP_REQUESTED
        DriveFlag.INDEX_NOT_FOUND: 0x4000_0000,  # CALIBRATION_ERROR
    },
    feeding=(0x07, 0x0C, 0x0D, 0x0E),
)
MOTOR_FAILED, ENCODER_FAILED, CONTROLLER_FAILED = 0x40, 0x100, 0x200
V05 = Codes(
    axis_bits={
        DriveFlag.OVER_TEMPERATURE: MOTOR_FAILED,
        DriveFlag.MOTOR_ENCODER: ENCODER_FAILED,
        DriveFlag.INDEX_NOT_FOUND: ENCODER_FAILED,
        DriveFlag.OVER_VELOCITY: CONTROLLER_FAILED,
        DriveFlag.BAD_MODE: CONTROLLER_FAILED,
        DriveFlag.COMMAND_TIMEOUT: 0x800,  # WATCHDOG_TIMER_EXPIRED
        DriveFlag.POSITION_LIMIT: 0x1000,  # MIN_ENDSTOP_PRESSED
        DriveFlag.EMERGENCY_STOP: 0x4000,  # ESTOP_REQUESTED
    },
    motor_bits={DriveFlag.OVER_TEMPERATURE: 0x2_0000},  # MOTOR_THERMISTOR_OVER_TEMP
    encoder_bits={DriveFlag.MOTOR_ENCODER: 0x4, DriveFlag.INDEX_NOT_FOUND: 0x20},  # NO_RESPONSE, …_YET
    controller_bits={DriveFlag.OVER_VELOCITY: 0x1, DriveFlag.BAD_MODE: 0x2},  # OVERSPEED, INVALID_INPUT_MODE
)
