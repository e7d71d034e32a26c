"""Ports: the one place where links touch the outside. A port drains what has come, in one go and without
waiting, and sends.

Cost is why they go around python-can's `recv`: it builds a `Message`, looks at the clock twice and waits on a
selector for every frame. Here python-can (or pyserial) opens and configures the interface; the frames are
then read where they lie: the queue of a virtual bus, the socket of socketcan and udp_multicast, the file
descriptor of a serial adapter. Interfaces without such a place are read through `recv(0)`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from cablecomp.links.records import BusState

Sink = Callable[[int, bytes], None]
"""Takes one frame: identifier with its flags, data."""

# Bits of error messages: linux/can/error.h.
_ERR_CRTL, _ERR_BUSOFF, _ERR_RESTARTED = 0x04, 0x40, 0x100
_CRTL_OVERFLOW, _CRTL_PASSIVE, _CRTL_ACTIVE = 0x03, 0x30, 0x40


class PortCounters:
    """What a port has counted since it was opened.

    `error_frames`: messages of the controller about errors; `invalid`: pieces that were no frame;
    `send_failures`: frames that could not be handed over; `overflows`: times the controller, or the adapter,
    said that it lost frames; `backlogs`: polls that left frames for the next one, because more came than
    `max_frames_per_poll`.
    """

    __slots__ = ("backlogs", "error_frames", "invalid", "overflows", "send_failures")

    def __init__(self) -> None:
        self.error_frames = 0
        self.invalid = 0
        self.send_failures = 0
        self.overflows = 0
        self.backlogs = 0


class Port(Protocol):
    """A bus or line as the link sees it; `fault` says in words why the state is not ACTIVE."""

    state: BusState
    counters: PortCounters
    fault: str

    def open(self) -> None:
        """Open; raises DeviceError or InputError with one line."""

    def drain(self, sink: Sink, limit: int) -> int:
        """Hand every frame that has come to `sink`, at most `limit`; never waits, never raises; return how
        many."""

    def send(self, identifier: int, data: bytes) -> bool:
        """Hand one frame over; never waits, never raises; False = it was not taken (counted, `state` tells
        why)."""

    def dropped(self) -> int:
        """Frames that the operating system dropped before they could be read, as far as it tells."""

    def close(self) -> None:
        """Close; may be called twice."""


class PortBase:
    """Counters and state that all ports keep, and how they change."""

    def __init__(self) -> None:
        self.state = BusState.CLOSED
        self.counters = PortCounters()
        self.fault = ""

    def lose(self, why: str) -> None:
        """The port is gone: say why, once."""
        if self.state != BusState.LOST:
            self.state = BusState.LOST
            self.fault = why

    def note_error(self, bits: int, data: bytes) -> None:
        """Take an error message of the controller (linux/can/error.h): bus-off, passive, active again,
        overflow."""
        self.counters.error_frames += 1
        if bits & _ERR_BUSOFF:
            self.state, self.fault = BusState.OFF, "the controller went bus-off"
        elif bits & _ERR_RESTARTED:
            self.state, self.fault = BusState.ACTIVE, ""
        elif bits & _ERR_CRTL and len(data) > 1:
            if data[1] & _CRTL_PASSIVE:
                self.state, self.fault = BusState.PASSIVE, "the controller is error-passive"
            elif data[1] & _CRTL_ACTIVE:
                self.state, self.fault = BusState.ACTIVE, ""
            if data[1] & _CRTL_OVERFLOW:
                self.counters.overflows += 1

    def heard(self) -> None:
        """A good frame came: whoever hears the bus is on it again."""
        if self.state == BusState.OFF:
            self.state, self.fault = BusState.ACTIVE, ""
