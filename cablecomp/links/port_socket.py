"""Ports that read a socket: Linux's CAN sockets, and the multicast group of python-can's udp_multicast."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from struct import Struct
from typing import Any

import msgpack

from cablecomp.links.ports import PortBase, Sink
from cablecomp.links.records import ERROR, EXTENDED, FD, REMOTE, SWITCH, BusState

_FRAME = Struct("=IB3x8s")
_FD_FRAME = Struct("=IBB2x64s")
_FD_SWITCH = 0x01  # CANFD_BRS
_MEMINFO, _MEMINFO_DROPS = 55, 8
_STANDARD_MASK, _EXTENDED_MASK = 0x7FF, 0x1FFF_FFFF


class _SocketPort(PortBase):
    """What socketcan and udp_multicast share: a non-blocking socket, and the kernel's count of dropped
    frames."""

    def __init__(self) -> None:
        super().__init__()
        self._socket: socket.socket | None = None
        self._owner: Any = None
        self._buffer = bytearray(4096)
        self._dropped_before = 0
        self._dropped = 0

    def _use(self, own: socket.socket, owner: Any) -> None:
        own.setblocking(False)
        self._socket, self._owner = own, owner
        self._dropped_before = _kernel_drops(own)
        self.state, self.fault = BusState.ACTIVE, ""

    def dropped(self) -> int:
        """Frames that found the socket's buffer full (SO_MEMINFO), also once it is closed; 0 where the system does
        not tell."""
        if self._socket is not None:
            self._dropped = _kernel_drops(self._socket) - self._dropped_before
        return self._dropped

    def close(self) -> None:
        """See `Port.close`."""
        if self._socket is not None:
            self.dropped()
            self._socket.close()
            self._socket = None
        if self._owner is not None:
            self._owner.shutdown()
            self._owner = None
        self.state = BusState.CLOSED


class SocketCanPort(_SocketPort):
    """Linux's CAN sockets: `struct can_frame` of 16 bytes and `struct canfd_frame` of 72, read into one
    buffer (linux/can.h)."""

    def __init__(self, attach: Callable[[], tuple[socket.socket, Any]]) -> None:
        super().__init__()
        self._attach = attach

    def open(self) -> None:
        """See `Port.open`."""
        self._use(*self._attach())

    def drain(self, sink: Sink, limit: int) -> int:
        """See `Port.drain`."""
        own = self._socket
        if own is None or self.state == BusState.LOST:
            return 0
        buffer, unpack, receive = self._buffer, _FRAME.unpack_from, own.recv_into
        found = 0
        while found < limit:
            try:
                size = receive(buffer)
            except BlockingIOError:
                return found
            except OSError as error:
                self.lose(f"receiving failed ({error.strerror})")
                return found
            if size == 0:
                self.lose("the socket was closed")
                return found
            found += 1
            identifier, length, data = unpack(buffer)
            if size == _FD_FRAME.size and length <= 64:
                identifier |= FD
                data = bytes(buffer[8 : 8 + length])
            elif size != 16 or length > 8:
                self.counters.invalid += 1
                continue
            if identifier & ERROR:
                self.note_error(identifier & _EXTENDED_MASK, data[:length])
            else:
                if self.state == BusState.OFF:
                    self.heard()
                sink(identifier, data if length >= 8 else data[:length])
        self.counters.backlogs += 1
        return found

    def send(self, identifier: int, data: bytes) -> bool:
        """See `Port.send`; a full queue of the controller, or bus-off, refuses."""
        try:
            if self._socket is None:
                raise OSError("closed")
            if identifier & FD:
                switch = _FD_SWITCH if identifier & SWITCH else 0
                packed = _FD_FRAME.pack(identifier & 0xFFFF_FFFF, len(data), switch, data)
            else:
                packed = _FRAME.pack(identifier, 8 if identifier & REMOTE else len(data), data)
            self._socket.send(packed)
        except OSError as error:
            self.counters.send_failures += 1
            if self.state == BusState.ACTIVE:
                self.fault = f"sending failed ({error.strerror or error})"
            return False
        return True


class MulticastPort(_SocketPort):
    """python-can's udp_multicast: one msgpack map a datagram. Sends from a socket of its own, so that the
    copies of its own frames, which multicast hands back, are told apart by their source."""

    def __init__(self, bus: Callable[[], Any], group: str, port: int, hop_limit: int) -> None:
        super().__init__()
        self._make = bus
        self._hop_limit = hop_limit
        self._out: socket.socket | None = None
        self._group = (group, port)
        self._own_port = 0

    def open(self) -> None:
        """See `Port.open`."""
        bus = self._make()
        own = socket.socket(fileno=os.dup(bus.fileno()))
        out = socket.socket(own.family, socket.SOCK_DGRAM)
        level, hops = (
            (socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_HOPS)
            if own.family == socket.AF_INET6
            else (socket.IPPROTO_IP, socket.IP_MULTICAST_TTL)
        )
        out.setsockopt(level, hops, self._hop_limit)
        out.bind(("", 0))
        out.setblocking(False)
        self._out, self._own_port = out, out.getsockname()[1]
        self._use(own, bus)

    def drain(self, sink: Sink, limit: int) -> int:
        """See `Port.drain`."""
        own = self._socket
        if own is None or self.state == BusState.LOST:
            return 0
        buffer, receive, mine = self._buffer, own.recvfrom_into, self._own_port
        view = memoryview(buffer)
        found = 0
        while found < limit:
            try:
                size, source = receive(buffer)
            except BlockingIOError:
                return found
            except OSError as error:
                self.lose(f"receiving failed ({error.strerror})")
                return found
            if source[1] == mine:
                continue
            found += 1
            self._take(view[:size], sink)
        self.counters.backlogs += 1
        return found

    def _take(self, datagram: memoryview, sink: Sink) -> None:
        try:
            fields = msgpack.unpackb(datagram)
            identifier, data, extended = fields["arbitration_id"], fields["data"], fields["is_extended_id"]
            # anybody may send to the group, and a frame's takers rely on what they are given
            if type(identifier) is not int or type(data) is not bytes:
                raise ValueError
            if len(data) > (64 if fields["is_fd"] else 8):
                raise ValueError
            if not 0 <= identifier <= (_EXTENDED_MASK if extended else _STANDARD_MASK):
                raise ValueError
            if fields["is_error_frame"]:
                self.note_error(identifier, data)
                return
            if extended:
                identifier |= EXTENDED
            if fields["is_fd"]:
                identifier |= FD
            if fields["is_remote_frame"]:
                identifier |= REMOTE
        except (ValueError, KeyError, TypeError, msgpack.UnpackException):
            self.counters.invalid += 1
            return
        if self.state == BusState.OFF:
            self.heard()
        sink(identifier, data)

    def send(self, identifier: int, data: bytes) -> bool:
        """See `Port.send`."""
        extended, remote = bool(identifier & EXTENDED), bool(identifier & REMOTE)
        fields = {
            "timestamp": time.time(),
            "arbitration_id": identifier & (_EXTENDED_MASK if extended else _STANDARD_MASK),
            "is_extended_id": extended,
            "is_remote_frame": remote,
            "is_error_frame": False,
            "channel": None,
            "dlc": 8 if remote else len(data),
            "data": b"" if remote else data,
            "is_fd": bool(identifier & FD),
            "bitrate_switch": bool(identifier & SWITCH),
            "error_state_indicator": False,
        }
        try:
            if self._out is None:
                raise OSError("closed")
            self._out.sendto(msgpack.packb(fields), self._group)
        except OSError as error:
            self.counters.send_failures += 1
            self.fault = f"sending failed ({error.strerror or error})"
            return False
        return True

    def close(self) -> None:
        """See `Port.close`."""
        if self._out is not None:
            self._out.close()
            self._out = None
        super().close()


def _kernel_drops(own: socket.socket) -> int:
    try:
        info = own.getsockopt(socket.SOL_SOCKET, _MEMINFO, 64)
    except OSError:
        return 0
    at = 4 * _MEMINFO_DROPS
    return int.from_bytes(info[at : at + 4], "little") if len(info) >= at + 4 else 0
