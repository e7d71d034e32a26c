"""Devices that a DBC table describes: their messages to channels, commands and requests to their messages."""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.links import dbc
from cablecomp.links.dbc import Field, Layout
from cablecomp.links.dbc_source import ALWAYS, Entry, Source, Status
from cablecomp.links.devices import Claim, Gear, Outgoing, Receiver, calibration, chain, grid
from cablecomp.links.readings import DeviceClock, JointReadings
from cablecomp.links.records import CHANNELS, DriveState, Frame, Mode, MotorCommand, Request
from cablecomp.links.schema import MotorEnd, SensorEnd
from cablecomp.links.schema_devices import DbcDevice, DbcMessage, DbcRequest, StateSource
from cablecomp.links.units import Linear, quantity_of, to_si
from cablecomp.signals import Grid, Wire

_PARTS: Final = ("position", "velocity", "torque", "stiffness", "damping")
_QUANTITIES: Final = ("rad", "rad_s", "Nm", "Nm_per_rad", "Nms_per_rad")


def extra_channels(device: DbcDevice) -> tuple[str, ...]:
    """Channels beside the common ones that the device's messages name."""
    return tuple(c for m in device.message for c in m.channels if c not in CHANNELS)


def claims(device: DbcDevice, end: MotorEnd | SensorEnd, folder: Path) -> tuple[Claim, ...]:
    """Every message that the link names."""
    names = [m.name for m in device.message] + [r.message for r in device.request.values()]
    if device.command is not None:
        names.append(device.command.message)
    found = [dbc.layout(folder / device.dbc, n.replace("{node}", str(end.node))) for n in names]
    return tuple(Claim(layout.identifier, f"message {layout.name}") for layout in found)


def build_sources(
    device: DbcDevice, end: MotorEnd | SensorEnd, folder: Path, readings: JointReadings
) -> tuple[Receiver, ...]:
    """Receivers for every message of a device; raises InputError with one line where table and mapping
    disagree."""
    path, made = folder / device.dbc, {}
    for message in device.message:
        layout = dbc.layout(path, message.name.replace("{node}", str(end.node)))
        where = f"device `{device.id}`, message `{layout.name}`"
        sequence = None if message.sequence is None else dbc.field_of(layout, message.sequence, where)
        made[message.name] = (
            layout,
            Source(layout, readings, _entries(message, layout, end, readings, where), sequence),
        )
    for message in device.message:
        layout, source = made[message.name]
        source.status = _status(message, layout, {k: v[1] for k, v in made.items()}, device.id)
    return tuple(Receiver(layout.identifier, source.take) for layout, source in made.values())


def _entries(
    message: DbcMessage, layout: Layout, end: MotorEnd | SensorEnd, readings: JointReadings, where: str
) -> dict[int, tuple[Entry, ...]]:
    groups: dict[int, list[Entry]] = {}
    for channel, source in message.channels.items():
        field = dbc.field_of(layout, source.signal, where)
        unit = field.unit if source.unit is None else source.unit
        si = to_si(quantity_of(channel), unit, f"{where}, channel `{channel}`")
        line = chain(Linear(field.scale, field.offset), si)
        line = chain(chain(line, Linear(source.gain, source.offset)), calibration(end, channel))
        if source.absent == "lowest" and not field.sign:
            raise InputError(
                f"{where}, channel `{channel}`: absent `lowest` needs a signed signal; give counts"
            )
        absent = -field.sign if source.absent == "lowest" else source.absent
        place = readings.index(channel)
        entry = Entry(place, field.big, field.shift, field.mask, field.sign, field.real, *line, absent)
        for selected in field.multiplex or (ALWAYS,):
            groups.setdefault(selected, []).append(entry)
    common = groups.get(ALWAYS, [])
    if len(groups) > 1 or (groups and ALWAYS not in groups):
        chosen = {k: (*common, *v) for k, v in groups.items() if k != ALWAYS}
        return {k: tuple(v) for k, v in chosen.items()}
    return {ALWAYS: tuple(common)}


def _status(message: DbcMessage, layout: Layout, sources: dict[str, Source], device: str) -> Status | None:
    where = f"device `{device}`, message `{layout.name}`"

    def find(name: str | None) -> Field | None:
        return None if name is None else dbc.field_of(layout, name, where)

    state = find(message.state.signal) if message.state is not None else None
    time, error, flags = find(message.device_time), find(message.error), find(message.flags)
    if not message.reply and state is time is error is flags is None:
        return None
    clock = None
    if time is not None:
        clock = DeviceClock(to_si("s", time.unit, where).gain * time.scale, time.mask.bit_length())
    stamps = None
    if message.stamps is not None:
        stamps = sources.get(message.stamps)
        if stamps is None:
            raise InputError(
                f"{where}: stamps `{message.stamps}`, which the device does not list; "
                f"accepted: {', '.join(sources)}"
            )
    states = {} if message.state is None else _states(message.state, layout, where)
    return Status(
        state, states, error, flags, time, clock, stamps, find(message.stamps_sequence), message.reply
    )


def _states(source: StateSource, layout: Layout, where: str) -> dict[int, DriveState]:
    field = dbc.field_of(layout, source.signal, where)
    named = {
        DriveState.DISABLED: source.disabled,
        DriveState.CALIBRATING: source.calibrating,
        DriveState.ENABLED: source.enabled,
        DriveState.FAULT: source.fault,
    }
    return {
        dbc.raw(field, dbc.choice(layout, source.signal, value, where))[0]: state
        for state, values in named.items()
        for value in values
    }


class _Part(NamedTuple):
    """One part of a command: its place in `MotorCommand`, counts = `gain x + offset` within `low` and `high`.

    `shift`: up to the field in the message read as one integer, Intel's way; `~shift` if it lies Motorola's
    way. `field`: for a float, whose counts are its bits, else None.
    """

    which: int
    gain: float
    offset: float
    low: int
    high: int
    shift: int
    mask: int
    field: Field | None


class DbcDrive:
    """Encodes commands to, and decodes messages from, a drive that a table describes.

    Stiffness and damping go with every command where the command message has signals for them; otherwise they
    are those of the enable request (`{stiffness}`, `{damping}`), and a command that brings others is refused.
    """

    def __init__(self, device: DbcDevice, end: MotorEnd, folder: Path, readings: JointReadings) -> None:
        if device.command is None:
            raise InputError(
                f"device `{device.id}` moves joint `{readings.name}` but has no `command`; "
                "add [device.command]"
            )
        self._device, self._path, self._end = device, folder / device.dbc, end
        self._where = f"device `{device.id}`"
        self._name = readings.name
        self._receivers = build_sources(device, end, folder, readings)
        self._mode = Mode(end.mode)
        self._gains = self._own = (end.stiffness_Nm_per_rad, end.damping_Nms_per_rad)
        self._enabled = False
        gear = Gear(end)
        self._to_shaft = (
            gear.position(),
            *(Linear(g) for g in (gear.velocity(), gear.torque(), gear.gain(), gear.gain())),
        )
        self._command = self._layout(device.command.message)
        self._parts = self._command_parts()
        self._start = int.from_bytes(self._constants(), "little")
        self._requests = dict[str, DbcRequest](device.request.items())
        for request in self._requests:
            self._encode_request(request)

    def _layout(self, message: str) -> Layout:
        return dbc.layout(self._path, message.replace("{node}", str(self._end.node)))

    def _line(self, which: int, field: Field, where: str) -> Linear:
        """Counts of a field from a part of a command in SI units at the pulley."""
        si = to_si(_QUANTITIES[which], field.unit, where)
        back = Linear(1.0 / (si.gain * field.scale), -field.offset / field.scale)
        return chain(self._to_shaft[which], back)

    def _command_parts(self) -> tuple[_Part, ...]:
        command, parts = self._device.command, []
        for which, part in enumerate(_PARTS):
            signal = getattr(command, part)
            if signal is None:
                continue
            where = f"{self._where}, command `{self._command.name}`, {part}"
            field = dbc.field_of(self._command, signal, where)
            line = self._line(which, field, where)
            shift = ~field.shift if field.big else field.shift
            real = field if field.real else None
            parts.append(_Part(which, *line, field.low, field.high, shift, field.mask, real))
        if not parts:
            raise InputError(f"{self._where}: [device.command] names no signal; name at least one")
        return tuple(parts)

    def _constants(self) -> bytes:
        if self._device.command is None:
            return b""
        where = f"{self._where}, command `{self._command.name}`"
        constants = self._device.command.constants
        return dbc.encode(
            self._command, {k: dbc.choice(self._command, k, v, where) for k, v in constants.items()}
        ).data

    def receivers(self) -> tuple[Receiver, ...]:
        """See `Drive.receivers`."""
        return self._receivers

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; raises InputError on NaN or infinity, and for gains that the message cannot
        carry."""
        length = self._command.length
        little, big = self._start, 0
        clipped = 0
        for which, gain, offset, low, high, shift, mask, field in self._parts:
            x = command[which]
            if x is None:
                x = self._gains[which - 3]
            if x * 0.0 != 0.0:
                raise InputError(
                    f"joint `{self._name}`: {_PARTS[which]} is {x}; finite numbers are accepted; "
                    "nothing was sent"
                )
            if field is None:
                n = round(gain * x + offset)
                if n < low or n > high:
                    n = low if n < low else high
                    clipped |= 1 << which
            else:
                n, fits = dbc.raw(field, (gain * x + offset) * field.scale + field.offset)
                if not fits:
                    clipped |= 1 << which
            if shift < 0:
                big |= (n & mask) << ~shift
            else:
                little |= (n & mask) << shift
        if command[3] is not None or command[4] is not None:
            self._refuse_gains(command)
        data = little.to_bytes(length, "little")
        if big:
            data = (int.from_bytes(data, "big") | big).to_bytes(length, "big")
        return Outgoing((Frame(self._command.identifier, data),), clipped)

    def _refuse_gains(self, command: MotorCommand) -> None:
        carried = {part.which for part in self._parts}
        for which in (3, 4):
            x = command[which]
            if x is not None and which not in carried and x != self._gains[which - 3]:
                raise InputError(
                    f"joint `{self._name}`: message `{self._command.name}` cannot carry {_PARTS[which]} {x}; "
                    f"leave it None, or give the link's own {self._gains[which - 3]}; nothing was sent"
                )

    def wire(self) -> Wire:
        """See `Drive.wire`; a float signal carries any value, and so does what is not sent at all."""
        grids = [Grid()] * 3
        for part in self._parts:
            if part.which < 3 and part.field is None:
                grids[part.which] = grid(Linear(part.gain, part.offset), part.low, part.high)
        return Wire(*grids)

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; gains that go with the enable request go with it again."""
        own, carried = self._own, {part.which for part in self._parts} & {3, 4}
        enable = self._requests.get("enable")
        asked = enable is not None and bool({"{stiffness}", "{damping}"} & {*enable.values.values()})
        if not (carried or asked):
            return None
        self._gains = (share * own[0], own[1])
        return (self._encode_request("enable"),) if asked and self._enabled else ()

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`; `stop` and `report` fall back on `disable`."""
        if mode is not None:
            self._mode = mode
        name = request.value
        if name in ("stop", "report") and name not in self._requests:
            name = "disable"
        self._enabled = name == "enable" or (self._enabled and name not in ("disable", "stop", "reset"))
        return (self._encode_request(name),) if name in self._requests else ()

    def _encode_request(self, name: str) -> Frame:
        wanted = self._requests[name]
        layout = self._layout(wanted.message)
        where = f"{self._where}, request `{name}`"
        values: dict[str, float] = {}
        for signal, value in wanted.values.items():
            field = dbc.field_of(layout, signal, where)
            if value in ("{stiffness}", "{damping}"):
                which = 3 if value == "{stiffness}" else 4
                gain, offset = self._line(which, field, where)
                values[signal] = (gain * self._gains[which - 3] + offset) * field.scale + field.offset
            else:
                values[signal] = dbc.choice(
                    layout, signal, self._mode.value if value == "{mode}" else value, where
                )
        payload = dbc.encode(layout, values)
        if payload.clipped:
            raise InputError(
                f"{where}: {', '.join(payload.clipped)} does not fit the signal; give a smaller value"
            )
        return Frame(layout.identifier, payload.data)

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`; a table has no words for error bits, so they are shown as they are."""
        return f"error flags 0x{error:X}" if error else ""
