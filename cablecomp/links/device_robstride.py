"""A joint's drive that is a RobStride in its own protocol (its MIT protocol is a `mit` device)."""

from __future__ import annotations

from cablecomp.errors import InputError
from cablecomp.links import robstride
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, Take, chain, grid, impedance
from cablecomp.links.mit import P_TOP, MitRange
from cablecomp.links.mit_profiles import profile
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    DriveState,
    Frame,
    Mode,
    MotorCommand,
    Request,
)
from cablecomp.links.robstride import DriveMode, Kind
from cablecomp.links.schema import MotorEnd
from cablecomp.links.schema_devices import RobStrideDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

TEMPERATURE = "other_motor_temperature_degC"
_STATES = {
    DriveMode.RESET: DriveState.DISABLED,
    DriveMode.CALIBRATION: DriveState.CALIBRATING,
    DriveMode.RUN: DriveState.ENABLED,
}


def claims(device: RobStrideDevice, end: MotorEnd) -> tuple[Claim, ...]:
    """Messages to the drive, and its status in every state."""
    if not 1 <= end.node <= 0xFF:
        raise InputError(f"device `{device.id}`: node {end.node}; 1 to 255 are accepted")
    to = [Claim(robstride.identifier(k, device.host, end.node), f"RobStride {k.name}") for k in Kind]
    told = robstride.status_identifiers(end.node, device.host)
    return (*to, *(Claim(i, "RobStride status") for i in told))


class RobStrideDrive:
    """Encodes commands to, and decodes the status of, one drive; state and faults stand in the status's
    identifier."""

    def __init__(self, device: RobStrideDevice, end: MotorEnd, readings: JointReadings) -> None:
        known = profile(device.model)
        if known.family != "robstride":
            raise InputError(
                f"device `{device.id}`: `{device.model}` is no RobStride; RS00 to RS06 are accepted"
            )
        self._scale: MitRange = known.scale
        self._node, self._host, self._readings = end.node, device.host, readings
        self._stats = MessageStats(f"{readings.name}: {device.id} status")
        readings.messages.append(self._stats)
        self._temperature = readings.index(TEMPERATURE)
        self._mode, self._share = Mode(end.mode), 1.0
        gear = Gear(end)
        p, v, t, _, _ = self._scale
        channels = ("motor_position_rad", "motor_velocity_rad_s", "motor_torque_Nm")
        self._lines = tuple(
            chain(Linear(2 * top / P_TOP, -top), gear.from_shaft(c))
            for top, c in zip((p, v, t), channels, strict=True)
        )
        self._to = (gear.position(), Linear(gear.velocity()), Linear(gear.torque()))
        self._gain = gear.gain()
        self._kp, self._kd = end.stiffness_Nm_per_rad * self._gain, end.damping_Nms_per_rad * self._gain
        if self._mode in (Mode.POSITION, Mode.IMPEDANCE) and self._kp <= 0:
            raise InputError(
                f"joint `{readings.name}`: motor.stiffness_Nm_per_rad is 0; a RobStride in mode "
                f"`{self._mode}` needs a positive one"
            )

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        told = robstride.status_identifiers(self._node, self._host)
        return tuple(Receiver(i, self._status(mode, faults)) for i, (mode, faults) in told.items())

    def _status(self, mode: DriveMode, faults: int) -> Take:
        stats, readings, lines = self._stats, self._readings, self._lines
        state = DriveState.FAULT if faults else _STATES[mode]
        places = (MOTOR_POSITION, MOTOR_VELOCITY, MOTOR_TORQUE, self._temperature)

        def take(data: bytes, now_s: float) -> int:
            if len(data) != 8:
                stats.invalid += 1
                return 0
            p, v, t, temperature = robstride.parse_status(data)
            for place, line, n in zip(places, lines, (p, v, t), strict=False):
                readings.values[place] = line.gain * n + line.offset
            readings.values[self._temperature] = temperature
            ends = zip((p, v, t), (CLIP_POSITION, CLIP_VELOCITY, CLIP_TORQUE), strict=True)
            readings.saturated = sum(bit for n, bit in ends if n in (0, P_TOP))
            readings.state, readings.error = state, faults
            readings.take_reply(places, stats, now_s)
            return len(places)

        return take

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`."""
        kp, kd = impedance(command, self._mode, (self._kp, self._kd), self._gain, self._share)
        p, v, t = (line.gain * x + line.offset for line, x in zip(self._to, command[:3], strict=True))
        frame, clipped = robstride.control(self._scale, self._node, p, v, kp, kd, t)
        return Outgoing((frame,), clipped)

    def wire(self) -> Wire:
        """See `Drive.wire`."""
        return Wire(
            *(
                grid(chain(line, Linear(P_TOP / (2 * top), 0.5 * P_TOP)), 0, P_TOP)
                for line, top in zip(self._to, self._scale[:3], strict=True)
            )
        )

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; gains go with every command."""
        self._share = share
        return ()

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; the drive answers a request to stop with its status."""
        if mode is not None:
            self._mode = mode
        node, host = self._node, self._host
        if request == Request.ENABLE:
            return (
                robstride.write(node, host, robstride.RUN_MODE, 0),
                robstride.ask(Kind.ENABLE, node, host),
            )
        if request in (Request.DISABLE, Request.STOP, Request.REPORT):
            return (robstride.ask(Kind.STOP, node, host),)
        if request == Request.CLEAR_FAULTS:
            return (robstride.ask(Kind.STOP, node, host, 1),)
        if request == Request.SET_ZERO:
            return (robstride.ask(Kind.SET_ZERO, node, host, 1),)
        return ()

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return robstride.fault_words(error)
