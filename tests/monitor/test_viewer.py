"""The viewer beside a run: there from the first frame, deaf to the terminal's keys, and its page for this machine."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from http.client import HTTPConnection
from http.server import ThreadingHTTPServer
from multiprocessing import active_children
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from made_up_frames import made_up

from cablecomp import load_joint
from cablecomp.monitor import viewer
from cablecomp.monitor.instrument import packed
from cablecomp.monitor.server import PageServer
from cablecomp.observer import Observer
from cablecomp.report.page import CSS


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
