"""`cablecomp run` as a process in real time, on a UDP bus, against the drive and listener of `mit_joint`."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
from fault_runs import CONFIGS, GAINS, JOINT
from mit_joint import MitJoint

RATE_HZ = 200
GROUP = "239.74.163.2"


class Host:
    """The forking process."""

    def __init__(self) -> None:
        self._child = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("run_host.py")), str(JOINT)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.design_tools = self.answer(240.0)

    def start(self, **wanted: Any) -> int:
        """Fork a command; returns its process id."""
        assert self._child.stdin is not None
        self._child.stdin.write(json.dumps(wanted) + "\n")
        self._child.stdin.flush()
        return int(self.answer())

    def answer(self, wait_s: float = 60.0) -> Any:
        """The next line, as soon as it is there."""
        out = self._child.stdout
        assert out is not None
        assert select.select([out], [], [], wait_s)[0], "no answer"
        return json.loads(out.readline())

    def close(self) -> None:
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._child.stdin.close()
        self._child.wait(60.0)
        self._child.stdout.close()


class LiveJoint:
    """The joint in a thread, at the loop's rate; it lets go by itself when commands stay out for 0.3 s."""

    def __init__(self, port: int) -> None:
        self.bus = can.Bus(
            interface="udp_multicast", channel=GROUP, port=port, hop_limit=0, ignore_config=True
        )
        self.joint = MitJoint(self.bus)
        self.joint.period_s = 1.0 / RATE_HZ
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        due, quiet, count = time.monotonic(), 0, 0
        while not self._over.wait(max(due - time.monotonic(), 0.0)):
            due += 1.0 / RATE_HZ
            self.joint.advance()
            quiet = quiet + 1 if len(self.joint.heard) == count else 0
            count = len(self.joint.heard)
            if quiet > 0.3 * RATE_HZ:
                self.joint.enabled = False

    def close(self) -> None:
        self._over.set()
        self._thread.join(5.0)
        self.joint.close()


class LiveRun:
    """One run of `cablecomp run` in `folder`."""

    def __init__(self, host: Host, folder: Path) -> None:
        self.folder, self.out = folder, folder / "out"
        self.host = host
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("", 0))
            port = free.getsockname()[1]
        self.live = LiveJoint(port)
        self.joint = self.live.joint
        (folder / "link.toml").write_text(link_text(port), encoding="utf-8")
        (folder / "control.toml").write_text(control_text(), encoding="utf-8")
        self.pid = 0

    def start(self, *more: str, out: Path | None = None, terminal: str | None = None, **wanted: Any) -> None:
        """Begin."""
        arguments = ["run", "--config", str(JOINT), "--link", "link.toml", "--control", "control.toml"]
        arguments += ["--no-bounds", "--out", str(self.out if out is None else out), *more]
        self.pid = self.host.start(
            arguments=arguments,
            cwd=str(self.folder),
            said=str(self.folder / "said.txt"),
            terminal=terminal,
            **wanted,
        )

    def wait_for_commands(self, count: int, wait_s: float = 30.0) -> None:
        """Until the drive has heard that many commands."""
        self.wait_for(lambda: len(self.joint.commands) >= count, wait_s)

    def wait_for(self, condition: Callable[[], bool], wait_s: float = 30.0) -> None:
        """Until the joint's thread has come to that."""
        end = time.monotonic() + wait_s
        while not condition():
            assert time.monotonic() < end, (self.said(), self.joint.heard[-3:])
            time.sleep(0.02)

    def signal(self, *numbers: signal.Signals) -> None:
        for number in numbers:
            os.kill(self.pid, number)

    def wait(self) -> int:
        """Its exit code."""
        return int(self.host.answer())

    def said(self) -> str:
        path = self.folder / "said.txt"
        return path.read_text(encoding="utf-8") if path.exists() else ""

    def close(self) -> None:
        self.live.close()


def control_text() -> str:
    """The wrist's control file with stated gains; on a busy computer the joint's thread may be late by a second:
    that is no encoder that is stuck.
    """
    text = (CONFIGS / "control/wrist-capstan.toml").read_text(encoding="utf-8")
    gains = "".join(f"{key} = {value}\n" for key, value in GAINS.items())
    left_out = ("stuck_rad", "joint_residual_rad", "lead_rad")
    kept = [line for line in text.splitlines() if not line.startswith(left_out)]
    return "\n".join(kept).replace("[compensator]\n", f"[compensator]\n{gains}") + "\nlead_rad = 100.0\n"


def link_text(port: int) -> str:
    text = (CONFIGS / "links/mit-udp.toml").read_text(encoding="utf-8")
    for old, new in (
        ("rate_Hz = 1000.0", f"rate_Hz = {RATE_HZ}.0"),
        ("port = 43113", f"port = {port}"),
        ("hold_s = 0.01", "hold_s = 1.0"),
        ("fade_s = 0.1", "fade_s = 4.0"),
        ("stop_s = 0.2", "stop_s = 8.0"),
        ('dbc = "', f'dbc = "{CONFIGS}/links/'),
    ):
        assert old in text, old
        text = text.replace(old, new)
    return text
