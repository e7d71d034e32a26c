"""Faults on demand: at the wire (`FaultyPort`), on a pseudo-terminal, and in the device; each small, timed, seeded.

Imports ports, wire and what it asks of a plant. Start reading at `base.py`, what a fault is.
"""

from firmware_sim.faults.base import Fault
from firmware_sim.faults.device import (
    DeviceFault,
    DeviceReset,
    JumpingEncoder,
    SaturatedTorque,
    SensorOffset,
    SilentNode,
    StuckEncoder,
)
from firmware_sim.faults.line import BusOff, CablePull, LineFault, SerialNoise
from firmware_sim.faults.port import FaultyPort
from firmware_sim.faults.spec import FAULTS, describe_faults, parse_fault
from firmware_sim.faults.wire import Corrupt, Drop, Late, Reorder, Repeat, WireFault

__all__ = [
    "FAULTS",
    "BusOff",
    "CablePull",
    "Corrupt",
    "DeviceFault",
    "DeviceReset",
    "Drop",
    "Fault",
    "FaultyPort",
    "JumpingEncoder",
    "Late",
    "LineFault",
    "Reorder",
    "Repeat",
    "SaturatedTorque",
    "SensorOffset",
    "SerialNoise",
    "SilentNode",
    "StuckEncoder",
    "WireFault",
    "describe_faults",
    "parse_fault",
]
