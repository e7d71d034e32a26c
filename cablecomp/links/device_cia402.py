"""A joint's drive of profile CiA 402 over CANopen: set up by SDO, commanded and heard by PDO at every SYNC.

What a cycle sends: the drive's command PDO, and SYNC after that of the cycle's last drive; at SYNC every drive
takes its targets over and tells where it is.
"""

from __future__ import annotations

from math import inf, isfinite, pi
from struct import Struct
from typing import Final

from cablecomp.errors import InputError
from cablecomp.links import canopen, cia402
from cablecomp.links.canopen_setup import SetUpDialogue
from cablecomp.links.cia402 import Control
from cablecomp.links.cia402_supervision import REFUSED, Supervision
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, calibration, chain, grid
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    JOINT_POSITION,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    DriveState,
    Frame,
    Mode,
    MotorCommand,
    Request,
)
from cablecomp.links.rounds import Round
from cablecomp.links.schema import MotorEnd, SensorEnd
from cablecomp.links.schema_devices import Cia402Device
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

_TURN: Final = 2.0 * pi
_INT16, _INT32 = (1 << 15) - 1, (1 << 31) - 1
_STATUS: Final = Struct("<Hih")
_MORE: Final = Struct("<iHb")
_SECOND: Final = Struct("<i")


def claims(device: Cia402Device, end: MotorEnd) -> tuple[Claim, ...]:
    """The node's predefined connection set, and what all of CANopen share; raises InputError for a number that no
    node has."""
    if not 1 <= end.node <= 127 or end.node == device.host:
        raise InputError(
            f"device `{device.id}`: node {end.node}; 1 to 127 but the host's {device.host} are accepted"
        )
    own = {
        canopen.EMERGENCY: "emergency",
        canopen.RPDO: "PDO to the drive",
        canopen.SDO_REPLY: "SDO",
        canopen.SDO_REQUEST: "SDO",
        canopen.HEARTBEAT: "heartbeat",
        **dict.fromkeys(canopen.TPDO, "PDO of the drive"),
    }
    shared = {
        canopen.NMT: "NMT",
        canopen.SYNC: "SYNC",
        canopen.HEARTBEAT + device.host: "heartbeat of this side",
    }
    return (
        *(Claim(function + end.node, f"CANopen {what}") for function, what in own.items()),
        *(Claim(i, f"CANopen {what}", group="canopen") for i, what in shared.items()),
    )


def _check(device: Cia402Device, mode: Mode, has_second: bool, joint: str) -> None:
    """Raise InputError for a mode that the profile lacks, or a second encoder without its counts."""
    if mode not in cia402.CYCLIC:
        raise InputError(
            f"joint `{joint}`: CiA 402 has no mode `{mode.value}`; accepted: {', '.join(cia402.CYCLIC)}"
        )
    if has_second and device.joint_encoder_counts_per_turn is None:
        raise InputError(
            f"device `{device.id}`: joint_encoder_counts_per_turn is missing, though it is the sensor of joint "
            f"`{joint}`; state it"
        )


class Cia402Drive:
    """Encodes commands to, and decodes what comes from, one drive.

    The set-up goes on with every request to report, and so does SYNC after it; what comes by PDO before it is done
    is of another set-up, and not used.
    """

    def __init__(
        self,
        device: Cia402Device,
        end: MotorEnd,
        readings: JointReadings,
        round_: Round[None],
        rate_Hz: float,
        joint: SensorEnd | None = None,
    ) -> None:
        self._node, self._host, self._readings, self._device = end.node, device.host, readings, device
        self._round = round_
        self._mode = Mode(end.mode)
        _check(device, self._mode, joint is not None, readings.name)
        self._watch_s = end.command_timeout_s or 0.0
        self._dialogue = SetUpDialogue(
            end.node,
            cia402.steps(
                cia402.SetUp(
                    end.node,
                    device.host,
                    self._mode,
                    device.feed_forward,
                    joint is not None,
                    1.0 / rate_Hz,
                    round(1e3 * device.heartbeat_s),
                    round(1e3 * self._watch_s),
                    round(1e3 * device.rated_torque_Nm),
                )
            ),
        )
        self._scale(Gear(end), joint)
        readings.motor_step_rad = abs(self._position.gain)
        entries = cia402.command_entries(self._mode, device.feed_forward)
        self._feed_forward = len(entries) == 3
        self._pdo = Struct("<H" + "".join({2: "h", 4: "i"}[e.size] for e in entries[1:]))
        self._has_second = joint is not None
        second = ("second encoder",) if self._has_second else ()
        self._stats = {
            name: MessageStats(f"{readings.name}: {device.id} {name}")
            for name in ("status", "velocity", *second, "heartbeat")
        }
        readings.messages += self._stats.values()
        self._sent = (0,) * (len(entries) - 1)
        self._health = Supervision(readings, self._dialogue, cia402.CYCLIC[self._mode], device.heartbeat_s)
        self._now_s, self._told_s = 0.0, -inf

    def _scale(self, gear: Gear, joint: SensorEnd | None) -> None:
        """From the drive's counts to SI units of the joint's motor, and back."""
        device = self._device
        per_turn = device.counts_per_turn / _TURN
        per_turn_s = per_turn
        if device.velocity_counts_per_turn_s is not None:
            per_turn_s = device.velocity_counts_per_turn_s / _TURN
        thousandths = 1e3 / device.rated_torque_Nm
        self._position = chain(Linear(1 / per_turn), gear.from_shaft("motor_position_rad"))
        self._velocity = chain(Linear(1 / per_turn_s), gear.from_shaft("motor_velocity_rad_s"))
        self._torque = chain(Linear(1 / thousandths), gear.from_shaft("motor_torque_Nm"))
        self._to = {
            Mode.POSITION: chain(gear.position(), Linear(per_turn)),
            Mode.VELOCITY: Linear(gear.velocity() * per_turn_s),
            Mode.TORQUE: Linear(gear.torque() * thousandths),
        }
        if joint is not None and device.joint_encoder_counts_per_turn is not None:
            turn = Linear(_TURN / device.joint_encoder_counts_per_turn)
            self._second = chain(turn, calibration(joint, "joint_position_rad"))

    # ---- what comes ------------------------------------------------------------------------------

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        takers = {
            canopen.TPDO[0]: self._take_status,
            canopen.TPDO[1]: self._take_more,
            canopen.EMERGENCY: self._take_emergency,
            canopen.SDO_REPLY: self._take_sdo,
            canopen.HEARTBEAT: self._take_heartbeat,
        }
        if self._has_second:
            takers[canopen.TPDO[2]] = self._take_second
        return tuple(Receiver(function + self._node, take) for function, take in takers.items())

    def _unfit(self, name: str, data: bytes, pdo: Struct) -> bool:
        """Whether a PDO is not to be used: another length, or of a set-up before ours."""
        stats = self._stats[name]
        if len(data) != pdo.size:
            stats.invalid += 1
        return len(data) != pdo.size or not self._dialogue.done

    def _note(self, name: str, place: int, value: float, now_s: float) -> None:
        readings = self._readings
        readings.values[place] = value
        readings.arrived_s[place] = now_s
        readings.updates[place] += 1
        stats = self._stats[name]
        stats.received += 1
        stats.last_s = self._now_s = now_s

    def _take_status(self, data: bytes, now_s: float) -> int:
        if self._unfit("status", data, _STATUS):
            return 0
        statusword, position, torque = _STATUS.unpack(data)
        readings = self._readings
        self._note("status", MOTOR_POSITION, self._position.gain * position + self._position.offset, now_s)
        readings.values[MOTOR_TORQUE] = self._torque.gain * torque
        readings.arrived_s[MOTOR_TORQUE] = now_s
        readings.updates[MOTOR_TORQUE] += 1
        readings.saturated = CLIP_POSITION if abs(position) >= _INT32 else 0
        readings.replies += 1
        readings.unanswered = 0
        self._health.status(statusword, now_s)
        return 2

    def _take_more(self, data: bytes, now_s: float) -> int:
        if self._unfit("velocity", data, _MORE):
            return 0
        velocity, code, mode = _MORE.unpack(data)
        self._note("velocity", MOTOR_VELOCITY, self._velocity.gain * velocity, now_s)
        self._health.more(code, mode)
        return 1

    def _take_second(self, data: bytes, now_s: float) -> int:
        if self._unfit("second encoder", data, _SECOND):
            return 0
        (counts,) = _SECOND.unpack(data)
        self._note("second encoder", JOINT_POSITION, self._second.gain * counts + self._second.offset, now_s)
        return 1

    def _take_emergency(self, data: bytes, now_s: float) -> int:
        told = canopen.parse_emergency(data)
        if told is not None:
            self._health.emergency(told.code)
        return 0

    def _take_sdo(self, data: bytes, now_s: float) -> int:
        reply = canopen.parse_sdo(data)
        if reply is not None:
            self._dialogue.take(reply)
            if self._dialogue.refused:
                self._readings.state, self._readings.error = DriveState.FAULT, REFUSED
        return 0

    def _take_heartbeat(self, data: bytes, now_s: float) -> int:
        stats = self._stats["heartbeat"]
        if len(data) != 1:
            stats.invalid += 1
            return 0
        stats.received += 1
        stats.last_s = now_s
        self._health.heartbeat(data[0] & 0x7F, now_s)
        return 0

    # ---- what goes -------------------------------------------------------------------------------

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; gains are the drive's own, so a command with gains is refused."""
        if command.stiffness_Nm_per_rad is not None or command.damping_Nms_per_rad is not None:
            raise InputError(
                f"joint `{self._readings.name}`: CiA 402 takes no stiffness or damping with a command; "
                "leave both None; nothing was sent"
            )
        if not isfinite(command.position_rad + command.velocity_rad_s + command.torque_Nm):
            raise InputError(
                f"joint `{self._readings.name}`: {command}; finite numbers are accepted; nothing was sent"
            )
        wanted = {
            Mode.POSITION: (command.position_rad, CLIP_POSITION, _INT32),
            Mode.VELOCITY: (command.velocity_rad_s, CLIP_VELOCITY, _INT32),
            Mode.TORQUE: (command.torque_Nm, CLIP_TORQUE, _INT16),
        }
        fields = (self._mode, Mode.TORQUE) if self._feed_forward else (self._mode,)
        counts, clipped = [], 0
        for field in fields:
            value, bit, top = wanted[field]
            n = round(self._to[field].gain * value + self._to[field].offset)
            counts.append(min(max(n, -top), top))
            clipped |= bit if abs(n) > top else 0
        self._sent = tuple(counts)
        frames = [self._frame(self._health.controlword())]
        if self._watch_s and self._now_s - self._told_s >= 0.25 * self._watch_s:
            self._told_s = self._now_s
            frames.append(canopen.alive(self._host))
        if self._round.gather(self._node, None) is not None:
            frames.append(canopen.sync())
        return Outgoing(tuple(frames), clipped)

    def _frame(self, control: Control) -> Frame:
        return Frame(canopen.RPDO + self._node, self._pdo.pack(control, *self._sent))

    def wire(self) -> Wire:
        """See `Drive.wire`."""
        tops = {Mode.POSITION: _INT32, Mode.VELOCITY: _INT32, Mode.TORQUE: _INT16}
        return Wire(*(grid(self._to[m], -top, top) for m, top in tops.items()))

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; the drive keeps its own gains."""
        return None

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; to disable goes by SDO, which is heard in every state of the network; commands climb
        to operation, and clear faults."""
        if mode is not None and mode is not self._mode:
            raise InputError(
                f"joint `{self._readings.name}`: the drive is set up for mode `{self._mode}`, and was asked for "
                f"`{mode}`; set motor.mode"
            )
        if request == Request.REPORT:
            return self._report()
        if request in (Request.DISABLE, Request.STOP):
            self._health.disable()
            if request == Request.STOP:
                return (self._frame(Control.DISABLE_VOLTAGE), canopen.sync())
            if not self._dialogue.done:
                self._dialogue.begin()
                return self._dialogue.next()
            return (canopen.sdo(self._node, canopen.Step(cia402.CONTROLWORD, Control.DISABLE_VOLTAGE)),)
        if request == Request.CLEAR_FAULTS:
            self._health.clear()
        elif request == Request.ENABLE:
            self._health.enable()
        else:
            return ()
        return (self._frame(Control.DISABLE_VOLTAGE),)

    def _report(self) -> tuple[Frame, ...]:
        if self._dialogue.done:
            return () if self._round.gather(self._node, None) is None else (canopen.sync(),)
        frames = self._dialogue.next()
        if self._dialogue.done:
            self._health.set_up()
        return frames

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return self._health.error_text(error)
