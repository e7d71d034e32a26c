"""What a frame costs: python-can's own receive against the ports', and decoding and encoding a joint in a
cycle.

Times are CPU times of one process per frame or joint. Run with `pytest tests/bench/test_bench_links.py
--benchmark-only`.
"""

from __future__ import annotations

import os
import socket
import struct
import subprocess
import sys
import threading
import time
import tty
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from cablecomp.links import BusLink, MotorCommand, load_link
from cablecomp.links.port_can import can_port
from cablecomp.links.port_line import serial_port
from cablecomp.links.port_socket import SocketCanPort
from cablecomp.links.serial_frames import pack_record

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
FRAMES = 64
DATA = bytes.fromhex("01 80 00 7F F7 FF 24 00")
MULTICAST = {"port": 20000 + os.getpid() % 20000, "hop_limit": 0}


def sink(identifier: int, data: bytes) -> None:
    """Takes a frame and does nothing."""


def per_frame(benchmark: Any, fill: Callable[[], None], drain: Callable[[], int]) -> None:
    """Benchmark `drain` after `fill`, FRAMES frames a round, in CPU time; report microseconds a frame."""
    seen = benchmark.pedantic(
        drain, setup=lambda: (fill(), None)[1], rounds=200, iterations=1, warmup_rounds=10
    )
    assert seen == FRAMES
    benchmark.extra_info["us_per_frame"] = benchmark.stats.stats.median / FRAMES * 1e6


def drain_stock(bus: Any, wait_s: float = 0.0) -> int:
    n = 0
    while n < FRAMES and bus.recv(wait_s) is not None:
        n += 1
    return n


def drain_line(port: Any) -> int:
    """A terminal hands bytes over a little later than they were written."""
    n = 0
    while n < FRAMES:
        n += port.drain(sink, 1000)
    return n


def message() -> can.Message:
    return can.Message(arbitration_id=1, is_extended_id=False, data=DATA)


@pytest.fixture
def virtual() -> Iterator[tuple[Any, str]]:
    channel = uuid.uuid4().hex
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    yield bus, channel
    bus.shutdown()


@pytest.mark.benchmark(group="receive: virtual, 64 frames", timer=time.process_time)
@pytest.mark.parametrize("way", ["python-can recv(0)", "cablecomp"])
def test_receive_virtual(benchmark: Any, virtual: tuple[Any, str], way: str) -> None:
    sender, channel = virtual

    def fill() -> None:
        for _ in range(FRAMES):
            sender.send(message())

    if way == "cablecomp":
        port = can_port("virtual", channel, None, {})
        port.open()
        per_frame(benchmark, fill, lambda: port.drain(sink, 1000))
        port.close()
    else:
        stock = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        per_frame(benchmark, fill, lambda: drain_stock(stock))
        stock.shutdown()


@pytest.mark.benchmark(group="receive: udp_multicast, 64 frames", timer=time.process_time)
@pytest.mark.parametrize("way", ["python-can recv(0)", "cablecomp"])
def test_receive_multicast(benchmark: Any, way: str) -> None:
    options = {"channel": "239.74.163.2", "ignore_config": True, **MULTICAST}
    sender = can.Bus(interface="udp_multicast", **options)

    def fill() -> None:
        for _ in range(FRAMES):
            sender.send(message())

    if way == "cablecomp":
        port = can_port("udp_multicast", "239.74.163.2", None, MULTICAST)
        port.open()
        per_frame(benchmark, fill, lambda: port.drain(sink, 1000))
        port.close()
    else:
        stock = can.Bus(interface="udp_multicast", **options)
        per_frame(benchmark, fill, lambda: drain_stock(stock))
        stock.shutdown()
    sender.shutdown()


@pytest.mark.benchmark(group="receive: socketcan frames, 64 frames", timer=time.process_time)
@pytest.mark.parametrize("way", ["python-can recv(0)", "cablecomp"])
def test_receive_socketcan(benchmark: Any, way: str) -> None:
    """`struct can_frame` through a socket pair: the same system calls, without a CAN interface."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    frame = struct.pack("=IB3x", 1, 8) + DATA

    def fill() -> None:
        for _ in range(FRAMES):
            far.send(frame)

    if way == "cablecomp":
        port = SocketCanPort(lambda: (near, None))
        port.open()
        per_frame(benchmark, fill, lambda: port.drain(sink, 1000))
        port.close()
    else:
        stock = _stock_socketcan(near)
        per_frame(benchmark, fill, lambda: drain_stock(stock))
        near.close()
    far.close()


def _stock_socketcan(near: socket.socket) -> Any:
    """python-can's own receive code on this socket."""
    from can.interfaces.socketcan.socketcan import SocketcanBus

    near.setsockopt(socket.SOL_SOCKET, 35, 1)  # SO_TIMESTAMPNS, as python-can sets it

    class Bus(SocketcanBus):
        def __init__(self) -> None:
            self.socket, self.channel, self._filters, self._is_filtered = near, "", None, True
            self._is_shutdown = True

    return Bus()


def terminal() -> tuple[int, str]:
    master, slave = os.openpty()
    tty.setraw(slave)
    return master, os.ttyname(slave)


@pytest.mark.benchmark(group="receive: slcan on a terminal, 64 frames", timer=time.process_time)
@pytest.mark.parametrize("way", ["python-can recv(0)", "cablecomp"])
def test_receive_slcan(benchmark: Any, way: str) -> None:
    master, path = terminal()
    line = b"t0018" + DATA.hex().upper().encode() + b"\r"

    def fill() -> None:
        os.write(master, line * FRAMES)

    if way == "cablecomp":
        port = can_port("slcan", path, None, {"sleep_after_open": 0})
        port.open()
        per_frame(benchmark, fill, lambda: drain_line(port))
        port.close()
    else:
        stock = can.Bus(interface="slcan", channel=path, ignore_config=True, sleep_after_open=0)
        per_frame(benchmark, fill, lambda: drain_stock(stock, 0.5))
        stock.shutdown()
    os.close(master)


@pytest.mark.benchmark(group="receive: serial records, 64 frames", timer=time.process_time)
def test_receive_serial(benchmark: Any) -> None:
    master, path = terminal()
    port = serial_port(path, 921_600)
    port.open()
    records = pack_record(1, DATA) * FRAMES
    per_frame(benchmark, lambda: (os.write(master, records), None)[1], lambda: drain_line(port))
    port.close()
    os.close(master)


SENDER = """
import os, sys, time, can
options = dict(channel="239.74.163.2", port=int(sys.argv[1]), hop_limit=0, ignore_config=True)
bus = can.Bus(interface="udp_multicast", **options)
m = can.Message(arbitration_id=1, is_extended_id=False, data=bytes(8))
due = time.monotonic()
for _ in range(int(sys.argv[2])):
    bus.send(m)
    due += 150e-6
    while (left := due - time.monotonic()) > 0:
        time.sleep(left)
bus.shutdown()
"""


@pytest.mark.benchmark(group="receive under load: udp_multicast, a frame every 150 us from another process")
@pytest.mark.parametrize("way", ["python-can Notifier", "cablecomp poll at 1 kHz"])
def test_receive_under_load(benchmark: Any, way: str) -> None:
    """CPU time a frame of a process that does nothing but receive, frames spaced as on a 1 Mbit/s bus."""
    n, seen = 10_000, [0]
    options = {"channel": "239.74.163.2", "ignore_config": True, **MULTICAST}
    if way.startswith("cablecomp"):
        port = can_port("udp_multicast", "239.74.163.2", None, MULTICAST)
        port.open()

        def poll() -> None:
            seen[0] += port.drain(sink, 1000)

        close = port.close
    else:
        bus = can.Bus(interface="udp_multicast", **options)
        notifier = can.Notifier(bus, [lambda m: seen.__setitem__(0, seen[0] + 1)], timeout=0.1)

        def poll() -> None:
            """The notifier's own thread receives."""

        def close() -> None:
            notifier.stop()
            bus.shutdown()

    def run() -> float:
        child = subprocess.Popen([sys.executable, "-c", SENDER, str(MULTICAST["port"]), str(n)])
        before, due = time.process_time(), time.monotonic()
        while child.poll() is None:
            poll()
            due = max(due + 1e-3, time.monotonic())
            while (left := due - time.monotonic()) > 0:
                time.sleep(left)
        poll()
        return time.process_time() - before

    used = benchmark.pedantic(run, rounds=1)
    close()
    assert seen[0] > 0.9 * n
    benchmark.extra_info["us_cpu_per_frame"] = used / seen[0] * 1e6


def cycle_bytes(k: int) -> list[tuple[int, bytes]]:
    """What eight drives and sensor nodes send in one cycle."""
    out = []
    for n in range(1, 9):
        out.append((0, bytes([n, 0x80, k & 0xFF, 0x7F, 0xF7, 0xFF, 36, 0])))
        out.append((0x5F0 + 0x10 * n, struct.pack("<iHBB", 1000 * k, 500, 0, k & 0xFF)))
        if k % 10 == 0:
            out.append((0x5F1 + 0x10 * n, struct.pack("<IhBB", 1000 * k, 2500, 0, k & 0xFF)))
    return out


@pytest.mark.benchmark(group="a cycle of eight joints on a virtual bus")
@pytest.mark.parametrize("part", ["poll", "send", "both"])
def test_cycle_of_eight_joints(benchmark: Any, part: str) -> None:
    config = load_link(CONFIGS / "mit-virtual-8.toml").redirect("virtual", uuid.uuid4().hex)
    link = BusLink(config)
    link.open()
    assert hasattr(config.bus, "channel")
    devices = can.Bus(interface="virtual", channel=config.bus.channel, ignore_config=True)
    command = MotorCommand(0.1, 0.2, 0.3)
    step = [0]

    def fill() -> None:
        if part != "send":
            for identifier, data in cycle_bytes(step[0]):
                devices.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
        devices.queue.queue.clear()
        step[0] += 1

    def cycle() -> None:
        now_s = step[0] * 1e-3
        if part != "send":
            link.poll(now_s)
            for joint in link.joints:
                joint.sample(now_s)
        if part != "poll":
            for joint in range(8):
                link.send(joint, command)

    benchmark.pedantic(cycle, setup=lambda: (fill(), None)[1], rounds=3000, iterations=1, warmup_rounds=100)
    benchmark.extra_info["us_per_joint"] = benchmark.stats.stats.median / 8 * 1e6
    assert link.status().lost == 0
    link.close()
    devices.shutdown()
    assert threading.active_count() == 1
