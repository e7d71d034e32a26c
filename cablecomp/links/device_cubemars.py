"""A joint's drive that is a CubeMars AK on extended identifiers: servo mode, or force control of a V3 board."""

from __future__ import annotations

from math import pi

from cablecomp.errors import InputError
from cablecomp.links import cubemars
from cablecomp.links.cubemars import MODELS, Function
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, chain, grid, impedance
from cablecomp.links.mit import P_TOP, V_TOP, MitRange
from cablecomp.links.mit_profiles import error_text
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    MOTOR_CURRENT,
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
from cablecomp.links.schema_devices import CubeMarsDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

TEMPERATURE = "other_driver_temperature_degC"
MOST_DEGREES = 3200.0
_SERVO = {
    Mode.POSITION: (Function.POSITION, CLIP_POSITION),
    Mode.VELOCITY: (Function.VELOCITY, CLIP_VELOCITY),
    Mode.TORQUE: (Function.CURRENT, CLIP_TORQUE),
}


def claims(end: MotorEnd) -> tuple[Claim, ...]:
    """Commands to the drive and its status."""
    if end.node > 0xFF:
        raise InputError(f"CubeMars node {end.node}; 0 to 255 are accepted")
    return tuple(
        Claim(cubemars.identifier(f, end.node), f"CubeMars {f.name.lower().replace('_', ' ')}")
        for f in Function
    )


class CubeMarsDrive:
    """Encodes commands to, and decodes the status of, one drive.

    The drive tells neither that it is enabled nor torque: the state is what was asked for last, torque the
    current times `torque_constant_Nm_per_A`.
    """

    def __init__(self, device: CubeMarsDevice, end: MotorEnd, readings: JointReadings) -> None:
        model = MODELS.get(device.model or "")
        turns = device.electrical_turns or (model.electrical_turns if model else 0)
        per_A = device.torque_constant_Nm_per_A or (model.torque_Nm_per_A if model else 0.0)
        if not turns or not per_A:
            raise InputError(
                f"device `{device.id}`: electrical_turns (pole pairs times reduction) and "
                "torque_constant_Nm_per_A of this drive are not known here; state both"
            )
        self._force, self._node, self._readings = device.control == "force", end.node, readings
        self._scale = model.scale if model is not None else MitRange(12.56, 0.0, 0.0)
        if device.range is not None:
            self._scale = MitRange(*(getattr(device.range, name) for name in MitRange._fields))
        elif self._force and model is None:
            raise InputError(f"device `{device.id}`: `model` or `range`; known: {', '.join(MODELS)}")
        self._stats = MessageStats(f"{readings.name}: {device.id} status")
        readings.messages.append(self._stats)
        self._temperature = readings.index(TEMPERATURE)
        self._asked = DriveState.UNKNOWN
        self._share = 1.0
        gear = Gear(end)
        erpm = 2 * pi / 60 / turns
        self._position = chain(Linear(pi / 180), gear.from_shaft("motor_position_rad"))
        readings.motor_step_rad = cubemars.STATUS_STEP_DEG * abs(self._position.gain)
        self._velocity = chain(Linear(erpm), gear.from_shaft("motor_velocity_rad_s")).gain
        self._torque = chain(Linear(per_A), gear.from_shaft("motor_torque_Nm")).gain
        self._current = gear.from_shaft("motor_current_A").gain
        self._to = (gear.position(), Linear(gear.velocity()), Linear(gear.torque()))
        self._to_counts = (
            chain(self._to[0], Linear(cubemars.POSITION_PER_DEG * 180 / pi)),
            chain(self._to[1], Linear(1 / erpm)),
            chain(self._to[2], Linear(cubemars.CURRENT_PER_A / per_A)),
        )
        self._gain = gear.gain()
        self._kp, self._kd = end.stiffness_Nm_per_rad * self._gain, end.damping_Nms_per_rad * self._gain
        self._set_mode(Mode(end.mode))

    def _set_mode(self, mode: Mode) -> None:
        if not self._force and mode not in _SERVO:
            raise InputError(
                f"joint `{self._readings.name}`: servo mode has no `{mode}`; accepted: {', '.join(_SERVO)}, "
                'or control = "force" (V3 boards)'
            )
        if self._force and mode in (Mode.POSITION, Mode.IMPEDANCE) and self._kp <= 0:
            raise InputError(
                f"joint `{self._readings.name}`: motor.stiffness_Nm_per_rad is 0; force control in mode "
                f"`{mode}` needs a positive one"
            )
        self._mode = mode

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        return (Receiver(cubemars.identifier(Function.STATUS, self._node), self.take),)

    def take(self, data: bytes, now_s: float) -> int:
        """Take one status."""
        stats, readings = self._stats, self._readings
        if len(data) != 8:
            stats.invalid += 1
            return 0
        degrees, erpm, amperes, temperature, error = cubemars.parse_status(data)
        values = readings.values
        values[MOTOR_POSITION] = self._position.gain * degrees + self._position.offset
        values[MOTOR_VELOCITY] = self._velocity * erpm
        values[MOTOR_TORQUE] = self._torque * amperes
        values[MOTOR_CURRENT] = self._current * amperes
        values[self._temperature] = float(temperature)
        readings.saturated = CLIP_POSITION if abs(degrees) >= MOST_DEGREES else 0
        readings.state = DriveState.FAULT if error else self._asked
        readings.error = error
        places = (MOTOR_POSITION, MOTOR_VELOCITY, MOTOR_TORQUE, MOTOR_CURRENT, self._temperature)
        readings.take_reply(places, stats, now_s)
        return len(places)

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; servo mode takes no gains with a command."""
        mode = self._mode
        if self._force:
            return self._force_command(command)
        if command.stiffness_Nm_per_rad is not None or command.damping_Nms_per_rad is not None:
            raise InputError(
                f"joint `{self._readings.name}`: servo mode takes no stiffness or damping with a command; "
                "leave both None; nothing was sent"
            )
        function, bit = _SERVO[mode]
        which = (Mode.POSITION, Mode.VELOCITY, Mode.TORQUE).index(mode)
        wanted = (command.position_rad, command.velocity_rad_s, command.torque_Nm)[which]
        line = self._to_counts[which]
        frame, clipped = cubemars.servo(function, self._node, line.gain * wanted + line.offset)
        return Outgoing((frame,), bit if clipped else 0)

    def _force_command(self, command: MotorCommand) -> Outgoing:
        kp, kd = impedance(command, self._mode, (self._kp, self._kd), self._gain, self._share)
        p, v, t = (line.gain * x + line.offset for line, x in zip(self._to, command[:3], strict=True))
        data, clipped = cubemars.force_control(self._scale, self._node, p, v, kp, kd, t)
        return Outgoing((Frame(cubemars.identifier(Function.FORCE_CONTROL, self._node), data),), clipped)

    def wire(self) -> Wire:
        """See `Drive.wire`."""
        if not self._force:
            return Wire(*(grid(line, -cubemars.INT32, cubemars.INT32) for line in self._to_counts))
        tops = ((self._scale[0], P_TOP), (self._scale[1], V_TOP), (self._scale[2], V_TOP))
        return Wire(
            *(
                grid(chain(line, Linear(top / (2 * end), 0.5 * top)), 0, top)
                for line, (end, top) in zip(self._to, tops, strict=True)
            )
        )

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; servo mode keeps its gains."""
        if not self._force:
            return None
        self._share = share
        return ()

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; any command enables, one without force too; faults clear by themselves."""
        if mode is not None:
            self._set_mode(mode)
        if request == Request.ENABLE:
            self._asked = DriveState.ENABLED
            if self._force:
                data = cubemars.force_control(self._scale, self._node, 0.0, 0.0, 0.0, 0.0, 0.0).data
                return (Frame(cubemars.identifier(Function.FORCE_CONTROL, self._node), data),)
            return (cubemars.no_current(self._node),)
        if request in (Request.DISABLE, Request.STOP, Request.REPORT, Request.CLEAR_FAULTS):
            self._asked = DriveState.DISABLED
            return cubemars.let_go(self._node)
        if request == Request.SET_ZERO:
            return (cubemars.set_origin(self._node),)
        return ()

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return error_text("cubemars", error)
