"""What the loop gives away: it never waits, arrives whole, and says what the run says."""

from __future__ import annotations

import socket
from io import StringIO
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_up_frames import WRAP
from rich.console import Console

from cablecomp.control.command import Reference
from cablecomp.control.degrade import Phase
from cablecomp.monitor.frames import unpacked
from cablecomp.monitor.instrument import END, Instrument, packed
from cablecomp.observer import WrapProfile
from cablecomp.runtime.loop import RunStage
from cablecomp.runtime.tally import View
from cablecomp.runtime.view import render
from cablecomp.signals import NAN, Estimate, Sample


def test_a_frame_survives_the_way() -> None:
    """Scalars, what is not finite, and the state's floats bit by bit; a state too large is left out, not the frame."""
    state = np.random.default_rng(1).standard_normal(300)
    seen: list[Any] = []

    def profiles(vector: Any) -> list[WrapProfile]:
        seen.append(vector)
        return [WRAP]

    found = unpacked(packed({"time_s": 1.5, "residual_rad": float("nan"), "alarms": ["a"]}, state), profiles)
    assert np.array_equal(seen[0], state)
    assert (found["time_s"], found["residual_rad"], found["alarms"]) == (1.5, None, ["a"])
    wrap = found["wraps"][0]
    assert wrap["name"] == WRAP.name
    assert len(wrap["angle_rad"]) == len(wrap["tension_N"]) <= 60
    assert (wrap["angle_rad"][0], wrap["angle_rad"][-1]) == (0.0, 6.0)
    assert unpacked(packed({"time_s": 2.0}, np.zeros(20_000)), profiles)["wraps"] == []


def test_nobody_is_waited_for() -> None:
    """With nobody there, or nobody who reads, sending returns at once; what was lost is counted."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        instrument = Instrument(receiver.getsockname()[1])
        for _ in range(200):
            instrument.send(bytes(30_000))
        assert instrument.sent + instrument.dropped == 200
    before = instrument.dropped
    for _ in range(4):
        instrument.send(b"x")
    assert instrument.dropped > before  # the port is closed: the system says so
    instrument.close()


def a_loop() -> SimpleNamespace:
    """A loop with one joint at 1 s, as far as onlookers see it; its encoder reads 0.02 rad too much."""
    sensors = SimpleNamespace(joint_position_offset_rad=0.02)
    setup = SimpleNamespace(
        config=SimpleNamespace(sensors=sensors), compensator=SimpleNamespace(observer=None)
    )
    seen = Estimate(1.0, 1e-3, NAN, NAN, 0.3, 0.5, 60.0, 60.0)
    view = View("arm", 1.0, Phase.NORMAL, Sample(1.0, 0.9, 0.5, 0.321), seen, None, Reference(0.3), 0)  # type: ignore[arg-type]  # no command is drawn
    histogram = SimpleNamespace(quantile=lambda share: 1e-4, count=1)
    return SimpleNamespace(
        joints=[SimpleNamespace(view=view, setup=setup, stop_reason="")],
        stage=RunStage.RUNNING,
        stop_reason="",
        accounts=SimpleNamespace(
            times=SimpleNamespace(cycle=histogram, jitter=histogram, step=histogram, misses=0), last_s=1.0
        ),
        events=SimpleNamespace(last=[]),
        since_s=1.0,
    )


def test_what_the_joint_encoder_reads_too_much_is_no_residual() -> None:
    loop = a_loop()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        instrument = Instrument(receiver.getsockname()[1])
        instrument.watch(loop, SimpleNamespace(now_s=1.0))  # type: ignore[arg-type]  # a stand-in for a loop
        found = unpacked(receiver.recv(65_535), lambda vector: ())
        instrument.close()
    assert found["residual_rad"] == pytest.approx(0.001, abs=1e-12)
    assert found["measured_rad"] == pytest.approx(0.002, abs=1e-12)
    console = Console(width=200, record=True, file=StringIO())
    console.print(render(loop))  # type: ignore[arg-type]  # a stand-in for a loop
    drawn = console.export_text()
    assert drawn.count(" 1.000 mrad") == 2  # the deflection, and 0.321 - 0.02 - 0.3 rad


def test_the_last_frame_says_why_the_run_ended() -> None:
    """Whatever else was the last event, and however soon after the frame before."""
    loop = a_loop()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        instrument = Instrument(receiver.getsockname()[1])
        loop.events.last.append((0.9, "", "enabling -> running"))
        instrument.watch(loop, SimpleNamespace(now_s=1.0))  # type: ignore[arg-type]  # a stand-in for a loop
        loop.stage, loop.stop_reason, loop.accounts.last_s = (
            RunStage.STOPPING,
            "arm: drive reports fault",
            1.001,
        )
        loop.events.last.append((1.001, "", "running -> stopping"))
        instrument.watch(loop, SimpleNamespace(now_s=1.001))  # type: ignore[arg-type]  # a stand-in for a loop
        instrument.close()
        found = [unpacked(receiver.recv(65_535), lambda vector: ()) for _ in range(2)]
        assert receiver.recv(65_535) == END
    assert [(f["time_s"], f["event"]) for f in found] == [
        (1.0, "enabling -> running"),
        (1.001, "stop: arm: drive reports fault"),
    ]
