"""Firmware of the simulated joint: the drive at the motor, the sensor node at the joint. No input or output here.

Imports what it asks of a plant (`plantlike.py`) and errors alone. Start reading at `drive.py`.
"""

from firmware_sim.firmware.drive import Drive, DriveReport
from firmware_sim.firmware.drive_config import DriveConfig
from firmware_sim.firmware.gearbox import Gearbox
from firmware_sim.firmware.records import (
    DriveFlag,
    DriveState,
    Mode,
    Request,
    Sample,
    SensorFlag,
    Setpoint,
    Status,
)
from firmware_sim.firmware.sensor_node import SensorNode, SensorNodeConfig
from firmware_sim.firmware.shaping import InputMode, Shaper, ShapingConfig

__all__ = [
    "Drive",
    "DriveConfig",
    "DriveFlag",
    "DriveReport",
    "DriveState",
    "Gearbox",
    "InputMode",
    "Mode",
    "Request",
    "Sample",
    "SensorFlag",
    "SensorNode",
    "SensorNodeConfig",
    "Setpoint",
    "Shaper",
    "ShapingConfig",
    "Status",
]
