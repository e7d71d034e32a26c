"""What the loop gives away arrives whole, never waits, and is drawn."""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.client import HTTPConnection
from http.server import ThreadingHTTPServer
from io import StringIO
from multiprocessing import active_children
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from browser import PHONE, SIDEWAYS, browser, needs_browser, opened
from rich.console import Console

from cablecomp import load_joint
from cablecomp.control.command import Reference
from cablecomp.control.degrade import Phase
from cablecomp.monitor import viewer
from cablecomp.monitor.frames import Frame, frame, unpacked
from cablecomp.monitor.instrument import END, Instrument, packed
from cablecomp.monitor.played import played
from cablecomp.monitor.server import PageServer
from cablecomp.monitor.sinks import Foxglove, Mcap, PlotJuggler
from cablecomp.observer import Observer, WrapProfile
from cablecomp.recording.reader import open_recording
from cablecomp.recording.writer import write_canonical
from cablecomp.report.page import CSS
from cablecomp.runtime.loop import RunStage
from cablecomp.runtime.tally import View
from cablecomp.runtime.view import render
from cablecomp.signals import NAN, Estimate, Sample

WRAP = WrapProfile(
    "cable h, output pulley", np.linspace(0.0, 6.0, 200), 60.0 + np.sin(np.linspace(0.0, 6.0, 200))
)


NARROWEST = """() => {
  window.narrowest = 1e9;
  const draws = CanvasRenderingContext2D.prototype, fillText = draws.fillText;
  draws.fillText = function (text, x, y) {
    if (this.textAlign === "right") narrowest = Math.min(narrowest, x - this.measureText(text).width);
    fillText.call(this, text, x, y);
  };
}"""
"""Keeps the least left end [px] of an upright axis' labels, beside which its title stands."""


def made_up(k: int) -> Frame:
    """Frame number k of a joint under a swinging load."""
    load = float(np.sin(0.1 * k))
    return frame(
        {
            "time_s": 0.04 * k, "joint": "wrist", "phase": "normal", "load_Nm": load, "deflection_rad": 1e-3 * load,
            "deflection_low_rad": -1.0, "deflection_high_rad": 1.0, "residual_rad": 1e-5, "cycle_p99_s": 1e-4,
            "late_p99_s": float("nan"), "misses": 0, "alarms": ["motor position is stale"] if k == 60 else [],
            "dropped": 0,
        },
        [WRAP],
    )  # fmt: skip


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
    view = View("arm", 1.0, Phase.NORMAL, Sample(1.0, 0.9, 0.5, 0.321), seen, None, Reference(0.3), 0)  # type: ignore[arg-type]
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


def test_frames_come_from_the_first_second_on(tmp_path: Path) -> None:
    """Once the viewer says that it is there, the first frame's profiles load no code: at 25 Hz it would still be at it
    when its socket is full. A process of its own, as the viewer is one, so that nothing is loaded before."""
    observer = Observer(load_joint("wrist-capstan"))
    observer.run({"time_s": [0.0, 1.0], "motor_position_rad": [0.0, 0.1], "joint_torque_Nm": [0.0, 0.5]})
    np.save(tmp_path / "state.npy", observer.vector())
    done = subprocess.run(
        [sys.executable, "-c", FIRST_FRAME, str(tmp_path / "state.npy")],
        capture_output=True, text=True, timeout=300, check=True,
    )  # fmt: skip
    wraps, loaded = done.stdout.split()
    assert (wraps, loaded) == ("4", "0")


FIRST_FRAME = """
import sys
import numpy as np
from cablecomp import load_joint
from cablecomp.monitor.frames import profiles_of, unpacked
from cablecomp.monitor.instrument import packed
datagram = packed({"time_s": 0.0}, np.load(sys.argv[1]))
profiles = profiles_of(load_joint("wrist-capstan"))
before = set(sys.modules)
found = unpacked(datagram, profiles)
print(len(found["wraps"]), len({m for m in set(sys.modules) - before if m.startswith("numba")}))
"""


def test_what_the_joint_encoder_reads_too_much_is_no_residual() -> None:
    loop = a_loop()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        instrument = Instrument(receiver.getsockname()[1])
        instrument.watch(loop, SimpleNamespace(now_s=1.0))  # type: ignore[arg-type]
        found = unpacked(receiver.recv(65_535), lambda vector: ())
        instrument.close()
    assert found["residual_rad"] == pytest.approx(0.001, abs=1e-12)
    assert found["measured_rad"] == pytest.approx(0.002, abs=1e-12)
    console = Console(width=200, record=True, file=StringIO())
    console.print(render(loop))  # type: ignore[arg-type]
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
        instrument.watch(loop, SimpleNamespace(now_s=1.0))  # type: ignore[arg-type]
        loop.stage, loop.stop_reason, loop.accounts.last_s = (
            RunStage.STOPPING,
            "arm: drive reports fault",
            1.001,
        )
        loop.events.last.append((1.001, "", "running -> stopping"))
        instrument.watch(loop, SimpleNamespace(now_s=1.001))  # type: ignore[arg-type]
        instrument.close()
        found = [unpacked(receiver.recv(65_535), lambda vector: ()) for _ in range(2)]
        assert receiver.recv(65_535) == END
    assert [(f["time_s"], f["event"]) for f in found] == [
        (1.0, "enabling -> running"),
        (1.001, "stop: arm: drive reports fault"),
    ]


@pytest.mark.parametrize("asked", [b"", b"GET / HT", b"GET /events HTTP/1.1\r\n\r\n"])
def test_a_browser_that_breaks_off_says_nothing_on_the_terminal(
    asked: bytes, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A connection that is reset (SO_LINGER of 0 s) before, within, or after a request; the next one is served."""
    over = threading.Event()
    shut = ThreadingHTTPServer.shutdown_request

    def shutdown_request(server: Any, request: Any) -> None:
        shut(server, request)
        over.set()

    monkeypatch.setattr(ThreadingHTTPServer, "shutdown_request", shutdown_request)
    server = PageServer("arm", CSS)
    port = int(server.address.rstrip("/").rpartition(":")[2])
    gone = socket.create_connection(("127.0.0.1", port))
    gone.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    gone.send(asked)
    gone.close()
    for k in range(10):
        server.take(made_up(k))
    server.finish()
    assert over.wait(10.0)
    with urlopen(server.address) as page:
        assert page.status == 200
    server.close()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:{}", 200), ("localhost:{}", 200), ("LocalHost", 200), ("[::1]:{}", 200),
        ("evil.example:{}", 403), ("127.0.0.1.evil.example:{}", 403), ("[::2]:{}", 403), ("", 403),
    ],
)  # fmt: skip
def test_a_page_from_elsewhere_does_not_read_the_joint(host: str, status: int) -> None:
    """A browser says by which name it asks; a foreign one that leads here (DNS rebinding) gets neither page nor
    frames."""
    server = PageServer("arm", CSS)
    server.take(made_up(1))
    server.finish()
    port = int(server.address.rstrip("/").rpartition(":")[2])
    for path in ("/", "/events"):
        asked = HTTPConnection("127.0.0.1", port, timeout=5.0)
        asked.request("GET", path, headers={"Host": host.format(port)})
        answer = asked.getresponse()
        assert answer.status == status
        assert (b"load_Nm" in answer.read()) == (status == 200)
        asked.close()
    server.close()


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no signals can be held back here")
def test_a_terminal_s_keys_do_not_reach_the_viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SIGINT, SIGQUIT, SIGTSTP and SIGHUP, while it starts and while it serves, are for the run alone."""
    pytest.importorskip("mcap", reason="mcap is not installed")

    def press_them() -> None:
        for number in (signal.SIGINT, signal.SIGQUIT, signal.SIGTSTP, signal.SIGHUP):
            os.kill(active_children()[0].pid or 0, number)

    answer = viewer._answer

    def answer_meanwhile(here: Any) -> Any:
        press_them()
        return answer(here)

    monkeypatch.setattr(viewer, "_answer", answer_meanwhile)
    who = viewer.Onlookers(mcap=tmp_path / "live.mcap")
    with viewer.watched(load_joint("wrist-capstan"), who, CSS) as found:
        press_them()
        found.instrument.send(packed(made_up(1), None))
    assert found.failures == ()
    assert b"load_Nm" in (tmp_path / "live.mcap").read_bytes()


def test_plotjuggler_gets_curves() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        sink = PlotJuggler(receiver.getsockname())
        sink.take(made_up(10))
        found = json.loads(receiver.recv(65_535))
        sink.close()
    assert found["timestamp"] == pytest.approx(0.4)
    assert found["wrist"]["load_Nm"] == pytest.approx(np.sin(1.0))
    assert all(isinstance(v, int | float) for v in found["wrist"].values())


def test_the_file_holds_what_came_before_a_crash(tmp_path: Path) -> None:
    """Cut off without its end, it gives back every frame but those of the last second."""
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    stream_reader = pytest.importorskip("mcap.stream_reader", reason="mcap is not installed")
    path = tmp_path / "live.mcap"
    sink = Mcap(path)
    for k in range(101):
        sink.take(made_up(k))
    (tmp_path / "cut.mcap").write_bytes(path.read_bytes())  # what a crash would leave
    sink.close()
    with path.open("rb") as stream:
        whole = [json.loads(m.data) for _, _, m in reader.make_reader(stream).iter_messages()]
    assert whole == [made_up(k) for k in range(101)]
    with (tmp_path / "cut.mcap").open("rb") as stream:
        kept = [
            json.loads(r.data)
            for r in _until_the_end(stream_reader.StreamReader(stream))
            if hasattr(r, "data") and hasattr(r, "channel_id")
        ]
    assert kept == whole[: len(kept)]
    assert kept[-1]["time_s"] >= whole[-1]["time_s"] - 1.0


def _until_the_end(reader: Any) -> Iterator[Any]:
    from mcap.exceptions import McapError

    try:
        yield from reader.records
    except (McapError, EOFError):
        return


LISTEN = """(port) => new Promise((done, fail) => {
  const socket = new WebSocket(`ws://127.0.0.1:${port}`, ["foxglove.sdk.v1"]);
  socket.binaryType = "arraybuffer";
  setTimeout(() => fail("nothing came"), 20000);
  let channel;
  socket.onmessage = ({ data }) => {
    if (typeof data !== "string") { socket.close(); done([channel, new TextDecoder().decode(data.slice(13))]); return; }
    const said = JSON.parse(data);
    if (said.op !== "advertise") return;
    channel = said.channels[0];
    socket.send(JSON.stringify({ op: "subscribe", subscriptions: [{ id: 1, channelId: channel.id }] }));
  };
})"""


def test_foxglove_is_served_beside_another_run() -> None:
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    with socket.create_server(("127.0.0.1", 0)) as other:
        taken = other.getsockname()[1]
        sink = Foxglove(port=taken)
        assert sink.port != taken
        socket.create_connection(("127.0.0.1", sink.port), timeout=1.0).close()
        sink.close()


@needs_browser
def test_a_foxglove_client_gets_the_channel_its_schema_and_frames() -> None:
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    sink, over = Foxglove(port=0), threading.Event()

    def send() -> None:
        while not over.wait(0.02):
            sink.take(made_up(10))

    sender = threading.Thread(target=send)
    sender.start()
    try:
        with browser() as chromium:
            channel, frame = chromium.new_page().evaluate(LISTEN, sink.port)
    finally:
        over.set()
        sender.join()
        sink.close()
    assert (channel["topic"], channel["schemaName"]) == ("/live", "cablecomp.Live")
    fields = json.loads(channel["schema"])["properties"]
    assert (fields["load_Nm"]["type"], fields["joint"]["type"], fields["wraps"]["type"]) == (
        "number",
        "string",
        "array",
    )
    assert json.loads(frame) == made_up(10)


@needs_browser
@pytest.mark.parametrize("width", [1280, PHONE])
def test_the_page_draws_plays_and_scrubs(width: int) -> None:
    """Every panel has marks, a wrap has one of its own; pause holds, the slider goes back, the end is said."""
    server = PageServer("wrist <1>", CSS)
    for k in range(60):
        server.take(made_up(k))
    with browser() as chromium, opened(chromium, server.address, width) as page:
        page.wait_for_function("frames.length === 60 && Object.values(canvases).length === 5")
        page.wait_for_function("Object.values(canvases).every((c) => c.canvas.dataset.marks > 1)")
        assert page.evaluate(SIDEWAYS) <= 0
        assert page.inner_text("h1") == "wrist <1>"
        assert "bounds (wider than this)" in page.inner_text("body")
        server.take(made_up(60))
        page.wait_for_function("document.getElementById('alarms').textContent.includes('stale')")
        page.click("#play")
        server.take(made_up(61))
        page.wait_for_function("frames.length === 62")
        assert page.evaluate("at") == 60
        page.evaluate("(() => { const s = document.getElementById('scrub'); s.value = 5; s.oninput(); })()")
        page.wait_for_function("document.getElementById('when').textContent === '0.20 s'")
        server.close()
        page.wait_for_function("document.getElementById('words').textContent.includes('over')")
        page.click("#play")
        page.wait_for_function("at > 5")


@needs_browser
def test_a_recording_is_played(tmp_path: Path) -> None:
    """All frames at once, then play from the start; what a recording does not know has no panel."""
    joint = load_joint("wrist-capstan")
    columns = {"time_s": np.arange(0.0, 4.0, 0.01), "motor_position_rad": np.zeros(400)}
    columns["joint_torque_Nm"] = np.sin(columns["time_s"])
    columns["joint_position_rad"] = Observer(joint).run(columns)["joint_position_rad"]
    write_canonical(tmp_path / "swing.csv", columns)
    frames = list(played(open_recording(tmp_path / "swing.csv"), joint, 4.0, bounds=False))
    assert [f["time_s"] for f in frames] == pytest.approx(np.arange(0.0, 4.0, 0.04))
    assert all(abs(f["residual_rad"]) < 1e-9 and len(f["wraps"]) == 4 for f in frames)
    server = PageServer("swing", CSS)
    for found in frames:
        server.take(found)
    server.finish()
    with browser() as chromium, opened(chromium, server.address) as page:
        page.wait_for_function("over && !dirty")  # drawn, too
        assert page.inner_text("#play") == "play"
        assert "a recording, 100 frames" in page.inner_text("#words")
        assert not page.is_visible("text=Timing")
        page.evaluate(NARROWEST)
        page.click("#play")
        page.wait_for_function("at > 0 && at < 99")
        page.wait_for_function("at === 99 && document.getElementById('play').textContent === 'play'")
        assert page.evaluate("narrowest") > 15.0
    server.close()
