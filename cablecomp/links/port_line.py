"""A line of bytes (serial port, pseudo-terminal): records on it are cut by a reader, slcan text, COBS
records or Dynamixel packets."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Protocol

import can
import serial

from cablecomp.errors import DeviceError
from cablecomp.links import dynamixel as packets
from cablecomp.links import serial_frames, slcan_frames
from cablecomp.links.ports import PortBase, Sink
from cablecomp.links.records import BusState

_CHUNK = 65_536
_PIECE = 2048
"""A terminal gives at most 4096 bytes at once; after less than this nothing is left. To read on all the same
would wait: the kernel answers an empty read only once its own worker has run (`flush_work` in
drivers/tty/n_tty.c), milliseconds later on a busy computer.
"""
_GONE = (BusState.CLOSED, BusState.LOST)


class Reader(Protocol):
    """Cuts bytes into frames."""

    invalid: int
    overflows: int
    flags: int

    def question(self) -> bytes:
        """Bytes to ask the far end for its state, if there is a reason to."""

    def feed(self, chunk: bytes, sink: Sink) -> int:
        """Take bytes, hand whole frames to `sink`, return how many."""


class LinePort(PortBase):
    """Frames on a pyserial port: bytes are read from its file descriptor where it has one, else through
    pyserial.

    `attach` opens and returns the pyserial port and what closes it; `pack` makes a frame's bytes, `reader`
    cuts what comes. Of a frame that a full line takes in part the rest is kept and sent first the next time; until
    that is gone no other frame is taken: commands that waited would come late, and a stop behind them.
    """

    def __init__(
        self,
        attach: Callable[[], tuple[Any, Callable[[], None]]],
        pack: Callable[[int, bytes], bytes],
        reader: Reader,
    ) -> None:
        super().__init__()
        self._attach = attach
        self._pack = pack
        self._reader = reader
        self._port: Any = None
        self._shut: Callable[[], None] | None = None
        self._fd = -1
        self._pending = bytearray()

    def open(self) -> None:
        """Open the port; raises DeviceError with one line."""
        self._port, self._shut = self._attach()
        try:
            self._fd = self._port.fileno()
            os.set_blocking(self._fd, False)
        except (AttributeError, OSError, NotImplementedError):  # a port of pyserial's without a file
            self._fd = -1
        self._pending.clear()
        self.state, self.fault = BusState.ACTIVE, ""

    def drain(self, sink: Sink, limit: int) -> int:
        """See `Port.drain`; a line is read whole, so `limit` only ends the reading of further chunks."""
        found = 0
        while self.state not in _GONE:
            chunk = self._read()
            if not chunk:
                break
            found += self._reader.feed(chunk, sink)
            if len(chunk) < _PIECE:
                break
            if found >= limit:
                self.counters.backlogs += 1
                break
        self.counters.invalid = self._reader.invalid
        self.counters.overflows = self._reader.overflows
        if found:
            self.heard()
        self._flush()
        question = b"" if self._pending else self._reader.question()
        if question:
            self._pending += question
            self._flush()
        if self._reader.flags >= 0:
            self._note_flags()
        return found

    def _note_flags(self) -> None:
        """Take an slcan adapter's status flags, once: bit 7 bus error, bit 5 error passive, bit 3 data
        overrun."""
        flags, self._reader.flags = self._reader.flags, -1
        self.counters.error_frames += flags != 0
        if flags & 0x80:
            self.state, self.fault = BusState.OFF, "the adapter reports a bus error"
        elif flags & 0x20:
            self.state, self.fault = BusState.PASSIVE, "the adapter is error-passive"
        else:
            self.state, self.fault = BusState.ACTIVE, ""

    def _read(self) -> bytes:
        try:
            if self._fd >= 0:
                return os.read(self._fd, _CHUNK)
            waiting = self._port.in_waiting
            return bytes(self._port.read(waiting)) if waiting else b""
        except BlockingIOError:
            return b""
        except (OSError, serial.SerialException) as error:
            self.lose(f"the line is gone ({error})")
            return b""

    def send(self, identifier: int, data: bytes) -> bool:
        """See `Port.send`."""
        if self.state in _GONE:
            self.counters.send_failures += 1
            return False
        if not self._flush():
            return False
        if not self._pending:
            packed = self._pack(identifier, data)
            self._pending += packed
            if not self._flush():
                return False
            if len(self._pending) < len(packed):
                return True
            self._pending.clear()  # none of it: it shall not go out later than it was meant to
        self.counters.send_failures += 1
        return False

    def _flush(self) -> bool:
        """Hand over what waits, as far as the line takes it; False = the line is gone."""
        if self.state in _GONE:
            self._pending.clear()
            return False
        try:
            while self._pending:
                if self._fd >= 0:
                    sent = os.write(self._fd, self._pending)
                else:
                    sent = self._port.write(bytes(self._pending)) or 0
                del self._pending[:sent]
                if not sent:
                    break
        except BlockingIOError:
            pass
        except (OSError, serial.SerialException) as error:
            self.counters.send_failures += 1
            self.lose(f"the line is gone ({error})")
            return False
        return True

    def dropped(self) -> int:
        """A line tells of nothing dropped."""
        return 0

    def close(self) -> None:
        """See `Port.close`."""
        if self._shut is not None:
            shut, self._shut = self._shut, None
            if self.state not in _GONE:
                self._flush()
            try:
                shut()
            except (OSError, serial.SerialException, can.CanError) as error:
                self.fault = f"closing failed ({error})"
        # python-can cannot tell an adapter whose cable is out to close its channel, and then leaves the line
        # open; with nobody left to hold it, it closes itself.
        self._port = None
        self._fd = -1
        self.state = BusState.CLOSED


def serial_port(port: str, baud: int, *, dynamixel: bool = False) -> LinePort:
    """COBS records, or Dynamixel packets, on a serial port; opening raises DeviceError if it cannot be had."""

    def attach() -> tuple[Any, Callable[[], None]]:
        try:
            # pyserial's URL ports (loop://, socket://, …) take a write timeout of 0 for one that has passed.
            wait = None if "://" in port else 0
            line = serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=wait)
        except (OSError, ValueError, serial.SerialException) as error:
            raise DeviceError(
                f"serial port {port}: cannot be opened ({_brief(error)}); give a port that is there and free"
            ) from None
        return line, line.close

    if dynamixel:
        return LinePort(attach, packets.pack, packets.StatusReader())
    return LinePort(attach, serial_frames.pack_record, serial_frames.RecordReader())


def slcan_port(bus: Callable[[], Any]) -> LinePort:
    """slcan text on the line of a python-can slcan bus, which sets the adapter up and opens its channel, and
    tells its file descriptor; where the system has none (Windows), `GenericPort` is for it."""

    def attach() -> tuple[Any, Callable[[], None]]:
        opened = bus()
        return opened, opened.shutdown

    return LinePort(attach, slcan_frames.pack_line, slcan_frames.LineReader())


def _brief(error: BaseException) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
