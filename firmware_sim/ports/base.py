"""What a port offers to the devices behind it."""

from __future__ import annotations

from typing import Any, Protocol

from firmware_sim.wire.frame import Frame


class Port(Protocol):
    """One end of a bus or line; the caller brings the time."""

    def poll(self, now_s: float) -> list[Frame]:
        """Frames that arrived since the last call; never waits."""
        ...

    def send(self, frames: list[Frame], now_s: float) -> None:
        """Send frames in this order."""
        ...

    def wait(self, timeout_s: float) -> None:
        """Return as soon as something arrived, at the latest after `timeout_s`."""
        ...

    def describe(self) -> dict[str, Any]:
        """Where a host reaches this port: `interface`, `channel` and what else its driver needs."""
        ...

    def close(self) -> None:
        """Let go of the bus or line; may be called twice."""
        ...
