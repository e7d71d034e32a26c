"""A python-can bus as a port: `virtual`, `udp_multicast`, `socketcan`, and every other interface of
python-can."""

from __future__ import annotations

from typing import Any

import can
import numpy as np

from firmware_sim.wire.frame import Frame

MALFORMED = (TypeError, ValueError, LookupError, AttributeError, ArithmeticError)
"""What python-can's reading of a datagram that is no frame ends in."""


class CanPort:
    """Frames through one `can.BusABC`; `sent`, `received` and `errors` count."""

    def __init__(self, bus: Any, description: dict[str, Any]) -> None:
        self.bus = bus
        self._description = description
        self._waiting: list[Frame] = []
        self.sent = self.received = self.errors = 0
        self._closed = False

    def poll(self, now_s: float) -> list[Frame]:
        """Everything that the driver holds."""
        frames, self._waiting = self._waiting, []
        while not self._closed:
            message = self._receive(0.0)
            if message is None:
                break
            frames.append(message)
        return frames

    def wait(self, timeout_s: float) -> None:
        """Wait in the driver."""
        if not self._waiting and not self._closed and (frame := self._receive(timeout_s)) is not None:
            self._waiting.append(frame)

    def _receive(self, timeout_s: float) -> Frame | None:
        """The next sound frame; what is none is counted and left out."""
        while True:
            try:
                message = self.bus.recv(timeout_s)
            except (can.CanError, *MALFORMED):
                self.errors += 1
                return None
            if message is None:
                return None
            if message.is_error_frame:
                continue
            frame = sound(message)
            if frame is not None:
                self.received += 1
                return frame
            self.errors += 1

    def send(self, frames: list[Frame], now_s: float) -> None:
        """Send; a driver that refuses is counted, as a node's error counter would."""
        for frame in frames:
            if self._closed:
                return
            message = can.Message(
                arbitration_id=frame.identifier,
                data=frame.data,
                is_extended_id=frame.extended,
                is_remote_frame=frame.remote,
                is_fd=frame.fd,
                bitrate_switch=frame.switch,
                check=False,
            )
            try:
                self.bus.send(message)
                self.sent += 1
            except can.CanError:
                self.errors += 1

    def describe(self) -> dict[str, Any]:
        """Interface and channel as python-can takes them."""
        return dict(self._description)

    def close(self) -> None:
        """Shut the bus down."""
        if not self._closed:
            self._closed = True
            self.bus.shutdown()


def sound(message: Any) -> Frame | None:
    """The message as a frame; None where it is none that a bus could carry, as a datagram from elsewhere can be."""
    identifier, data = message.arbitration_id, message.data
    fits = (
        isinstance(identifier, int | np.integer)
        and 0 <= identifier < (1 << 29 if message.is_extended_id else 1 << 11)
        and isinstance(data, bytes | bytearray)
        and len(data) <= (64 if message.is_fd else 8)
    )
    if not fits:
        return None
    return Frame(
        int(identifier),
        bytes(data),
        bool(message.is_remote_frame),
        bool(message.is_extended_id),
        bool(message.is_fd),
        bool(message.bitrate_switch),
    )
