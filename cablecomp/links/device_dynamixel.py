"""A joint's drive that is a Dynamixel of the X series, on a serial line of its own kind.

What a cycle sends, after the last drive's command: one write of all goals, one read of all drives. The line is half
duplex: nobody is asked while another's answer may be under way, so drives are set up one after the other.
"""

from __future__ import annotations

from math import isfinite, pi
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links import dynamixel
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, chain, grid
from cablecomp.links.dynamixel import (
    BROADCAST,
    BUS_WATCHDOG,
    INDIRECT_ADDRESS,
    INDIRECT_DATA,
    OPERATING_MODE,
    STATUS_RETURN_LEVEL,
    TOLD,
    TORQUE_ENABLE,
    Item,
)
from cablecomp.links.readings import JointReadings, MessageStats
from cablecomp.links.records import (
    CLIP_POSITION,
    CLIP_TORQUE,
    CLIP_VELOCITY,
    MOTOR_CURRENT,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    TEMPERATURE,
    DriveState,
    Frame,
    Mode,
    MotorCommand,
    Request,
)
from cablecomp.links.rounds import Round
from cablecomp.links.schema import MotorEnd
from cablecomp.links.schema_devices import DynamixelDevice
from cablecomp.links.units import Linear
from cablecomp.signals import Wire

VOLTAGE: Final = "other_bus_voltage_V"
RESTARTED, SILENCED, REFUSED = 0x100, 0x101, 0x102
"""Error codes of ours, beyond the eight bits of the hardware error status."""
_WORDS: Final = {
    RESTARTED: "the drive started afresh",
    SILENCED: "its bus watchdog has stopped it: nothing was heard in time",
    REFUSED: "the drive does not keep what it is set to",
}
_ASK_AGAIN: Final = 20
_MOST_TRIES: Final = 10
_TORQUE_TOP: Final = (1 << 15) - 1
_VELOCITY_TOP: Final = (1 << 31) - 1


class _Kind(NamedTuple):
    """`limit`: the drive's own, beyond which it takes no goal but keeps the last one."""

    mode: int
    goal: Item
    clip: int
    top: int
    limit: Item | None = None


_KINDS: Final = {
    Mode.TORQUE: _Kind(
        dynamixel.CURRENT_MODE, dynamixel.GOAL_CURRENT, CLIP_TORQUE, _TORQUE_TOP, dynamixel.CURRENT_LIMIT
    ),
    Mode.VELOCITY: _Kind(
        dynamixel.VELOCITY_MODE,
        dynamixel.GOAL_VELOCITY,
        CLIP_VELOCITY,
        _VELOCITY_TOP,
        dynamixel.VELOCITY_LIMIT,
    ),
    Mode.POSITION: _Kind(
        dynamixel.EXTENDED_POSITION_MODE, dynamixel.GOAL_POSITION, CLIP_POSITION, dynamixel.POSITION_TOP
    ),
}


class Line:
    """What the drives of one line share: the cycle's goals, and whose turn it is to be asked."""

    def __init__(self) -> None:
        self.round: Round[tuple[Item, bytes] | None] = Round()
        self.owner: int | None = None


def claims(device: DynamixelDevice, end: MotorEnd) -> tuple[Claim, ...]:
    """The drive's number; raises InputError for one that no drive has."""
    if end.node > dynamixel.MOST_NODE:
        raise InputError(f"device `{device.id}`: node {end.node}; 0 to {dynamixel.MOST_NODE} are accepted")
    return (Claim(end.node, "Dynamixel packets"),)


class DynamixelDrive:
    """Encodes commands to, and decodes what comes from, one drive; torque is current times its constant."""

    def __init__(self, device: DynamixelDevice, end: MotorEnd, readings: JointReadings, line: Line) -> None:
        self._node, self._readings, self._line = end.node, readings, line
        self._mode = Mode(end.mode)
        if self._mode not in _KINDS:
            raise InputError(
                f"joint `{readings.name}`: a Dynamixel has no mode `{end.mode}`; accepted: {', '.join(_KINDS)}"
            )
        self._kind = _KINDS[self._mode]
        self._watchdog = round((end.command_timeout_s or 0.0) / dynamixel.WATCHDOG_S)
        if end.command_timeout_s and not 1 <= self._watchdog <= 127:
            raise InputError(
                f"joint `{readings.name}`: motor.command_timeout_s is {end.command_timeout_s:g}; a Dynamixel's bus "
                "watchdog takes 0.02 to 2.54"
            )
        turn, gear = 2.0 * pi, Gear(end)
        position, velocity = turn / dynamixel.COUNTS_PER_TURN, turn * dynamixel.TURNS_PER_S
        per_A = device.torque_constant_Nm_per_A
        self._lines = tuple(
            (place, *chain(Linear(unit), gear.from_shaft(channel)))
            for place, unit, channel in (
                (MOTOR_CURRENT, device.current_unit_A, "motor_current_A"),
                (MOTOR_TORQUE, device.current_unit_A * per_A, "motor_torque_Nm"),
                (MOTOR_VELOCITY, velocity, "motor_velocity_rad_s"),
                (MOTOR_POSITION, position, "motor_position_rad"),
                (readings.index(VOLTAGE), dynamixel.VOLT, VOLTAGE),
                (TEMPERATURE, 1.0, "temperature_degC"),
            )
        )
        readings.motor_step_rad = position / end.gear_ratio
        self._to = {
            Mode.POSITION: chain(gear.position(), Linear(1 / position)),
            Mode.VELOCITY: Linear(gear.velocity() / velocity),
            Mode.TORQUE: Linear(gear.torque() / (device.current_unit_A * per_A)),
        }
        self._stats = MessageStats(f"{readings.name}: {device.id} status")
        readings.messages.append(self._stats)
        self._top = self._kind.top
        self._steps: tuple[tuple[Item, bytes | None], ...] = (
            (STATUS_RETURN_LEVEL, bytes((dynamixel.ANSWER_READS,))),
            (TORQUE_ENABLE, b"\x00"),
            (BUS_WATCHDOG, b"\x00"),
            (OPERATING_MODE, bytes((self._kind.mode,))),
            (Item(INDIRECT_ADDRESS, 2 * TOLD.size), dynamixel.gathering()),
            *([(self._kind.limit, None)] if self._kind.limit else []),
        )
        self._begin()

    # ---- set-up ----------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._at = self._asked = self._tries = 0
        if self._line.owner == self._node:
            self._line.owner = None

    @property
    def _ready(self) -> bool:
        return self._at == len(self._steps)

    def _next(self) -> tuple[Frame, ...]:
        """Of each step the write, which is not answered, then the read that shows it; of a limit the read alone."""
        if self._line.owner not in (None, self._node):
            return ()
        self._line.owner = self._node
        item, data = self._steps[self._at]
        self._asked = self._asked % _ASK_AGAIN + 1
        if self._asked == 1:
            self._tries += 1
            return () if data is None else (self._frame(dynamixel.write_bytes(item.address, data)),)
        return (self._frame(dynamixel.read(item)),) if self._asked == 3 else ()

    def _take_step(self, data: bytes) -> None:
        item, set_to = self._steps[self._at]
        told = set_to is None and len(data) == item.size
        if self._asked >= 3 and (told or data == set_to):
            if told:
                self._top = min(self._kind.top, int.from_bytes(data, "little"))
            self._at += 1
            self._asked = self._tries = 0
            if self._ready:
                self._line.owner = None
        elif self._tries >= _MOST_TRIES:
            self._readings.state, self._readings.error = DriveState.FAULT, REFUSED

    def _frame(self, body: bytes) -> Frame:
        return Frame(self._node, body)

    # ---- what comes ------------------------------------------------------------------------------

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        return (Receiver(self._node, self.take),)

    def take(self, data: bytes, now_s: float) -> int:
        """Take one status: error byte and parameters."""
        stats, readings = self._stats, self._readings
        if not data or data[0] & 0x7F:
            stats.invalid += 1
            return 0
        if not self._ready:
            self._take_step(data[1:])
            return 0
        if len(data) != 1 + TOLD.size:
            stats.invalid += len(data) != 1  # an answer to a write says nothing
            return 0
        level, torque, hardware, watchdog, current, *values = TOLD.unpack_from(data, 1)
        if level != dynamixel.ANSWER_READS:
            readings.state, readings.error = DriveState.FAULT, RESTARTED
            self._begin()
            return 0
        for (place, gain, offset), value in zip(self._lines, (current, current, *values), strict=True):
            readings.values[place] = gain * value + offset
        readings.saturated = CLIP_POSITION if abs(values[1]) >= dynamixel.POSITION_TOP else 0
        readings.error = hardware or (SILENCED if watchdog == dynamixel.WATCHDOG_ERROR else 0)
        state = DriveState.ENABLED if torque else DriveState.DISABLED
        readings.state = DriveState.FAULT if readings.error else state
        readings.take_reply((place for place, _, _ in self._lines), stats, now_s)
        return len(self._lines)

    # ---- what goes -------------------------------------------------------------------------------

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; the drive's gains are its own, and it takes one goal at a time."""
        if command.stiffness_Nm_per_rad is not None or command.damping_Nms_per_rad is not None:
            raise InputError(
                f"joint `{self._readings.name}`: a Dynamixel takes no stiffness or damping with a command; "
                "leave both None; nothing was sent"
            )
        wanted = {
            Mode.POSITION: command.position_rad,
            Mode.VELOCITY: command.velocity_rad_s,
            Mode.TORQUE: command.torque_Nm,
        }
        if not all(map(isfinite, wanted.values())):
            raise InputError(
                f"joint `{self._readings.name}`: {command}; finite numbers are accepted; nothing was sent"
            )
        kind, line = self._kind, self._to[self._mode]
        n = round(line.gain * wanted[self._mode] + line.offset)
        held = min(max(n, -self._top), self._top)
        data = held.to_bytes(kind.goal.size, "little", signed=True)
        return Outgoing(self._round((kind.goal, data)), kind.clip if held != n else 0)

    def _round(self, goal: tuple[Item, bytes] | None) -> tuple[Frame, ...]:
        """Goals and questions of all drives, if nobody else is to come in this cycle and none is being set up."""
        parts = self._line.round.gather(self._node, goal)
        if parts is None or self._line.owner is not None:
            return ()
        goals = {node: part for node, part in parts.items() if part is not None}
        write = (Frame(BROADCAST, dynamixel.write_goals(goals)),) if goals else ()
        return (*write, Frame(BROADCAST, dynamixel.sync_read(INDIRECT_DATA, TOLD.size, list(parts))))

    def wire(self) -> Wire:
        """See `Drive.wire`."""
        modes = (Mode.POSITION, Mode.VELOCITY, Mode.TORQUE)
        return Wire(*(grid(self._to[m], -_KINDS[m].top, _KINDS[m].top) for m in modes))

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; the drive keeps its own gains."""
        return None

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; a hardware error needs a reset, which restarts the drive."""
        if mode is not None and mode is not self._mode:
            raise InputError(
                f"joint `{self._readings.name}`: the drive is set up for mode `{self._mode}`, and was asked for "
                f"`{mode}`; set motor.mode"
            )
        if request == Request.REPORT:
            return self._round(None) if self._ready else self._next()
        off = self._frame(dynamixel.write(TORQUE_ENABLE, 0))
        watch = self._frame(dynamixel.write(BUS_WATCHDOG, self._watchdog))
        frames = {
            Request.ENABLE: (watch, self._frame(dynamixel.write(TORQUE_ENABLE, 1))),
            Request.DISABLE: (off,),
            Request.STOP: (off,),
            Request.CLEAR_FAULTS: (self._frame(dynamixel.write(BUS_WATCHDOG, 0)),),
            Request.RESET: (self._frame(bytes((dynamixel.Instruction.REBOOT,))),),
        }
        return frames.get(request, ())

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        return _WORDS.get(error) or (dynamixel.error_words(error) if error else "")
