"""A joint's drive that is an ODrive (CANSimple); the encoder on its second input may be the joint's."""

from __future__ import annotations

from math import floor, pi
from typing import Final

from cablecomp.errors import InputError
from cablecomp.links import cansimple
from cablecomp.links.cansimple import AxisState, Cmd, Cmd06, ControlMode
from cablecomp.links.cansimple_firmware import FIRMWARES, Datum, error_of, error_words, state_of
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, Take, calibration, chain, grid
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import JOINT_POSITION, DriveState, Frame, Mode, MotorCommand, Request
from cablecomp.links.schema import MotorEnd, SensorEnd
from cablecomp.links.schema_devices import CanSimpleDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

_TURN: Final = 2.0 * pi
_MISSED_HEARTBEATS: Final = 5
_EXTRAS: Final[dict[Datum, tuple[str, ...]]] = {
    "temperature": ("other_motor_temperature_degC",),
    "bus": ("other_bus_voltage_V",),
    "powers": ("other_electrical_power_W", "other_mechanical_power_W"),
}
_MODES: Final = {
    Mode.TORQUE: ControlMode.TORQUE,
    Mode.VELOCITY: ControlMode.VELOCITY,
    Mode.POSITION: ControlMode.POSITION,
}


def extra_channels(device: CanSimpleDevice) -> tuple[str, ...]:
    """Channels beside the common ones that the messages named by the device bring."""
    return tuple(c for d in _EXTRAS if d in (*device.cyclic, *device.polled) for c in _EXTRAS[d])


def claims(end: MotorEnd) -> tuple[Claim, ...]:
    """Every command number of the node, used or not: the ODrive answers to all of them."""
    return tuple(Claim(cansimple.identifier(end.node, n), f"CANSimple command 0x{n:02X}") for n in range(32))


class CanSimpleDrive:
    """Encodes commands to, and decodes messages from, one ODrive axis.

    Motor torque comes from Get_Torques (its estimate), or from the measured Iq times
    `torque_constant_Nm_per_A`.
    """

    def __init__(
        self,
        device: CanSimpleDevice,
        end: MotorEnd,
        readings: JointReadings,
        joint: SensorEnd | None = None,
    ) -> None:
        self._node = end.node
        cansimple.identifier(end.node, 0)
        self._device = device
        self._readings = readings
        self._firmware = FIRMWARES[device.firmware]
        self._patience_s = _MISSED_HEARTBEATS * device.heartbeat_s
        self._silent = False
        self._polled = tuple(cansimple.request(end.node, self._firmware.data[d]) for d in device.polled)
        self._joint = joint
        if joint is not None:
            if device.joint_endpoint is None:
                raise InputError(
                    f"joint `{readings.name}`: the encoder at the joint is on device `{device.id}`; add its "
                    "joint_endpoint, the number of spi_encoder0.raw in the flat_endpoints.json of its firmware"
                )
            self._polled += (cansimple.read_endpoint(end.node, device.joint_endpoint),)
        self._set_mode(Mode(end.mode))
        gear = Gear(end)
        turns = Linear(_TURN)
        self._position = chain(turns, gear.from_shaft("motor_position_rad"))
        self._velocity = chain(turns, gear.from_shaft("motor_velocity_rad_s"))
        self._torque = gear.from_shaft("motor_torque_Nm")
        self._current = gear.from_shaft("motor_current_A")
        to_position = gear.position()
        self._to_turns = Linear(to_position.gain / _TURN, to_position.offset / _TURN)
        self._to_turns_s = gear.velocity() / _TURN
        self._to_torque = gear.torque()

    def _set_mode(self, mode: Mode) -> None:
        if mode not in _MODES:
            raise InputError(
                f"joint `{self._readings.name}`: an ODrive has no mode `{mode}`; "
                f"accepted: {', '.join(_MODES)}"
            )
        self._mode = mode

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        wanted = {*self._device.cyclic, *self._device.polled}
        constant = self._device.torque_constant_Nm_per_A
        of_iq: list[tuple[int, str, Linear]] = [(1, "motor_current_A", self._current)]
        if constant is not None and "torques" not in wanted:
            of_iq.append((1, "motor_torque_Nm", chain(Linear(constant), self._torque)))
        maps: dict[Datum, list[tuple[int, str, Linear]]] = {
            "encoder": [
                (0, "motor_position_rad", self._position),
                (1, "motor_velocity_rad_s", self._velocity),
            ],
            "iq": of_iq,
            "torques": [(1, "motor_torque_Nm", self._torque)],
            "temperature": [(1, _EXTRAS["temperature"][0], Linear(1.0))],
            "bus": [(0, _EXTRAS["bus"][0], Linear(1.0))],
            "powers": [(k, channel, Linear(1.0)) for k, channel in enumerate(_EXTRAS["powers"])],
        }
        heard = self._stats("heartbeat")
        out = [Receiver(cansimple.identifier(self._node, Cmd.HEARTBEAT), self._heartbeat(heard))]
        for name in sorted(wanted):
            identifier = cansimple.identifier(self._node, self._firmware.data[name])
            out.append(Receiver(identifier, self._pair(name, maps[name], heard)))
        if self._joint is not None:
            reply = cansimple.identifier(self._node, Cmd06.TX_SDO)
            out.append(Receiver(reply, self._joint_encoder(self._joint)))
        return tuple(out)

    def _stats(self, name: str) -> MessageStats:
        stats = MessageStats(f"{self._readings.name}: {self._device.id} {name}")
        self._readings.messages.append(stats)
        return stats

    def _heartbeat(self, stats: MessageStats) -> Take:
        readings, firmware = self._readings, self._firmware

        def take(data: bytes, now_s: float) -> int:
            if len(data) != 8:
                stats.invalid += 1
                return 0
            heartbeat = cansimple.parse_heartbeat(data)
            readings.state = state_of(firmware, heartbeat)
            readings.error = error_of(firmware, heartbeat)
            self._silent = False
            stats.received += 1
            stats.last_s = now_s
            return 0

        return take

    def _pair(self, name: Datum, channels: list[tuple[int, str, Linear]], heard: MessageStats) -> Take:
        stats, readings, patience_s = self._stats(name), self._readings, self._patience_s
        places = [(which, readings.index(channel), *line) for which, channel, line in channels]
        values, arrived, updates = readings.values, readings.arrived_s, readings.updates
        is_reply = name == "encoder"

        def take(data: bytes, now_s: float) -> int:
            if len(data) != 8:
                stats.invalid += 1
                return 0
            pair = cansimple.parse_pair(data)
            # NaN and infinity are not equal to themselves times zero
            if pair[0] * 0.0 != 0.0 or pair[1] * 0.0 != 0.0:
                stats.invalid += 1
                return 0
            for which, place, gain, offset in places:
                values[place] = gain * pair[which] + offset
                arrived[place] = now_s
                updates[place] += 1
            if is_reply:
                readings.replies += 1
                readings.unanswered = 0
                if now_s - heard.last_s > patience_s:  # what it told last may not be so any more
                    readings.state, self._silent = DriveState.UNKNOWN, True
            stats.received += 1
            stats.last_s = now_s
            return len(places)

        return take

    def _joint_encoder(self, joint: SensorEnd) -> Take:
        """The joint's encoder tells where in a turn it is, from 0 to 1: the half turn to either side of 0 is
        meant."""
        stats, readings, asked = self._stats("joint encoder"), self._readings, self._device.joint_endpoint
        gain, offset = chain(Linear(_TURN), calibration(joint, "joint_position_rad"))

        def take(data: bytes, now_s: float) -> int:
            if len(data) != 8:
                stats.invalid += 1
                return 0
            number, turns = cansimple.parse_endpoint(data)
            if number != asked:  # somebody else's question
                return 0
            if turns * 0.0 != 0.0:
                stats.invalid += 1
                return 0
            readings.values[JOINT_POSITION] = gain * (turns - floor(turns + 0.5)) + offset
            readings.arrived_s[JOINT_POSITION] = now_s
            readings.updates[JOINT_POSITION] += 1
            stats.received += 1
            stats.last_s = now_s
            return 1

        return take

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; gains are the ODrive's own, so a command with gains is refused."""
        position_rad, velocity_rad_s, torque_Nm, stiffness, damping = command
        if stiffness is not None or damping is not None:
            raise InputError(
                f"joint `{self._readings.name}`: an ODrive takes no stiffness or damping with a command; "
                "leave both None; nothing was sent"
            )
        torque = torque_Nm * self._to_torque
        if self._mode == Mode.POSITION:
            gain, offset = self._to_turns
            frame, clipped = cansimple.set_input_pos(
                self._node, gain * position_rad + offset, velocity_rad_s * self._to_turns_s, torque
            )
        elif self._mode == Mode.VELOCITY:
            frame, clipped = cansimple.set_input_vel(self._node, velocity_rad_s * self._to_turns_s, torque)
        else:
            frame, clipped = cansimple.set_input_torque(self._node, torque)
        return Outgoing((frame,), clipped, self._polled)

    def wire(self) -> Wire:
        """See `Drive.wire`; feed-forwards beside a position are int16 thousandths, all else is float32."""
        if self._mode is not Mode.POSITION:
            return Wire()
        velocity, torque = (
            grid(Linear(1000.0 * gain), -32768, 32767) for gain in (self._to_turns_s, self._to_torque)
        )
        return Wire(velocity=velocity, torque=torque)

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; an ODrive's gains are its own."""
        return None

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; enabling sets mode and limits first; what is sent by itself need not be asked
        for."""
        if mode is not None:
            self._set_mode(mode)
        node, device, firmware = self._node, self._device, self._firmware
        if request == Request.ENABLE:
            frames = [cansimple.set_controller_mode(node, _MODES[self._mode])]
            if device.velocity_limit_turns_s is not None and device.current_limit_A is not None:
                frames.append(
                    cansimple.set_limits(node, device.velocity_limit_turns_s, device.current_limit_A)
                )
            return (*frames, cansimple.set_axis_state(node, AxisState.CLOSED_LOOP))
        if request == Request.DISABLE:
            return (cansimple.set_axis_state(node, AxisState.IDLE),)
        if request == Request.REPORT:
            return self._polled
        if request == Request.STOP:
            return (cansimple.estop(node),)
        if request == Request.CALIBRATE:
            return (cansimple.set_axis_state(node, AxisState.FULL_CALIBRATION),)
        if request == Request.CLEAR_FAULTS:
            return (Frame(cansimple.identifier(node, Cmd.CLEAR_ERRORS), firmware.clear),)
        if request == Request.RESET:
            return (Frame(cansimple.identifier(node, Cmd.REBOOT), firmware.reboot),)
        if firmware.name == "0.6":
            return (cansimple.set_absolute_position(node, 0.0),)
        return (cansimple.set_linear_count(node, 0),)

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        silent = (f"{_MISSED_HEARTBEATS} of its heartbeats stayed out",) if self._silent else ()
        return ", ".join(filter(None, (error_words(self._firmware, error), *silent)))
