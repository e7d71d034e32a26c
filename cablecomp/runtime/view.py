"""The live terminal view: state, load, tensions, predicted deflection and bounds, timing, events. Drawn
by a thread of its own.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from types import TracebackType

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cablecomp.control.degrade import Phase
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.health import health_names
from cablecomp.runtime.joint_loop import JointLoop
from cablecomp.runtime.loop import Loop
from cablecomp.runtime.tally import View

_COLOURS = {
    Phase.NORMAL: "green",
    Phase.RECOVERING: "cyan",
    Phase.HELD: "yellow",
    Phase.FADING: "dark_orange",
    Phase.STOPPED: "red",
}


class LiveView:
    """Shows a loop while it runs; `watch` is handed to the run. A terminal that is gone is drawn on no more."""

    def __init__(self, console: Console, *, shown: bool = True, per_second: float = 8.0) -> None:
        self._console = console
        self._shown = shown and console.is_terminal
        self._period_s = 1.0 / per_second
        self._loop: Loop | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self.title = ""

    def watch(self, loop: Loop, tick: Tick) -> None:
        """Called once a tick; costs next to nothing."""
        self._loop = loop

    def say(self, line: str) -> None:
        """Print a line above the view."""
        self.title = line
        self._console.print(Text(line, style="bold"))

    def __enter__(self) -> LiveView:
        if self._shown:
            self._thread = threading.Thread(target=self._draw, name="view", daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def _draw(self) -> None:
        with suppress(OSError), Live(console=self._console, auto_refresh=False, transient=True) as live:
            while not self._over.wait(self._period_s):
                loop = self._loop
                if loop is not None:
                    live.update(render(loop), refresh=True)


def render(loop: Loop) -> RenderableType:
    """One picture of a loop, from what it has left in the open."""
    table = Table(title=None, expand=False, header_style="dim", box=None, pad_edge=False)
    for name in (
        "joint",
        "state",
        "wanted",
        "is",
        "load",
        "T_h",
        "T_l",
        "deflection",
        "bounds",
        "residual",
        "trouble",
    ):
        table.add_column(name, justify="left" if name in ("joint", "state", "trouble") else "right")
    for joint in loop.joints:
        view = joint.view
        if view is not None:
            table.add_row(*_row(joint, view))
    events = Text("\n".join(f"{t:9.3f} s  {j}  {w}" for t, j, w in loop.events.last[-4:]), style="dim")
    return Group(table, _timing(loop), events)


def _row(joint: JointLoop, view: View) -> tuple[RenderableType, ...]:
    e, s, r = view.estimate, view.sample, view.reference
    words = ", ".join(health_names(view.flags)) or joint.stop_reason
    residual = s.joint_position_rad - e.joint_position_rad
    residual -= joint.setup.config.sensors.joint_position_offset_rad
    return (
        view.name,
        Text(view.phase.name.lower(), style=_COLOURS[view.phase]),
        _number(r.joint_position_rad * 1e3, "mrad", 2),
        _number(s.joint_position_rad * 1e3, "mrad", 2),
        _number(e.joint_torque_Nm, "Nm", 3),
        _number(e.tension_h_N, "N", 1),
        _number(e.tension_l_N, "N", 1),
        _number(e.deflection_rad * 1e3, "mrad", 3),
        f"{_number(e.deflection_low_rad * 1e3, '', 3)} … {_number(e.deflection_high_rad * 1e3, '', 3)}",
        _number(residual * 1e3, "mrad", 3),
        Text(words, style="red"),
    )


def _timing(loop: Loop) -> Text:
    t = loop.accounts.times
    if t.cycle.count == 0:
        return Text(f"{loop.stage.name.lower()} …", style="bold")
    us = 1e6
    return Text(
        f"{loop.stage.name.lower()} {loop.since_s:6.1f} s   step p50 {t.step.quantile(0.5) * us:.1f} p99 "
        f"{t.step.quantile(0.99) * us:.1f} µs   cycle p99 {t.cycle.quantile(0.99) * us:.0f} µs   late p99 "
        f"{t.jitter.quantile(0.99) * us:.0f} µs   missed {t.misses}",
        style="bold",
    )


def _number(value: float, unit: str, digits: int) -> str:
    return "–" if value != value else f"{value:.{digits}f} {unit}".rstrip()
