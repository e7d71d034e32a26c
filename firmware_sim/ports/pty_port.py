"""Pseudo-terminals: an slcan adapter, a device with COBS records, or a line of Dynamixels, as a serial port that any
client can open.

The terminal's far end is kept closed here, so the kernel reports a hang-up while no client has it open:
then nothing is
written and nothing stale waits for the next client. `unplug` closes the terminal for good, as a pulled
cable does; `plug` opens a
new one, and `link`, a symbolic link, leads to whichever is present.
"""

from __future__ import annotations

import contextlib
import os
import select
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Any

from firmware_sim.wire.dynamixel_packets import InstructionReader, status_packet
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.serial_records import RecordReader, encode_record
from firmware_sim.wire.slcan import SlcanAdapter

BACKLOG = 1 << 16
ByteFault = Callable[[bytes, float], bytes]


class PtyPort:
    """Bytes through a pseudo-terminal; subclasses make frames of them."""

    interface = "pty"

    def __init__(self, link: Path | None = None) -> None:
        self.link = link
        self._master = -1
        self._backlog = bytearray()
        self._connected = False
        self.dropped = 0
        self.noise_out: ByteFault | None = None
        self.noise_in: ByteFault | None = None
        self.plug()

    # ---- the terminal ----------------------------------------------------------------------------

    def plug(self) -> None:
        """Open a terminal if there is none."""
        if self._master >= 0:
            return
        self._master, slave = os.openpty()
        self.path = os.ttyname(slave)
        tty.setraw(slave)
        os.close(slave)
        os.set_blocking(self._master, False)
        self._poller = select.poll()
        self._poller.register(self._master, select.POLLIN)
        if self.link is not None:
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.path)

    def unplug(self) -> None:
        """Close the terminal: whoever has it open reads an end of file or an error."""
        if self._master < 0:
            return
        os.close(self._master)
        self._master = -1
        self._lost()
        if self.link is not None:
            self.link.unlink(missing_ok=True)

    def _hung_up(self) -> bool:
        return any(event & select.POLLHUP for _, event in self._poller.poll(0))

    def _lost(self) -> None:
        self._backlog.clear()
        self._connected = False
        self.forget()

    def forget(self) -> None:
        """The client went away: what was half said is forgotten."""

    def read(self, now_s: float) -> bytes:
        """Bytes that the client wrote."""
        if self._master < 0:
            return b""
        pieces = []
        with contextlib.suppress(BlockingIOError, OSError):
            while piece := os.read(self._master, 4096):
                pieces.append(piece)
        if self._connected and self._hung_up():
            self._lost()
        self._flush()
        data = b"".join(pieces)
        return self.noise_in(data, now_s) if data and self.noise_in is not None else data

    def write(self, data: bytes, now_s: float) -> None:
        """Bytes to the client; dropped while there is none, and when it does not read."""
        if self._master < 0 or not data:
            return
        if self._hung_up():
            if self._connected:
                self._lost()
            return
        self._connected = True
        if len(self._backlog) > BACKLOG:
            self.dropped += 1
            return
        self._backlog += data if self.noise_out is None else self.noise_out(data, now_s)
        self._flush()

    def _flush(self) -> None:
        with contextlib.suppress(BlockingIOError, OSError):
            while self._backlog and self._master >= 0:
                del self._backlog[: os.write(self._master, self._backlog)]

    def wait(self, timeout_s: float) -> None:
        """Wait for the client; without one, a hang-up must not make this spin."""
        if self._master < 0 or self._hung_up():
            select.select([], [], [], timeout_s)
        else:
            self._poller.poll(max(timeout_s, 0.0) * 1e3)

    def describe(self) -> dict[str, Any]:
        """Interface and the terminal's path."""
        return {"interface": self.interface, "channel": str(self.link or self.path), "terminal": self.path}

    def close(self) -> None:
        """Close the terminal and remove the link."""
        self.unplug()

    # ---- frames ----------------------------------------------------------------------------------

    def poll(self, now_s: float) -> list[Frame]:
        """Frames that the client sent."""
        return self.frames(self.read(now_s), now_s)

    def send(self, frames: list[Frame], now_s: float) -> None:
        """Frames to the client."""
        self.write(b"".join(self.bytes_of(frame, now_s) for frame in frames), now_s)

    def frames(self, data: bytes, now_s: float) -> list[Frame]:
        """Frames in these bytes."""
        raise NotImplementedError  # each line protocol has its own

    def bytes_of(self, frame: Frame, now_s: float) -> bytes:
        """Bytes of one frame."""
        raise NotImplementedError  # each line protocol has its own


class SlcanPort(PtyPort):
    """An slcan adapter whose bus is the simulated one; python-can's `slcan` interface connects to it."""

    interface = "slcan"

    def __init__(self, link: Path | None = None) -> None:
        self.adapter = SlcanAdapter()
        super().__init__(link)

    def forget(self) -> None:
        """The channel closes with its client."""
        self.adapter.reset()

    def frames(self, data: bytes, now_s: float) -> list[Frame]:
        """Frames among the commands; the adapter's answers go back at once."""
        if not data:
            return []
        spoken = self.adapter.feed(data)
        self._connected = True
        self.write(spoken.answers, now_s)
        return spoken.frames

    def bytes_of(self, frame: Frame, now_s: float) -> bytes:
        """One line, nothing while the channel is closed."""
        return self.adapter.encode(frame, now_s)


class LinePort(PtyPort):
    """A device on a serial line: whole pieces out of a byte stream."""

    interface = "serial"
    reader: RecordReader | InstructionReader

    def forget(self) -> None:
        """Half a piece is none."""
        self.reader.reset()

    def frames(self, data: bytes, now_s: float) -> list[Frame]:
        """Whole pieces in these bytes."""
        return self.reader.feed(data) if data else []


class SerialPort(LinePort):
    """A device that speaks COBS records."""

    def __init__(self, link: Path | None = None) -> None:
        self.reader = RecordReader()
        super().__init__(link)

    def bytes_of(self, frame: Frame, now_s: float) -> bytes:
        """One record."""
        return encode_record(frame)


class DynamixelPort(LinePort):
    """A line of Dynamixels; frames of other numbers than theirs have no place on it."""

    def __init__(self, link: Path | None = None) -> None:
        self.reader = InstructionReader()
        super().__init__(link)

    def bytes_of(self, frame: Frame, now_s: float) -> bytes:
        """One status packet."""
        return status_packet(frame) if frame.identifier <= 0xFC else b""
