"""A python-can bus as a port: `virtual`, `udp_multicast`, `socketcan`, and every other interface of
python-can."""

from __future__ import annotations

from typing import Any

import can

from firmware_sim.wire.frame import Frame


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
        try:
            message = self.bus.recv(timeout_s)
        except can.CanError:
            self.errors += 1
            return None
        if message is None or message.is_error_frame:
            return None
        self.received += 1
        return Frame(
            message.arbitration_id,
            bytes(message.data),
            message.is_remote_frame,
            message.is_extended_id,
            message.is_fd,
            message.bitrate_switch,
        )

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
