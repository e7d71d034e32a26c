"""A joint's drive that is a moteus; the encoder on its second input may be the joint's."""

from __future__ import annotations

from math import floor, isfinite, nan, pi
from typing import Final

from cablecomp.errors import InputError
from cablecomp.links import moteus
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, calibration, chain
from cablecomp.links.moteus import FAULTS, Register, ServoMode
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    JOINT_POSITION,
    JOINT_VELOCITY,
    MOTOR_CURRENT,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    Frame,
    Mode,
    MotorCommand,
    Request,
)
from cablecomp.links.schema import MotorEnd, SensorEnd
from cablecomp.links.schema_devices import MoteusDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

EXTRAS: Final = ("other_driver_temperature_degC", "other_bus_voltage_V")
_TURN: Final = 2.0 * pi
_TORQUE_LIMITED: Final = 96


def claims(device: MoteusDevice, end: MotorEnd) -> tuple[Claim, ...]:
    """Frames to the drive, with and without a reply, and its replies; raises InputError for a number that no
    moteus has."""
    if not 1 <= end.node <= 127:
        raise InputError(f"device `{device.id}`: node {end.node}; 1 to 127 are accepted")
    to = (moteus.identifier(end.node, device.host, reply) for reply in (True, False))
    told = moteus.reply_identifiers(end.node, device.host)
    return (
        *(Claim(moteus.number(i), "moteus commands") for i in to),
        *(Claim(moteus.number(i), "moteus replies") for i in told),
    )


class MoteusDrive:
    """Encodes commands to, and decodes replies of, one moteus; every command asks for a reply.

    Stiffness and damping of a command are parts of the drive's own gains, which have to be stated for that; the
    manual says that the share of damping is held to that of stiffness, the firmware applies both.
    """

    def __init__(
        self, device: MoteusDevice, end: MotorEnd, readings: JointReadings, joint: SensorEnd | None = None
    ) -> None:
        self._node, self._host, self._readings, self._device = end.node, device.host, readings, device
        self._stats = MessageStats(f"{readings.name}: {device.id} reply")
        readings.messages.append(self._stats)
        self._share = 1.0
        gear, turns = Gear(end), Linear(_TURN)
        gain = gear.gain() * _TURN
        self._gains = (
            None
            if device.kp_Nm_per_turn is None or device.kd_Nms_per_turn is None
            else (gain / device.kp_Nm_per_turn, gain / device.kd_Nms_per_turn)
        )
        self._own = (end.stiffness_Nm_per_rad, end.damping_Nms_per_rad)
        self._top = nan if device.torque_limit_Nm is None else device.torque_limit_Nm
        self._to_turns = chain(gear.position(), Linear(1 / _TURN))
        self._to_turns_s, self._to_torque = gear.velocity() / _TURN, gear.torque()
        self._query = moteus.QUERY
        lines: dict[int, tuple[int, Linear]] = {
            Register.POSITION: (MOTOR_POSITION, chain(turns, gear.from_shaft("motor_position_rad"))),
            Register.VELOCITY: (MOTOR_VELOCITY, chain(turns, gear.from_shaft("motor_velocity_rad_s"))),
            Register.TORQUE: (MOTOR_TORQUE, gear.from_shaft("motor_torque_Nm")),
            Register.CURRENT: (MOTOR_CURRENT, gear.from_shaft("motor_current_A")),
            Register.TEMPERATURE: (readings.index(EXTRAS[0]), Linear(1.0)),
            Register.VOLTAGE: (readings.index(EXTRAS[1]), Linear(1.0)),
        }
        self._slot = -1
        if joint is not None:
            self._slot = slot = device.joint_encoder
            self._query += moteus.query_encoder(slot)
            position, velocity = (
                calibration(joint, "joint_position_rad"),
                calibration(joint, "joint_velocity_rad_s"),
            )
            lines[Register.ENCODER_0 + 2 * slot] = (JOINT_POSITION, chain(turns, position))
            lines[Register.ENCODER_0 + 2 * slot + 1] = (JOINT_VELOCITY, chain(turns, velocity))
        self._lines = {register: (place, *line) for register, (place, line) in lines.items()}
        self._set_mode(Mode(end.mode))

    def _set_mode(self, mode: Mode) -> None:
        if mode is Mode.IMPEDANCE and (self._gains is None or self._own[0] <= 0):
            raise InputError(
                f"joint `{self._readings.name}`: a moteus in mode `impedance` needs its own kp_Nm_per_turn and "
                "kd_Nms_per_turn on the device, and motor.stiffness_Nm_per_rad above 0"
            )
        self._mode = mode

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        told = moteus.reply_identifiers(self._node, self._host)
        return tuple(Receiver(i, self.take) for i in told)

    def take(self, data: bytes, now_s: float) -> int:
        """Take one reply."""
        stats, readings = self._stats, self._readings
        try:
            found = moteus.parse(data)
        except InputError:
            stats.invalid += 1
            return 0
        self._judge_encoder(found)
        taken = 0
        for register, value in found.items():
            line = self._lines.get(register)
            if line is None or value * 0.0 != 0.0:  # NaN and infinity
                continue
            place, gain, offset = line
            readings.values[place] = gain * value + offset
            readings.arrived_s[place] = now_s
            readings.updates[place] += 1
            taken += 1
        mode = found.get(Register.MODE)
        if mode is not None and mode * 0.0 == 0.0:
            readings.state = moteus.state_of(int(mode))
            fault = int(found.get(Register.FAULT, 0))
            readings.error = int(mode) if mode == ServoMode.TIMEOUT else fault * (fault < _TORQUE_LIMITED)
            readings.replies += 1
            readings.unanswered = 0
        stats.received += 1
        stats.last_s = now_s
        return taken

    def _judge_encoder(self, found: dict[int, float]) -> None:
        """The joint's encoder tells where in a turn it is, from 0 to 1: the half turn to either side of 0 is
        meant; what it says is left out while the drive calls it invalid."""
        if self._slot < 0:
            return
        register = Register.ENCODER_0 + 2 * self._slot
        valid = int(found.get(Register.ENCODER_VALIDITY, 0)) >> 2 * self._slot
        if not valid & 1:
            found.pop(register, None)
        elif isfinite(turns := found.get(register, nan)):
            found[register] = turns - floor(turns + 0.5)
        if not valid & 2:
            found.pop(register + 1, None)

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`."""
        position, velocity, torque, stiffness, damping = command
        mode, kp, kd, integral = self._mode, 0.0, 0.0, 0.0
        if not isfinite(position + velocity + torque):
            raise InputError(
                f"joint `{self._readings.name}`: {command}; finite numbers are accepted; nothing was sent"
            )
        turns = self._to_turns.gain * position + self._to_turns.offset
        if mode is Mode.TORQUE:
            turns, velocity = nan, 0.0
        elif mode is Mode.VELOCITY:
            turns, kp, kd, integral = nan, 1.0, 1.0, 1.0
        elif mode is Mode.POSITION and stiffness is None and damping is None and self._own[0] == 0.0:
            kp = kd = integral = 1.0
        elif self._gains is None:
            raise InputError(
                f"joint `{self._readings.name}`: stiffness and damping need kp_Nm_per_turn and kd_Nms_per_turn "
                f"of device `{self._device.id}`; state both; nothing was sent"
            )
        else:
            kp = self._gains[0] * (self._own[0] if stiffness is None else stiffness)
            kd = self._gains[1] * (self._own[1] if damping is None else damping)
        data = moteus.position_mode(
            turns,
            self._to_turns_s * velocity,
            self._to_torque * torque,
            kp * self._share,
            kd,
            self._top,
            integral,
        )
        return Outgoing((moteus.frame(self._node, self._host, data + self._query),), 0)

    def wire(self) -> Wire:
        """See `Drive.wire`; float32."""
        return Wire()

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; gains go with every command."""
        self._share = share
        return ()

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; the drive leaves fault and time-out only by a stop."""
        if mode is not None:
            self._set_mode(mode)
        data = {
            Request.ENABLE: moteus.no_force(),
            Request.DISABLE: moteus.stop(),
            Request.STOP: moteus.stop(),
            Request.CLEAR_FAULTS: moteus.stop(),
            Request.SET_ZERO: moteus.set_position(0.0),
            Request.REPORT: b"",
        }.get(request)
        return () if data is None else (moteus.frame(self._node, self._host, data + self._query),)

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return FAULTS.get(error, f"fault {error}") if error else ""
