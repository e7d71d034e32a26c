"""What the loop gives away of itself: a datagram every few ticks, dropped and counted where nobody takes it."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from typing import Any, Final

from numpy.typing import NDArray

from cablecomp.runtime.clock import Tick
from cablecomp.runtime.health import health_names
from cablecomp.runtime.loop import Loop, RunStage

END: Final = b"end"
PER_SECOND: Final = 25.0
_LARGEST: Final = 60_000
"""Bytes of a datagram: UDP carries 65 507."""


def packed(scalars: Mapping[str, Any], state: NDArray[Any] | None) -> bytes:
    """One frame as bytes: scalars as JSON, a line feed, the observer's state; too large a state is left out."""
    head = json.dumps(scalars).encode() + b"\n"
    body = b"" if state is None else state.tobytes()
    return head + (body if len(head) + len(body) <= _LARGEST else b"")


class Instrument:
    """Sends the first joint's last cycle to a viewer on this machine; `watch` is handed to the run.

    The socket does not block and its buffer is bounded: what does not go out at once is dropped, and `dropped`
    says how often.
    """

    def __init__(self, port: int, per_second: float = PER_SECOND) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(("127.0.0.1", port))
        self._period_s, self._next_s = 1.0 / per_second, 0.0
        self.sent = self.dropped = 0
        self._loop: Loop | None = None

    def watch(self, loop: Loop, tick: Tick) -> None:
        """Called once a tick; sends every `1 / per_second` of the loop's own time."""
        self._loop = loop
        if tick.now_s < self._next_s:
            return
        self._next_s = tick.now_s + self._period_s
        if loop.stage is RunStage.RUNNING:
            self._show(loop, tick.now_s)

    def _show(self, loop: Loop, now_s: float) -> None:
        joint = loop.joints[0]
        view = joint.view
        if view is None:
            return
        e, s, t = view.estimate, view.sample, loop.accounts.times
        events = loop.events.last
        event = " ".join(events[-1][1:]).strip() if events else ""
        zero = joint.setup.config.sensors.joint_position_offset_rad
        vector = getattr(joint.setup.compensator.observer, "vector", None)
        scalars = {
            "time_s": now_s,
            "joint": view.name,
            "phase": view.phase.name.lower(),
            "asked_rad": view.reference.joint_position_rad,
            "joint_position_rad": s.joint_position_rad,
            "motor_position_rad": s.motor_position_rad,
            "load_Nm": e.joint_torque_Nm,
            "deflection_rad": e.deflection_rad,
            "deflection_low_rad": e.deflection_low_rad,
            "deflection_high_rad": e.deflection_high_rad,
            "residual_rad": s.joint_position_rad - e.joint_position_rad - zero,
            "tension_h_N": e.tension_h_N,
            "tension_l_N": e.tension_l_N,
            "cycle_p99_s": t.cycle.quantile(0.99),
            "late_p99_s": t.jitter.quantile(0.99),
            "misses": t.misses,
            "alarms": list(health_names(view.flags)),
            "event": f"stop: {loop.stop_reason}" if loop.stop_reason else event,
            "dropped": self.dropped,
        }
        self.send(packed(scalars, None if vector is None else vector()))

    def send(self, datagram: bytes) -> None:
        """Send at once, or drop and count."""
        try:
            self._socket.send(datagram)
            self.sent += 1
        except OSError:  # full, or nobody there any more
            self.dropped += 1

    def close(self) -> None:
        """Show how the run ended, and say that it is over."""
        if self._loop is not None:
            self._show(self._loop, self._loop.accounts.last_s)
        self.send(END)
        self._socket.close()
