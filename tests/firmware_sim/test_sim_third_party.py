"""Third-party clients read the wire: python-can's logger and player, cantools' decoder, with the tables
that ship."""

from __future__ import annotations

import contextlib
import fcntl
import io
import os
import runpy
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

import can
import pytest
from far_end import encode_command
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveState, Setpoint
from firmware_sim.ports import open_port
from firmware_sim.ports.can_port import CanPort
from firmware_sim.wire.mit import MODELS

LINKS = Path(__file__).resolve().parents[2] / "configs" / "links"
ENTER = b"\xff" * 7 + b"\xfc"
HOLD = encode_command(MODELS["AK80-9"], Setpoint(0.2, 0.0, 0.0, 5.0, 0.1))
TABLES = {"mit": "cablecomp_mit_ak80_9.dbc", "odrive": "cablecomp_odrive.dbc", "dbc": "cablecomp_joint.dbc"}
ORDERS = {
    "mit": [(1, ENTER), (1, HOLD)],
    "odrive": [
        (0x27, bytes.fromhex("08000000")),
        (0x2B, bytes.fromhex("0300000001000000")),
        (0x2C, bytes.fromhex("CDCCCC3D00000000")),
    ],
    "dbc": [(0x6C1, bytes.fromhex("0203280064000000")), (0x6C0, bytes.fromhex("20A1070000000000"))],
}


def message(identifier: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)


def bench_on(channel: str, protocol: str) -> Bench:
    return make_bench(
        BenchConfig(protocol=protocol), lambda number: TwoMass(), open_port(f"virtual:{channel}")
    )


def record(path: Path, protocol: str, steps: int = 60) -> list[can.Message]:
    """A short motion recorded by python-can's own logger; returns what a second listener heard."""
    channel = path.name
    heard = []
    with (
        bench_on(channel, protocol) as bench,
        can.Bus(interface="virtual", channel=channel) as host,
        can.Bus(interface="virtual", channel=channel) as ear,
        can.Logger(path) as logger,
    ):
        *first, last = ORDERS[protocol]
        for order in first:
            host.send(message(*order))
        bench.pump()
        for _ in range(steps):
            host.send(message(*last))
            bench.pump()
        while (m := ear.recv(0.0)) is not None:
            heard.append(m)
            logger.on_message_received(m)
    return heard


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
def test_logger_records_and_player_replays(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"motion{suffix}"
    heard = record(path, "mit")
    with can.LogReader(path) as reader:
        logged = list(reader)
    assert [(m.arbitration_id, bytes(m.data)) for m in logged] == [
        (m.arbitration_id, bytes(m.data)) for m in heard
    ]
    with (
        bench_on(f"again{suffix}", "mit") as bench,
        can.Bus(interface="virtual", channel=f"again{suffix}") as player,
        can.Bus(interface="virtual", channel=f"again{suffix}") as ear,
    ):
        for m in can.MessageSync(logged, timestamps=False, gap=0.0):
            if m.arbitration_id == 1:  # the host's side of the recording drives a second joint
                player.send(m)
                bench.pump()
        again = list(iter(lambda: ear.recv(0.0), None))
        assert bench.joints[0].drive.state is DriveState.ENABLED
    told = [[bytes(m.data) for m in listened if m.arbitration_id == 0x680] for listened in (heard, again)]
    assert len(told[0]) == 60
    assert told[0] == told[1]  # the same commands, the same motion, bit for bit


@pytest.mark.parametrize("protocol", ["mit", "odrive", "dbc"])
def test_cantools_decodes_a_candump_log(
    tmp_path: Path, protocol: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "motion.log"
    heard = record(path, protocol, steps=12)
    monkeypatch.setattr(sys, "argv", ["cantools", "decode", "--single-line", str(LINKS / TABLES[protocol])])
    monkeypatch.setattr(sys, "stdin", io.StringIO(path.read_text()))
    runpy.run_module("cantools", run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(heard)
    assert not [line for line in lines if "Unknown frame id" in line or "Failed" in line]
    samples = [line for line in lines if "Joint1_State(" in line]
    assert len(samples) == 12
    assert "joint_position_rad:" in samples[0]
    assert "sequence: 11" in samples[-1]


def test_a_refused_frame_is_counted_not_fatal() -> None:
    class Refusing:
        def send(self, sent: can.Message) -> None:
            raise can.CanOperationError("transmit buffer full")

        def recv(self, timeout: float) -> None:
            raise can.CanOperationError("bus off")

        def shutdown(self) -> None:
            pass

    port = CanPort(Refusing(), {})
    bench = make_bench(BenchConfig(), lambda number: TwoMass(), port)
    bench.tick(0.01)
    assert port.errors > 10
    bench.close()


def multicast(port: int) -> list[str]:
    """Bus options of python-can's command lines."""
    group = ["-i", "udp_multicast", "-c", "239.74.163.8"]
    return [*group, "--bus-kwargs", f"port={port}", "hop_limit=0", "fd=False"]


def udp(port: int) -> can.BusABC:
    return can.Bus(interface="udp_multicast", channel="239.74.163.8", port=port, hop_limit=0, fd=False)


def waiting(port: int) -> int:
    """Bytes that lie unread in any socket on this UDP port."""
    rows = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    return sum(int(row[4].split(":")[1], 16) for row in rows if int(row[1].split(":")[1], 16) == port)


def multicast_works() -> bool:
    if not Path("/proc/net/udp").exists():
        return False
    try:
        with udp(43910) as bus:
            bus.send(message(1, b""))
        return True
    except (OSError, can.CanError):
        return False


@pytest.mark.skipif(not multicast_works(), reason="needs Linux and a route for multicast")
def test_the_command_lines_of_logger_and_player_across_processes(tmp_path: Path) -> None:
    path = tmp_path / "bus.log"
    logger = subprocess.Popen(
        [sys.executable, "-u", "-m", "can.logger", "-f", str(path), *multicast(43911)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        port = open_port("udp_multicast:239.74.163.8:43911")
        with make_bench(BenchConfig(), lambda number: TwoMass(), port) as bench, udp(43911) as host:
            assert logger.stdout is not None
            logger.stdout.readline()  # "Connected to …"
            end = time.monotonic() + 10.0
            while not path.exists() and time.monotonic() < end:
                port.wait(0.02)
            host.send(message(1, ENTER))
            for _ in range(40):
                host.send(message(1, HOLD))
            end = time.monotonic() + 5.0
            while bench.steps < 40 and time.monotonic() < end:
                port.wait(0.1)
                bench.pump()
            time_of_recording = bench.joints[0].truth
            for _ in range(20):
                host.send(message(0x7FF, b""))  # whatever the logger leaves behind is among these
            end = time.monotonic() + 10.0
            while waiting(43911) and time.monotonic() < end:
                bench.pump()
                while host.recv(0.0) is not None:
                    pass
    finally:
        logger.send_signal(signal.SIGINT)
        logger.wait(10.0)
        logger.stdout.close()
    text = path.read_text()
    assert text.count(" 680#") == 40
    only_host = tmp_path / "host.log"
    only_host.write_text("".join(line for line in text.splitlines(keepends=True) if " 001#" in line))
    port = open_port("udp_multicast:239.74.163.8:43912")
    with make_bench(BenchConfig(), lambda number: TwoMass(), port) as bench:
        player = [sys.executable, "-m", "can.player", *multicast(43912), "--", str(only_host)]
        subprocess.run(player, timeout=60, check=True, capture_output=True)
        end = time.monotonic() + 5.0
        while bench.steps < 40 and time.monotonic() < end:
            port.wait(0.1)
            bench.pump()
        assert bench.joints[0].truth == time_of_recording


@pytest.mark.skipif(not multicast_works(), reason="needs Linux and a route for multicast")
def test_cantools_monitor_shows_the_bus_with_the_shipped_table() -> None:
    master, slave = os.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    table = str(LINKS / TABLES["mit"])
    monitor = subprocess.Popen(
        [sys.executable, "-m", "cantools", "monitor", "--single-line", *multicast(43913), "--", table],
        stdin=slave, stdout=slave, stderr=slave, env={**os.environ, "TERM": "xterm"},
    )  # fmt: skip
    os.close(slave)
    screen = b""
    try:
        port = open_port("udp_multicast:239.74.163.8:43913")
        with make_bench(BenchConfig(), lambda number: TwoMass(), port) as bench:
            end, now = time.monotonic() + 20.0, 0.0
            while b"joint_position_rad" not in screen and time.monotonic() < end:
                now += 0.01
                bench.tick(now)
                if select.select([master], [], [], 0.01)[0]:
                    screen += os.read(master, 65536)
        os.write(master, b"q")
        end = time.monotonic() + 10.0
        while monitor.poll() is None and time.monotonic() < end:
            if select.select([master], [], [], 0.05)[0]:
                with contextlib.suppress(OSError):  # the terminal's last reader is gone
                    os.read(master, 65536)
    finally:
        monitor.kill()
        monitor.wait()
        os.close(master)
    assert b"Joint1_State(" in screen
    assert b"joint_position_rad" in screen
