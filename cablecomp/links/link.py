"""A link: every joint on one bus or line, read without waiting and commanded once a cycle."""

from __future__ import annotations

from math import inf
from typing import NamedTuple, Protocol

from cablecomp.errors import InputError
from cablecomp.links.devices import Drive, Receiver, Take
from cablecomp.links.port_can import can_port, fd_options
from cablecomp.links.port_line import serial_port
from cablecomp.links.ports import Port
from cablecomp.links.protocols import Shared, extra_channels, make_drive, sensor_receivers
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import NOT_TAKEN, BusState, Mode, MotorCommand, Request
from cablecomp.links.schema import CanBus, LinkConfig
from cablecomp.links.schema_devices import DynamixelDevice
from cablecomp.signals import Wire


class LinkStatus(NamedTuple):
    """What a link has counted since it was opened, and the state of its bus; `fault` says in words why it is
    not well.

    `frames` came, of which `ignored` are of an identifier that nobody here listens to, `foreign` are of one
    that is listened to but from a device that is none of this link's (another drive's number in byte 0), and
    `invalid` were damaged or impossible; none of these was taken. `lost`, `repeated`, `reordered`, `restarts`
    by the messages' own counters; `error_frames`, `overflows`, `dropped` as controller, adapter and system
    tell; `backlogs`: polls that left frames for the next; `sent`, `send_failures` frames; `clipped` commands
    of which something was saturated.
    """

    bus: BusState
    fault: str
    frames: int
    ignored: int
    foreign: int
    invalid: int
    lost: int
    repeated: int
    reordered: int
    restarts: int
    error_frames: int
    overflows: int
    dropped: int
    backlogs: int
    sent: int
    send_failures: int
    clipped: int


class Link(Protocol):
    """What the runtime holds on to."""

    config: LinkConfig
    joints: tuple[JointReadings, ...]

    def open(self) -> None:
        """Open bus or line; raises DeviceError or InputError with one line."""

    def poll(self, now_s: float) -> int:
        """Take everything that has come, stamped `now_s`; never waits, never raises; return how many values
        came."""

    def send(self, joint: int, command: MotorCommand) -> int:
        """Send a command; return the CLIP_* bits of what was saturated, with NOT_TAKEN if the bus refused
        it; raises InputError on NaN or infinity."""

    def wire(self, joint: int) -> Wire:
        """What commands to a joint can carry in the mode last enabled, at the input pulley."""

    def ease(self, joint: int, share: float) -> bool:
        """Let a drive act with `share` (0…1) of its stiffness from now on; False = its gains cannot be
        changed from here."""

    def request(self, joint: int, request: Request, mode: Mode | None = None) -> bool | None:
        """Ask a drive to change state; False = the bus did not take it, None = the protocol has no such request."""

    def stop(self) -> bool:
        """Ask every drive to let go, by the quickest way that it has; never raises; False = there is one for which the
        bus has taken no such request since its last command."""

    def sync(self, step: int) -> bool:
        """Send the step counter (u32, little-endian) on `sync_id`: a simulated bus in stepped time takes one
        step."""

    @property
    def bus(self) -> BusState:
        """State of the bus, at next to no cost."""

    @property
    def unread(self) -> tuple[int, int]:
        """Polls that left frames for the next one, and frames that the system dropped, at next to no cost."""

    def status(self) -> LinkStatus:
        """Counts and state of the bus; changes nothing. Takes long: it asks every message of every joint."""

    def silent(self, now_s: float, longer_than_s: float) -> tuple[str, ...]:
        """Messages that never came, or not for longer than that, by name."""

    def error_text(self, joint: int) -> str:
        """The maker's words for the drive's present error; empty if there is none."""

    def close(self) -> None:
        """Close; may be called twice."""


class BusLink:
    """A link on any port; builds the port from the configuration unless one is given."""

    def __init__(self, config: LinkConfig, port: Port | None = None) -> None:
        self.config = config
        self._port = port if port is not None else make_port(config)
        self._limit = config.bus.max_frames_per_poll
        readings: list[JointReadings] = []
        drives: list[Drive | None] = []
        receivers: list[Receiver] = []
        shared = Shared()
        for ends in config.joint:
            joint = JointReadings(ends.name, extra_channels(config, ends))
            drive = make_drive(config, ends, joint, shared)
            readings.append(joint)
            drives.append(drive)
            receivers += drive.receivers() if drive is not None else ()
            receivers += sensor_receivers(config, ends, joint)
        self.joints: tuple[JointReadings, ...] = tuple(readings)
        self._drives: tuple[Drive | None, ...] = tuple(drives)
        self._foreign = ForeignFrames()
        self._table = dispatch_table(receivers, self._foreign)
        self._frames = 0
        self._ignored = 0
        self._sent = 0
        self._clipped = 0
        self._told: set[int] = set()
        self._next_stop = 0

    def open(self) -> None:
        """See `Link.open`."""
        self._port.open()

    def poll(self, now_s: float) -> int:
        """See `Link.poll`."""
        find, values = self._table.get, 0

        def sink(identifier: int, data: bytes) -> None:
            nonlocal values
            take = find(identifier)
            if take is None:
                self._ignored += 1
            else:
                values += take(data, now_s)

        self._frames += self._port.drain(sink, self._limit)
        return values

    def send(self, joint: int, command: MotorCommand) -> int:
        """See `Link.send`."""
        drive, readings = self._drives[joint], self.joints[joint]
        if drive is None:
            raise InputError(f"joint `{readings.name}` has no motor on this link; add [joint.motor]")
        frames, clipped, asking = drive.command(command)
        self._clipped += clipped != 0
        if self._told:
            self._told.discard(joint)
        for identifier, data in frames:
            if self._port.send(identifier, data):
                self._sent += 1
            else:
                clipped |= NOT_TAKEN
        for identifier, data in asking:
            self._sent += self._port.send(identifier, data)
        readings.sent += 1
        readings.unanswered += 1
        return clipped

    def wire(self, joint: int) -> Wire:
        """See `Link.wire`."""
        drive = self._drives[joint]
        return Wire() if drive is None else drive.wire()

    def ease(self, joint: int, share: float) -> bool:
        """See `Link.ease`."""
        drive = self._drives[joint]
        frames = None if drive is None else drive.ease(share)
        for identifier, data in frames or ():
            self._sent += self._port.send(identifier, data)
        return frames is not None

    def request(self, joint: int, request: Request, mode: Mode | None = None) -> bool | None:
        """See `Link.request`."""
        drive = self._drives[joint]
        frames = () if drive is None else drive.request(request, mode)
        taken = [self._port.send(identifier, data) for identifier, data in frames]
        self._sent += sum(taken)
        return all(taken) if taken else None

    def stop(self) -> bool:
        """See `Link.stop`; both the stop and the disable request go out, for drives that know only one. Where the bus
        takes only some of them, those that it did not take are first the next time."""
        drives = [j for j, drive in enumerate(self._drives) if drive is not None]
        wanted = [(j, r) for r in (Request.STOP, Request.DISABLE) for j in drives]
        wanted = wanted[self._next_stop :] + wanted[: self._next_stop]
        refused = None
        for k, (joint, request) in enumerate(wanted):
            taken = self.request(joint, request)
            if taken:
                self._told.add(joint)
            elif taken is False and refused is None:
                refused = k
        self._next_stop = 0 if refused is None else (self._next_stop + refused) % len(wanted)
        return len(self._told) == len(drives)

    def sync(self, step: int) -> bool:
        """See `Link.sync`; raises InputError if the configuration names no `sync_id`."""
        identifier = self.config.bus.sync_id
        if identifier is None:
            raise InputError(f"link `{self.config.name}`: bus.sync_id is missing; add it to send steps")
        return self._port.send(identifier, (step & 0xFFFF_FFFF).to_bytes(4, "little"))

    @property
    def bus(self) -> BusState:
        """See `Link.bus`."""
        return self._port.state

    @property
    def unread(self) -> tuple[int, int]:
        """See `Link.unread`."""
        return self._port.counters.backlogs, self._port.dropped()

    def status(self) -> LinkStatus:
        """See `Link.status`."""
        port = self._port
        messages = [m for joint in self.joints for m in joint.messages]
        return LinkStatus(
            port.state,
            port.fault,
            self._frames,
            self._ignored,
            self._foreign.count,
            port.counters.invalid + sum(m.invalid for m in messages),
            sum(m.lost for m in messages),
            sum(m.repeated for m in messages),
            sum(m.reordered for m in messages),
            sum(m.restarts for m in messages),
            port.counters.error_frames,
            port.counters.overflows,
            port.dropped(),
            port.counters.backlogs,
            self._sent,
            port.counters.send_failures,
            self._clipped,
        )

    def silent(self, now_s: float, longer_than_s: float) -> tuple[str, ...]:
        """See `Link.silent`."""
        messages = [m for joint in self.joints for m in joint.messages]
        ages = [now_s - m.last_s if m.received else inf for m in messages]
        return tuple(m.name for m, age in zip(messages, ages, strict=True) if age > longer_than_s)

    def error_text(self, joint: int) -> str:
        """See `Link.error_text`."""
        drive = self._drives[joint]
        return "" if drive is None else drive.error_text(self.joints[joint].error)

    def close(self) -> None:
        """See `Link.close`."""
        self._port.close()


def make_port(config: LinkConfig) -> Port:
    """The port that a configuration names; nothing is opened yet."""
    bus = config.bus
    if isinstance(bus, CanBus):
        options = {**fd_options(bus.interface, bus.fd, bus.bitrate, bus.data_bitrate), **bus.options}
        return can_port(bus.interface, bus.channel, bus.bitrate, options)
    packets = any(isinstance(device, DynamixelDevice) for device in config.device)
    return serial_port(bus.port, bus.baud, dynamixel=packets)


class ForeignFrames:
    """Counts frames that came on an identifier of ours from a device that is none of ours."""

    __slots__ = ("count",)

    def __init__(self) -> None:
        self.count = 0


def dispatch_table(receivers: list[Receiver], foreign: ForeignFrames) -> dict[int, Take]:
    """Identifier -> who takes it, whose number in byte 0 is checked however few share the identifier; raises
    InputError where two would take the same frame."""
    table: dict[int, Take] = {}
    for identifier in {r.identifier for r in receivers}:
        sharing = [r for r in receivers if r.identifier == identifier]
        masks, takers = {r.mask for r in sharing}, {r.number: r.take for r in sharing}
        if len(masks) != 1 or len(takers) != len(sharing) or (0 in masks and len(sharing) > 1):
            raise InputError(
                f"identifier 0x{identifier & 0x1FFFFFFF:X} is listened to by two joints that cannot be told "
                "apart; give each device its own node or reply_id"
            )
        mask = masks.pop()
        table[identifier] = _by_number(takers, mask, foreign) if mask else sharing[0].take
    return table


def _by_number(takers: dict[int, Take], mask: int, foreign: ForeignFrames) -> Take:
    def take(data: bytes, now_s: float) -> int:
        taker = takers.get(data[0] & mask) if data else None
        if taker is None:
            foreign.count += 1
            return 0
        return taker(data, now_s)

    return take
