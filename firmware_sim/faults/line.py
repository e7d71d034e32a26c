"""Faults of the line as a whole: bus off, noise on a serial line, a cable pulled."""

from __future__ import annotations

from dataclasses import dataclass, field

from firmware_sim.faults.base import Fault
from firmware_sim.ports.base import Port
from firmware_sim.ports.pty_port import PtyPort, SlcanPort


@dataclass
class LineFault(Fault):
    """Told the time before each poll and each send; `cuts` says whether nothing passes at this moment."""

    def control(self, port: Port, now_s: float) -> None:
        """Act on the port itself."""

    def cuts(self, now_s: float) -> bool:
        """Whether frames are lost in both directions now."""
        return False


@dataclass
class BusOff(LineFault):
    """The controllers have left the bus: nothing passes; an slcan adapter refuses to send and raises its
    bus-error flag."""

    def control(self, port: Port, now_s: float) -> None:
        """Tell an slcan adapter."""
        if isinstance(port, SlcanPort):
            port.adapter.bus_off = self.active(now_s)

    def cuts(self, now_s: float) -> bool:
        """While it lasts."""
        return self.active(now_s)


@dataclass
class CablePull(LineFault):
    """A pseudo-terminal is closed at `start` and a new one opened at `stop`; on other buses nothing passes
    meanwhile."""

    _out: bool = field(default=False, init=False, repr=False)

    def control(self, port: Port, now_s: float) -> None:
        """Close or open the terminal."""
        if not isinstance(port, PtyPort) or self._out == self.active(now_s):
            return
        self._out = not self._out
        if self._out:
            port.unplug()
        else:
            port.plug()

    def cuts(self, now_s: float) -> bool:
        """While it lasts."""
        return self.active(now_s)


@dataclass
class SerialNoise(LineFault):
    """Each byte is hit with probability `p`: half of them flipped in one bit, a quarter lost, a quarter
    doubled."""

    p: float = 1e-3

    def control(self, port: Port, now_s: float) -> None:
        """Put itself on the terminal's bytes."""
        if isinstance(port, PtyPort) and port.noise_out != self.hit:
            port.noise_out = port.noise_in = self.hit

    def hit(self, data: bytes, now_s: float) -> bytes:
        """The bytes as they arrive."""
        if not self.active(now_s):
            return data
        out = bytearray()
        for byte in data:
            if not self.chance(self.p):
                out.append(byte)
                continue
            kind = self.rng.randrange(4)
            if kind < 2:
                out.append(byte ^ 1 << self.rng.randrange(8))
            elif kind == 2:
                out += bytes((byte, byte))
        return bytes(out)
