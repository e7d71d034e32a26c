"""CAN ports on python-can: opened by it, read where the frames lie (see `ports`)."""

from __future__ import annotations

import difflib
import os
import queue
import socket
import time
from collections.abc import Callable, Mapping
from typing import Any

import can
from can.interfaces.udp_multicast import UdpMulticastBus

from cablecomp.errors import DeviceError, InputError
from cablecomp.links.port_line import slcan_port
from cablecomp.links.port_socket import MulticastPort, SocketCanPort
from cablecomp.links.ports import Port, PortBase, Sink
from cablecomp.links.records import EXTENDED, FD, REMOTE, SWITCH, BusState

_MUTE = (BusState.CLOSED, BusState.OFF)
_STANDARD_MASK, _EXTENDED_MASK = 0x7FF, 0x1FFF_FFFF


def can_port(
    interface: str, channel: str | int | None, bitrate: int | None, options: Mapping[str, Any]
) -> Port:
    """The cheapest port for a python-can interface; nothing is opened yet.

    virtual, udp_multicast, socketcan and slcan are read directly; every other interface through `recv(0)`.
    """

    def bus() -> Any:
        return _open_bus(interface, channel, bitrate, options)

    if interface == "virtual":
        return VirtualPort(bus)
    if interface == "socketcan":
        return SocketCanPort(lambda: _socket_of(bus()))
    if interface == "udp_multicast":
        group = str(channel) if channel is not None else UdpMulticastBus.DEFAULT_GROUP_IPv6
        return MulticastPort(bus, group, options.get("port", 43113), options.get("hop_limit", 1))
    if interface == "slcan" and os.name == "posix":
        return slcan_port(bus)
    return GenericPort(bus)


def _open_bus(
    interface: str, channel: str | int | None, bitrate: int | None, options: Mapping[str, Any]
) -> Any:
    known = sorted(can.VALID_INTERFACES)
    if interface not in known:
        close = difflib.get_close_matches(interface, known, 1, 0.75)
        hint = f"did you mean `{close[0]}`?" if close else f"python-can has {', '.join(known)}"
        raise InputError(f"unknown CAN interface `{interface}`; {hint}")
    chosen = {"channel": channel, "bitrate": None if "timing" in options else bitrate}
    wanted = {k: v for k, v in chosen.items() if v is not None}
    try:
        return can.Bus(interface=interface, ignore_config=True, **wanted, **options)
    # NotImplementedError: what python-can raises for an interface that this system does not have
    except (can.CanError, OSError, ValueError, TypeError, ImportError, NotImplementedError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DeviceError(
            f"CAN {interface} {channel}: cannot be opened ({text}); check interface, channel and options"
        ) from None


def fd_options(interface: str, fd: bool, bitrate: int | None, data_bitrate: int | None) -> dict[str, Any]:
    """What python-can's interfaces are told of CAN FD: slcan both bit rates as one timing, of which its text
    carries no more; the others `fd` and `data_bitrate`."""
    if not fd:
        return {}
    if interface != "slcan":
        return {"fd": True} if data_bitrate is None else {"fd": True, "data_bitrate": data_bitrate}
    if bitrate is None or data_bitrate is None:
        return {}
    points = {"nom_sample_point": 80.0, "data_sample_point": 80.0}
    timing = can.BitTimingFd.from_sample_point(80_000_000, bitrate, data_bitrate=data_bitrate, **points)
    return {"timing": timing}


def message_identifier(message: Any) -> int:
    """Identifier of a python-can message with its flags."""
    identifier: int = message.arbitration_id
    if message.is_extended_id:
        identifier |= EXTENDED
    if message.is_fd:
        identifier |= FD
    return identifier | REMOTE if message.is_remote_frame else identifier


def make_message(identifier: int, data: bytes) -> Any:
    """A python-can message; a remote frame asks for 8 bytes. Stamped with wall time, as other programs on the
    bus expect."""
    if identifier <= _STANDARD_MASK:  # the usual case; by position, which is twice as quick as by keyword
        return can.Message(time.time(), identifier, False, False, False, None, len(data), data)
    extended, remote, fd = bool(identifier & EXTENDED), bool(identifier & REMOTE), bool(identifier & FD)
    return can.Message(
        arbitration_id=identifier & (_EXTENDED_MASK if extended else _STANDARD_MASK),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_fd=fd,
        bitrate_switch=bool(identifier & SWITCH),
        dlc=8 if remote else len(data),
        data=None if remote else data,
        timestamp=time.time(),
    )


class VirtualPort(PortBase):
    """A bus inside of the process: messages are taken from, and put into, python-can's queues directly (no
    deep copies)."""

    def __init__(self, bus: Callable[[], Any]) -> None:
        super().__init__()
        self._make = bus
        self._bus: Any = None
        self._waiting: Any = None
        self._bounded = False

    def open(self) -> None:
        """See `Port.open`."""
        self._bus = self._make()
        self._bounded = self._bus.queue.maxsize > 0
        self._waiting = self._bus.queue.queue
        self.state, self.fault = BusState.ACTIVE, ""

    def drain(self, sink: Sink, limit: int) -> int:
        """See `Port.drain`."""
        waiting = self._waiting
        if not waiting or self.state == BusState.CLOSED:
            return 0
        found = 0
        # popleft is atomic, and an unbounded queue has no waiting writers to wake.
        take = self._bus.queue.get_nowait if self._bounded else waiting.popleft
        off = self.state == BusState.OFF
        while found < limit:
            try:
                message = take()
            except (IndexError, queue.Empty):
                return found
            found += 1
            if message.is_error_frame:
                self.note_error(message.arbitration_id, message.data)
                off = self.state == BusState.OFF
                continue
            if off:
                self.heard()
                off = False
            identifier = message.arbitration_id
            if message.is_extended_id or message.is_remote_frame or message.is_fd:
                identifier = message_identifier(message)
            sink(identifier, message.data)
        self.counters.backlogs += bool(waiting)
        return found

    def send(self, identifier: int, data: bytes) -> bool:
        """See `Port.send`."""
        if self.state in _MUTE:
            self.counters.send_failures += 1
            return False
        taken = True
        own = self._bus.queue
        for other in tuple(self._bus.channel):
            if other is not own:
                try:
                    other.put(make_message(identifier, data), False)
                except queue.Full:
                    taken = False
        self.counters.send_failures += not taken
        return taken

    def dropped(self) -> int:
        """A virtual bus drops nothing."""
        return 0

    def close(self) -> None:
        """See `Port.close`."""
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = self._waiting = None
        self.state = BusState.CLOSED


class GenericPort(PortBase):
    """Any other python-can interface, through its own `recv(0)` and `send`."""

    def __init__(self, bus: Callable[[], Any]) -> None:
        super().__init__()
        self._make = bus
        self._bus: Any = None

    def open(self) -> None:
        """See `Port.open`."""
        self._bus = self._make()
        self.state, self.fault = BusState.ACTIVE, ""

    def drain(self, sink: Sink, limit: int) -> int:
        """See `Port.drain`."""
        found = 0
        try:
            while found < limit and self._bus is not None:
                message = self._bus.recv(0)
                if message is None:
                    return found
                found += 1
                if message.is_error_frame:
                    self.note_error(message.arbitration_id, message.data)
                else:
                    self.heard()
                    sink(message_identifier(message), message.data)
        except (can.CanError, OSError) as error:
            self.lose(f"receiving failed ({error})")
            return found
        self.counters.backlogs += self._bus is not None
        return found

    def send(self, identifier: int, data: bytes) -> bool:
        """See `Port.send`."""
        try:
            if self._bus is None:
                raise can.CanOperationError("closed")
            self._bus.send(make_message(identifier, data), timeout=0)
        except (can.CanError, OSError) as error:
            self.counters.send_failures += 1
            if self._bus is not None:
                self.fault = f"sending failed ({error})"
            return False
        return True

    def dropped(self) -> int:
        """python-can tells of nothing dropped."""
        return 0

    def close(self) -> None:
        """See `Port.close`."""
        if self._bus is not None:
            bus, self._bus = self._bus, None
            try:
                bus.shutdown()
            except (can.CanError, OSError) as error:
                self.fault = self.fault or f"closing failed ({error})"
        self.state = BusState.CLOSED


def _socket_of(bus: Any) -> tuple[socket.socket, Any]:
    return socket.socket(fileno=os.dup(bus.fileno())), bus
