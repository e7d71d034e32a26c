"""What the loop gives away arrives whole, never waits, and is drawn."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import PHONE, SIDEWAYS, browser, needs_browser, opened
from made_up_frames import made_up

from cablecomp import load_joint
from cablecomp.monitor.played import played
from cablecomp.monitor.server import PageServer
from cablecomp.monitor.sinks import Foxglove, Mcap, PlotJuggler
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.recording.writer import write_canonical
from cablecomp.report.page import CSS

NARROWEST = """() => {
  window.narrowest = 1e9;
  const draws = CanvasRenderingContext2D.prototype, fillText = draws.fillText;
  draws.fillText = function (text, x, y) {
    if (this.textAlign === "right") narrowest = Math.min(narrowest, x - this.measureText(text).width);
    fillText.call(this, text, x, y);
  };
}"""
"""Keeps the least left end [px] of an upright axis' labels, beside which its title stands."""


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
