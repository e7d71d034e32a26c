"""A joint's drive that speaks the MIT frame."""

from __future__ import annotations

from typing import get_args

from cablecomp.errors import InputError
from cablecomp.links import mit
from cablecomp.links.damiao_registers import REGISTERS
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, Take, chain, grid, impedance
from cablecomp.links.mit import MitRange, reply_counts, saturation
from cablecomp.links.mit_profiles import Family, error_text, profile, status_of
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    DriveState,
    Frame,
    Mode,
    MotorCommand,
    Request,
)
from cablecomp.links.schema import MotorEnd
from cablecomp.links.schema_devices import MitDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

MOTOR_TEMPERATURE = "other_motor_temperature_degC"


def extra_channels(device: MitDevice) -> tuple[str, ...]:
    """Channels beside the common ones: the motor's temperature, where the reply has it."""
    return (MOTOR_TEMPERATURE,) if _reply_length(device) > 6 else ()


def _reply_length(device: MitDevice) -> int:
    if device.reply_length is not None:
        return device.reply_length
    if device.model is not None:
        return profile(device.model).reply_length
    return 6 if device.family == "katz" else 8


def family_of(device: MitDevice) -> Family:
    """Whose firmware a device has: as stated, else its model's."""
    if device.family is not None:
        return device.family
    if device.model is None:
        raise InputError(f"device `{device.id}`: no family; {', '.join(get_args(Family))} are accepted")
    return profile(device.model).family


def reply_receiver(device: MitDevice, end: MotorEnd, take: Take) -> Receiver:
    """Who takes a drive's replies. Identifier, unless the link gives one: CubeMars the drive number, Damiao
    drive number + 0x10 (the maker's advice for the master's identifier), RobStride 0xFD (its host number as
    delivered), Katz 0."""
    family = family_of(device)
    default = {"cubemars": end.node, "damiao": end.node + 0x10, "katz": 0, "robstride": 0xFD}[family]
    mask = 0x0F if family == "damiao" else 0xFF
    return Receiver(end.reply_id if end.reply_id is not None else default, take, mask, end.node & mask)


def claims(device: MitDevice, end: MotorEnd) -> tuple[Claim, ...]:
    """Commands to the drive and its replies; raises InputError for a number that is no 11-bit identifier."""
    if end.node > 0x7FF:
        raise InputError(
            f"device `{device.id}`: node {end.node}; 0 to 2047 are accepted (11-bit identifiers)"
        )
    reply = reply_receiver(device, end, lambda data, now_s: 0)
    found = (
        Claim(end.node, "MIT commands"),
        Claim(reply.identifier, "MIT replies", reply.mask, reply.number),
    )
    if family_of(device) != "damiao":
        return found
    own = ((0x100, "position"), (0x200, "velocity")) if device.native else ()
    modes = (Claim(base + end.node, f"Damiao {name} commands") for base, name in own)
    return (*found, *modes, Claim(REGISTERS, "Damiao registers", group="damiao"))


class MitDrive:
    """Encodes commands and decodes replies of one drive.

    CubeMars, RobStride and Katz do not say whether the motor mode is on: the state is then what was asked for
    last, once a reply has come.
    """

    def __init__(self, device: MitDevice, end: MotorEnd, readings: JointReadings) -> None:
        base = profile(device.model) if device.model is not None else None
        given = device.range
        if given is not None:
            self._scale = MitRange(*(getattr(given, name) for name in MitRange._fields))
        elif base is not None:
            self._scale = base.scale
        self._family = family_of(device)
        self._length = _reply_length(device)
        self._node = end.node
        self._receiver = reply_receiver(device, end, self.take)
        self._readings = readings
        self._stats = MessageStats(f"{readings.name}: {device.id} reply")
        readings.messages.append(self._stats)
        self._temperature = readings.index(MOTOR_TEMPERATURE) if self._length > 6 else -1
        self._asked = DriveState.UNKNOWN
        self._mode = Mode(end.mode)
        self._share = 1.0
        self._prepare(Gear(end), end)
        if self._mode in (Mode.POSITION, Mode.IMPEDANCE) and self._kp <= 0 and not device.native:
            raise InputError(
                f"joint `{readings.name}`: motor.stiffness_Nm_per_rad is 0; a MIT drive in mode "
                f"`{self._mode}` needs a positive one"
            )

    def _prepare(self, gear: Gear, end: MotorEnd) -> None:
        p, v, t, _, _ = self._scale
        position, velocity, torque = (
            gear.from_shaft(c) for c in ("motor_position_rad", "motor_velocity_rad_s", "motor_torque_Nm")
        )
        # value = gain * count + offset, calibration and count-to-value in one
        self._p = (position.gain * 2 * p / mit.P_TOP, position.offset - position.gain * p)
        self._readings.motor_step_rad = abs(self._p[0])
        self._v = (velocity.gain * 2 * v / mit.V_TOP, -velocity.gain * v)
        self._t = (torque.gain * 2 * t / mit.V_TOP, -torque.gain * t)
        self._to_position = gear.position()
        self._to_velocity, self._to_torque, self._to_gain = gear.velocity(), gear.torque(), gear.gain()
        self._kp = end.stiffness_Nm_per_rad * self._to_gain
        self._kd = end.damping_Nms_per_rad * self._to_gain

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        return (self._receiver,)

    def take(self, data: bytes, now_s: float) -> int:
        """Take one reply."""
        stats, readings = self._stats, self._readings
        if len(data) != self._length:
            stats.invalid += 1
            return 0
        if self._family == "robstride" and not any(data[3:]):
            return self._take_faults(data, now_s)
        word = int.from_bytes(data, "big") >> 8 * (self._length - 6)
        values, arrived, updates = readings.values, readings.arrived_s, readings.updates
        if self._length > 6:
            place = self._temperature
            values[place] = self._degrees(data)
            arrived[place] = now_s
            updates[place] += 1
        n_p, n_v, n_t = reply_counts(word)
        values[MOTOR_POSITION] = n_p * self._p[0] + self._p[1]
        values[MOTOR_VELOCITY] = n_v * self._v[0] + self._v[1]
        values[MOTOR_TORQUE] = n_t * self._t[0] + self._t[1]
        readings.saturated = saturation(n_p, n_v, n_t)
        _, state, error = status_of(self._family, data[0], data[7] if self._length == 8 else None)
        readings.state = self._asked if state is DriveState.UNKNOWN else state
        readings.error = error
        readings.take_reply((MOTOR_POSITION, MOTOR_VELOCITY, MOTOR_TORQUE), stats, now_s)
        return 4 if self._length > 6 else 3

    def _degrees(self, data: bytes) -> float:
        """Temperature: Damiao byte 7 (byte 6 is the MOSFETs'), RobStride tenths in bytes 6 and 7, CubeMars an
        int8 in byte 6."""
        if self._family == "damiao":
            return float(data[7])
        if self._family == "robstride" and self._length == 8:
            return 0.1 * (data[6] << 8 | data[7])
        return float(data[6] - 256 * (data[6] >> 7))

    def _take_faults(self, data: bytes, now_s: float) -> int:
        """A RobStride drive's faults, in a frame of their own: bits in bytes 1 and 2, zeros after them."""
        faults = data[1] | data[2] << 8
        readings, stats = self._readings, self._stats
        if faults:
            readings.state = DriveState.FAULT
        readings.error = faults
        stats.received += 1
        stats.last_s = now_s
        return 0

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`."""
        position_rad, velocity_rad_s, torque_Nm, _, _ = command
        kp, kd = impedance(command, self._mode, (self._kp, self._kd), self._to_gain, self._share)
        gain, offset = self._to_position
        data, clipped = mit.pack_command(
            self._scale,
            gain * position_rad + offset,
            velocity_rad_s * self._to_velocity,
            kp,
            kd,
            torque_Nm * self._to_torque,
        )
        return Outgoing((Frame(self._node, data),), clipped)

    def wire(self) -> Wire:
        """See `Drive.wire`; counts from 0 at the lower end of each range."""
        p, v, t, _, _ = self._scale
        counts = ((p, mit.P_TOP), (v, mit.V_TOP), (t, mit.V_TOP))
        lines = (self._to_position, Linear(self._to_velocity), Linear(self._to_torque))
        return Wire(
            *(
                grid(chain(line, Linear(top / (2 * end), 0.5 * top)), 0, top)
                for line, (end, top) in zip(lines, counts, strict=True)
            )
        )

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; gains go with every command."""
        self._share = share
        return ()

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; a CubeMars drive has no frame to clear faults: leaving and entering the mode
        does it. A drive answers every frame, so one that is not to move reports when it is told to let go."""
        if mode is not None:
            self._mode = mode
        if request == Request.ENABLE:
            self._asked = DriveState.ENABLED
            return (Frame(self._node, mit.ENTER),)
        if request in (Request.DISABLE, Request.STOP, Request.REPORT):
            self._asked = DriveState.DISABLED
            return (Frame(self._node, mit.EXIT),)
        if request == Request.SET_ZERO:
            return (Frame(self._node, mit.ZERO),)
        if request == Request.CLEAR_FAULTS:
            self._asked = DriveState.DISABLED
            has_one = self._family in ("damiao", "robstride")
            return (Frame(self._node, mit.CLEAR if has_one else mit.EXIT),)
        return ()

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return error_text(self._family, error)
