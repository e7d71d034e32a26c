"""What a link needs of a device: which identifiers it listens to, and the frames for a command or a
request."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from cablecomp.links.records import Frame, Mode, MotorCommand, Request
from cablecomp.links.schema import MotorEnd, SensorEnd
from cablecomp.links.units import Linear
from cablecomp.signals import Grid, Wire

Take = Callable[[bytes, float], int]
"""Takes the data of one frame and its arrival time in s; returns how many channel values it brought (0 = not
used)."""


class Receiver(NamedTuple):
    """Who takes the frames of an identifier: all of them where `mask` is 0, else those whose byte 0 says
    `byte & mask == number`, however many share the identifier."""

    identifier: int
    take: Take
    mask: int = 0
    number: int = 0


class Claim(NamedTuple):
    """An identifier that a device sends or takes frames on, and what they are.

    Two devices may share it where both tell themselves apart by byte 0 (same `mask`, not 0, other `number`),
    or where it is a broadcast of one protocol (same `group`, not empty).
    """

    identifier: int
    what: str
    mask: int = 0
    number: int = 0
    group: str = ""


class Outgoing(NamedTuple):
    """Frames of one command, the CLIP_* bits of what had to be saturated, and frames that go along and ask for readings
    alone."""

    frames: tuple[Frame, ...]
    clipped: int
    asking: tuple[Frame, ...] = ()


class Drive(Protocol):
    """A drive of any protocol; commands are at the input pulley."""

    def receivers(self) -> tuple[Receiver, ...]:
        """What it listens to."""

    def command(self, command: MotorCommand) -> Outgoing:
        """Frames of one command in the mode last enabled; raises InputError on NaN or infinity."""

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """Frames of one request; empty if the protocol has none for it. `mode` None leaves the mode as it
        is."""

    def wire(self) -> Wire:
        """What a command in the mode last enabled can carry, at the input pulley."""

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """Stiffness at `share` (0…1) of its own from now on (damping, which only takes speed away, stays):
        frames to send at once, none if it goes with every command; None = the drive keeps its own."""

    def error_text(self, error: int) -> str:
        """The maker's word for an error code, empty for 0."""


class Gear:
    """From the shaft that a drive reports to the input pulley and back.

    `q_in = sign q / ratio - offset`, `dq_in = sign dq / ratio`, `M_in = sign ratio M`, gains at the pulley
    are `ratio^2` times those at the shaft.
    """

    __slots__ = ("_offset", "_ratio", "_sign")

    def __init__(self, end: MotorEnd) -> None:
        self._sign = float(end.sign)
        self._ratio = end.gear_ratio
        self._offset = end.position_offset_rad

    def from_shaft(self, channel: str) -> Linear:
        """How a channel at the pulley comes from the drive's own value; other channels are left as they
        are."""
        if channel == "motor_position_rad":
            return Linear(self._sign / self._ratio, -self._offset)
        if channel == "motor_velocity_rad_s":
            return Linear(self._sign / self._ratio)
        if channel == "motor_torque_Nm":
            return Linear(self._sign * self._ratio)
        return Linear(self._sign if channel == "motor_current_A" else 1.0)

    def position(self) -> Linear:
        """Shaft angle from an angle of the pulley."""
        return Linear(self._sign * self._ratio, self._sign * self._ratio * self._offset)

    def velocity(self) -> float:
        """Shaft velocity per velocity of the pulley."""
        return self._sign * self._ratio

    def torque(self) -> float:
        """Shaft torque per torque at the pulley."""
        return self._sign / self._ratio

    def gain(self) -> float:
        """Stiffness or damping at the shaft per stiffness or damping at the pulley."""
        return 1.0 / self._ratio**2


def impedance(
    command: MotorCommand, mode: Mode, own: tuple[float, float], to_shaft: float, share: float
) -> tuple[float, float]:
    """Stiffness and damping at the shaft that go with a command of a drive which takes them with every command: the
    command's, else the drive's `own` (at the shaft); stiffness at its `share` (`Drive.ease`). No stiffness without a
    position to hold, no damping without a speed."""
    kp = (own[0] if command.stiffness_Nm_per_rad is None else command.stiffness_Nm_per_rad * to_shaft) * share
    kd = own[1] if command.damping_Nms_per_rad is None else command.damping_Nms_per_rad * to_shaft
    if mode == Mode.TORQUE:
        return 0.0, 0.0
    return (0.0 if mode == Mode.VELOCITY else kp), kd


def calibration(end: MotorEnd | SensorEnd, channel: str) -> Linear:
    """How a channel at the joint comes from what the device reports in SI units."""
    if isinstance(end, MotorEnd):
        return Gear(end).from_shaft(channel)
    if channel == "joint_position_rad":
        return Linear(float(end.position_sign), -end.position_offset_rad)
    if channel == "joint_velocity_rad_s":
        return Linear(float(end.position_sign))
    if channel == "joint_torque_Nm":
        return Linear(float(end.torque_sign), -end.torque_offset_Nm)
    return Linear(1.0)


def grid(counts: Linear, low: int, high: int) -> Grid:
    """Values x whose counts `n = gain x + offset` are the whole numbers low…high."""
    ends = sorted(((low - counts.offset) / counts.gain, (high - counts.offset) / counts.gain))
    return Grid(-counts.offset / counts.gain, 1.0 / abs(counts.gain), *ends)


def chain(first: Linear, second: Linear) -> Linear:
    """`second` after `first`."""
    return Linear(second.gain * first.gain, second.gain * first.offset + second.offset)
