"""A port seen through its faults."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from itertools import count
from typing import Any

from firmware_sim.faults.line import LineFault
from firmware_sim.faults.wire import Timed, WireFault
from firmware_sim.ports.base import Port
from firmware_sim.wire.frame import Frame


class FaultyPort:
    """Passes frames of `port` through wire and line faults, in the order given; what is late waits here."""

    def __init__(self, port: Port, faults: Iterable[WireFault | LineFault]) -> None:
        self.port = port
        faults = tuple(faults)
        self.wire_faults = tuple(f for f in faults if isinstance(f, WireFault))
        self.line_faults = tuple(f for f in faults if isinstance(f, LineFault))
        self._pending: dict[str, list[tuple[float, int, Frame]]] = {"tx": [], "rx": []}
        self._order = count()

    def poll(self, now_s: float) -> list[Frame]:
        """Frames to the devices that are due; sends what has become due the other way."""
        self._control(now_s)
        frames = self._due(self.port.poll(now_s), "rx", now_s)
        self.send([], now_s)
        return frames

    def send(self, frames: list[Frame], now_s: float) -> None:
        """Frames from the devices."""
        self._control(now_s)
        due = self._due(frames, "tx", now_s)
        if due:
            self.port.send(due, now_s)

    def _control(self, now_s: float) -> None:
        for fault in self.line_faults:
            fault.control(self.port, now_s)

    def _due(self, frames: list[Frame], direction: str, now_s: float) -> list[Frame]:
        cut = any(fault.cuts(now_s) for fault in self.line_faults)
        pending = self._pending[direction]
        for frame in () if cut else frames:
            for timed in self._through(frame, direction, now_s):
                heapq.heappush(pending, (timed.at_s, next(self._order), timed.frame))
        due = []
        while pending and pending[0][0] <= now_s:
            due.append(heapq.heappop(pending)[2])
        return [] if cut else due

    def _through(self, frame: Frame, direction: str, now_s: float) -> list[Timed]:
        timed = [Timed(now_s, frame)]
        for fault in self.wire_faults:
            out: list[Timed] = []
            for t in timed:
                hit = fault.concerns(t.frame, direction, now_s)
                out += fault.change(t.frame, t.at_s) if hit else [t]
            timed = out
        return timed

    def wait(self, timeout_s: float) -> None:
        """Wait in the port behind."""
        self.port.wait(timeout_s)

    def describe(self) -> dict[str, Any]:
        """As the port behind."""
        return self.port.describe()

    def close(self) -> None:
        """Close the port behind."""
        self.port.close()
