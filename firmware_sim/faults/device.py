"""Faults inside a joint: encoders, torque, offsets, a silent node, a reset in mid-motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Flag, auto

from firmware_sim.errors import SimError
from firmware_sim.faults.base import Fault
from firmware_sim.plantlike import Readings

ENCODERS = ("joint", "motor")


class Node(Flag):
    """Devices of one joint."""

    NONE = 0
    DRIVE = auto()
    SENSOR = auto()


NODES = {"drive": Node.DRIVE, "sensor": Node.SENSOR, "both": Node.DRIVE | Node.SENSOR}


@dataclass
class DeviceFault(Fault):
    """Acts on joint number `joint` (0 = on all)."""

    joint: int = 0

    def sense(self, readings: Readings, now_s: float) -> Readings:
        """Readings as the devices get them."""
        return readings

    def torque(self, command_Nm: float, now_s: float) -> float:
        """Torque command as the motor gets it."""
        return command_Nm

    def silent(self, now_s: float) -> Node:
        """Nodes that neither hear nor speak now."""
        return Node.NONE

    def resets(self, now_s: float) -> Node:
        """Nodes that start afresh now; each reset is told once."""
        return Node.NONE


def _one_of(value: str, accepted: tuple[str, ...] | dict[str, Node], key: str) -> None:
    if value not in accepted:
        raise SimError(f"fault: {key} {value!r}; one of {', '.join(accepted)} is accepted")


@dataclass
class StuckEncoder(DeviceFault):
    """The encoder `which` (joint or motor) keeps the value that it had when the fault began."""

    which: str = "joint"
    _held: float = field(default=math.nan, init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.which, ENCODERS, "which")

    def sense(self, readings: Readings, now_s: float) -> Readings:
        """The held angle, velocity 0."""
        angle = f"{self.which}_position_rad"
        if not self.active(now_s):
            self._held = math.nan
            return readings
        if math.isnan(self._held):
            self._held = getattr(readings, angle)
        return readings._replace(**{angle: self._held, f"{self.which}_velocity_rad_s": 0.0})


@dataclass
class JumpingEncoder(DeviceFault):
    """The encoder `which` is off by `jump` rad: lastingly if `p` is 0, else in single samples with
    probability `p`."""

    which: str = "joint"
    jump: float = 0.5
    p: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.which, ENCODERS, "which")

    def sense(self, readings: Readings, now_s: float) -> Readings:
        """The angle, off."""
        if not self.active(now_s) or (self.p > 0.0 and not self.chance(self.p)):
            return readings
        angle = f"{self.which}_position_rad"
        return readings._replace(**{angle: getattr(readings, angle) + self.jump})


@dataclass
class SaturatedTorque(DeviceFault):
    """Torque beyond ± `limit` Nm is lost: `which` = motor (what it makes) or sensor (what the joint sensor
    shows)."""

    which: str = "motor"
    limit: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.which, ("motor", "sensor"), "which")

    def torque(self, command_Nm: float, now_s: float) -> float:
        """Clipped at the motor."""
        hit = self.which == "motor" and self.active(now_s)
        return min(max(command_Nm, -self.limit), self.limit) if hit else command_Nm

    def sense(self, readings: Readings, now_s: float) -> Readings:
        """Clipped at the sensor."""
        if self.which != "sensor" or not self.active(now_s):
            return readings
        clipped = min(max(readings.joint_torque_Nm, -self.limit), self.limit)
        return readings._replace(joint_torque_Nm=clipped)


@dataclass
class SensorOffset(DeviceFault):
    """`offset` is added to the channel `channel`, in its own unit."""

    channel: str = "joint_torque_Nm"
    offset: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.channel, Readings._fields[1:], "channel")

    def sense(self, readings: Readings, now_s: float) -> Readings:
        """The channel, off."""
        if not self.active(now_s):
            return readings
        return readings._replace(**{self.channel: getattr(readings, self.channel) + self.offset})


@dataclass
class SilentNode(DeviceFault):
    """The `node` (drive, sensor, both) neither hears nor speaks; its drive's watchdog runs on."""

    node: str = "sensor"

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.node, NODES, "node")

    def silent(self, now_s: float) -> Node:
        """While it lasts."""
        return NODES[self.node] if self.active(now_s) else Node.NONE


@dataclass
class DeviceReset(DeviceFault):
    """The `node` restarts at `start` and is silent for `boot` s: the drive wakes disabled, counters start
    at 0."""

    node: str = "drive"
    boot: float = 0.05
    _done: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        _one_of(self.node, NODES, "node")

    def silent(self, now_s: float) -> Node:
        """While it boots."""
        return NODES[self.node] if self.start <= now_s < self.start + self.boot else Node.NONE

    def resets(self, now_s: float) -> Node:
        """Once, at `start`."""
        if self._done or not self.active(now_s):
            return Node.NONE
        self._done = True
        return NODES[self.node]
