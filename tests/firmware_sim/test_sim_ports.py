"""Joints behind real drivers: python-can's virtual, udp_multicast and slcan, and pyserial on a
pseudo-terminal."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import msgpack
import numpy as np
import pytest
import serial
from bench_thread import BenchThread
from far_end import encode_command
from sim_two_mass import TwoMass

from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.errors import SimError
from firmware_sim.faults import parse_fault
from firmware_sim.firmware import DriveState, Setpoint
from firmware_sim.ports import PtyPort, SerialPort, SlcanPort, open_port
from firmware_sim.ports.can_port import sound
from firmware_sim.runner import run_real_time
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import MODELS
from firmware_sim.wire.serial_records import RecordReader, encode_record

ENTER = b"\xff" * 7 + b"\xfc"
HOLD = encode_command(MODELS["AK80-9"], Setpoint(0.2, 0.0, 0.0, 5.0, 0.1))
UDP = "udp_multicast:239.74.163.7:43907"


@contextmanager
def served(bus: str, stepped: bool = True, link: Path | None = None) -> Iterator[BenchThread]:
    bench = make_bench(BenchConfig(), lambda number: TwoMass(), open_port(bus, link))
    with BenchThread(bench, stepped=stepped) as thread:
        yield thread


def until(told: Callable[[], Any], wanted: Callable[[Any], bool], seconds: float = 5.0) -> list[Any]:
    """What was told up to and with the first that is wanted."""
    end, heard = time.monotonic() + seconds, []
    while time.monotonic() < end:
        item = told()
        if item is None:
            continue
        heard.append(item)
        if wanted(item):
            return heard
    raise AssertionError(f"not heard within {seconds} s; heard {heard[-5:]}")


def read_to_the_end(line: serial.Serial) -> None:
    """Read on until the line breaks."""
    for _ in range(5):
        line.read(4096)


def can_conversation(bus: can.BusABC) -> None:
    """Enable, then 50 commands one after the other, each answered by its sample and its reply."""
    bus.send(can.Message(arbitration_id=1, data=ENTER, is_extended_id=False))
    until(lambda: bus.recv(0.5), lambda m: m.arbitration_id == 0)
    sequence = -1
    for _ in range(50):
        bus.send(can.Message(arbitration_id=1, data=HOLD, is_extended_id=False))
        heard = until(lambda: bus.recv(0.5), lambda m: m.arbitration_id == 0)
        states = [m for m in heard if m.arbitration_id == 0x680]
        assert len(states) == 1
        assert states[0].data[7] == (sequence + 1) % 256
        sequence = states[0].data[7]


def test_virtual() -> None:
    with (
        served("virtual:sim_ports") as thread,
        can.Bus(interface="virtual", channel="sim_ports") as bus,
    ):
        can_conversation(bus)
        assert thread.bench.time_s == pytest.approx(0.05)


def multicast_works() -> bool:
    try:
        with can.Bus(interface="udp_multicast", channel="239.74.163.7", port=43906, hop_limit=0) as bus:
            bus.send(can.Message(arbitration_id=1, data=b"", is_extended_id=False))
        return True
    except (OSError, can.CanError):
        return False


@pytest.mark.skipif(not multicast_works(), reason="this computer has no route for multicast")
def test_udp_multicast() -> None:
    with (
        served(UDP) as thread,
        can.Bus(interface="udp_multicast", channel="239.74.163.7", port=43907, hop_limit=0) as bus,
    ):
        can_conversation(bus)
        assert thread.bench.port.describe()["hop_limit"] == 0


@pytest.mark.skipif(not multicast_works(), reason="this computer has no route for multicast")
def test_datagrams_that_are_no_frames_end_no_simulation() -> None:
    sound = {
        "timestamp": 0.0, "arbitration_id": 1, "is_extended_id": False, "is_remote_frame": False,
        "is_error_frame": False, "channel": None, "dlc": 2, "data": b"ab", "is_fd": False,
        "bitrate_switch": False, "error_state_indicator": False,
    }  # fmt: skip
    values = (None, "x", -1, 1 << 40, 1.5, [1], {}, float("nan"), True, b"123456789")
    damaged = [
        msgpack.packb({**sound, name: value}) for name in ("arbitration_id", "data") for value in values
    ]
    damaged += [
        msgpack.packb({k: v for k, v in sound.items() if k != name}) for name in ("data", "arbitration_id")
    ]
    damaged += [b"", b"\xc1", msgpack.packb([1, 2, 3]), msgpack.packb(sound)[:20], msgpack.packb("x" * 60)]
    with (
        served(UDP, stepped=False) as thread,
        can.Bus(interface="udp_multicast", channel="239.74.163.7", port=43907, hop_limit=0) as bus,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for payload in damaged:
            sender.sendto(payload, ("239.74.163.7", 43907))
        bus.send(can.Message(arbitration_id=1, data=ENTER, is_extended_id=False))
        end = time.monotonic() + 10.0
        while thread.bench.joints[0].drive.state is not DriveState.ENABLED and time.monotonic() < end:
            time.sleep(0.01)
        assert thread.bench.joints[0].drive.state is DriveState.ENABLED
        assert thread.bench.port.errors >= len(damaged) - 4  # `True` and such stand for numbers


def test_slcan_with_python_cans_own_interface() -> None:
    with (
        served("slcan") as thread,
        can.Bus(
            interface="slcan",
            channel=thread.bench.port.describe()["channel"],
            bitrate=1_000_000,
            sleep_after_open=0.0,
        ) as bus,
    ):
        can_conversation(bus)


def test_serial_with_pyserial(tmp_path: Path) -> None:
    link = tmp_path / "joint"
    with served("serial", link=link), serial.Serial(str(link), 921600, timeout=0.05) as line:
        reader, heard = RecordReader(), []

        def told() -> Frame | None:
            if not heard:
                heard.extend(reader.feed(line.read(max(line.in_waiting, 1))))
            return heard.pop(0) if heard else None

        line.write(encode_record(Frame(1, ENTER)))
        until(told, lambda f: f.identifier == 0)
        for k in range(50):
            line.write(encode_record(Frame(1, HOLD)))
            frames = until(told, lambda f: f.identifier == 0)
            assert [f.data[7] for f in frames if f.identifier == 0x680] == [k]
        assert reader.bad_records == 0
    assert not link.exists()


def test_real_time_keeps_its_grid() -> None:
    clock = iter(k * 0.4e-3 for k in range(100_000))
    bench = make_bench(BenchConfig(), lambda number: TwoMass(), open_port("virtual:sim_grid"))
    with bench, can.Bus(interface="virtual", channel="sim_grid") as listener:
        counted: list[int] = []

        def stop() -> bool:
            counted.append(1)
            return len(counted) > 2000

        report = run_real_time(bench, stop, 1e-3, clock=lambda: next(clock))
        heard = [m for m in iter(lambda: listener.recv(0.0), None) if m.arbitration_id == 0x680]
    elapsed = 2000 * 2 * 0.4e-3  # the loop reads the clock twice a turn
    assert report.ticks + report.skipped == pytest.approx(elapsed / 1e-3, abs=3)
    assert len(heard) == pytest.approx(elapsed / 1e-3, abs=3)


def test_real_time_thread_answers_between_its_ticks() -> None:
    with served("virtual:sim_real", stepped=False), can.Bus(interface="virtual", channel="sim_real") as bus:
        bus.send(can.Message(arbitration_id=1, data=ENTER, is_extended_id=False))
        heard = until(lambda: bus.recv(0.5), lambda m: m.arbitration_id == 0x680 and m.data[7] == 100)
        assert [m for m in heard if m.arbitration_id == 0]


# ---- the pseudo-terminal ---------------------------------------------------------------------------


def test_nothing_stale_waits_for_a_client_and_a_new_client_starts_afresh() -> None:
    port = SerialPort()
    try:
        for k in range(1000):
            port.send([Frame(0x680, k.to_bytes(8, "little"))], 0.0)
        for _ in range(2):
            with serial.Serial(port.path, timeout=0.2) as line:
                port.send([Frame(0x681, b"now")], 0.0)
                assert RecordReader().feed(line.read(100)) == [Frame(0x681, b"now")]
                line.write(encode_record(Frame(1, HOLD))[:5])
            assert port.poll(0.0) == []
    finally:
        port.close()


def test_a_client_that_does_not_read_costs_frames_not_memory() -> None:
    port = SerialPort()
    try:
        with serial.Serial(port.path, timeout=0.2):
            for k in range(20_000):
                port.send([Frame(0x680, k.to_bytes(8, "little"))], 0.0)
            assert port.dropped > 0
    finally:
        port.close()


def test_slcan_channel_closes_with_its_client() -> None:
    port = SlcanPort()
    try:
        with serial.Serial(port.path, timeout=0.2) as line:
            line.write(b"S8\rO\r")
            until(lambda: port.poll(0.0) or None if not port.adapter.open else True, lambda x: True)
            assert port.adapter.open
        port.poll(0.0)
        assert not port.adapter.open
    finally:
        port.close()


def test_cable_pulled_and_plugged_again(tmp_path: Path) -> None:
    link = tmp_path / "joint"
    faults = ("cable_pull:start=0.02,stop=0.04",)
    port = open_port("serial", link)
    assert isinstance(port, PtyPort)
    bench = make_bench(BenchConfig(), lambda number: TwoMass(), port, [parse_fault(text) for text in faults])
    with bench:
        with serial.Serial(str(link), timeout=0.1) as line:
            bench.tick(0.01)
            assert line.read(10)
            bench.tick(0.025)
            assert not link.exists()
            with pytest.raises((serial.SerialException, OSError)):
                read_to_the_end(line)
        bench.tick(0.045)
        assert link.exists()
        with serial.Serial(str(link), timeout=0.2) as line:
            bench.tick(0.05)
            assert RecordReader().feed(line.read(400))


def test_serial_noise_costs_records_and_nothing_else(tmp_path: Path) -> None:
    port = open_port("serial", tmp_path / "noisy")
    faults = [parse_fault("noise:p=0.01")]
    bench = make_bench(BenchConfig(), lambda number: TwoMass(), port, faults)
    with bench, serial.Serial(str(tmp_path / "noisy"), timeout=0.0) as line:
        reader, heard = RecordReader(), []
        line.write(encode_record(Frame(1, ENTER)) * 5)
        for k in range(400):
            line.write(encode_record(Frame(1, HOLD)))
            bench.tick(k * 1e-3)
            heard += reader.feed(line.read(4096))
    assert reader.bad_records > 10
    assert {f.identifier for f in heard} <= {0, 0x680, 0x681}
    sequences = [f.data[7] for f in heard if f.identifier == 0x680]
    assert sorted(set(sequences)) == sorted(set(range(256)) & set(sequences))
    assert bench.joints[0].drive.state is DriveState.ENABLED


@pytest.mark.parametrize(
    "bus", ["carrier_pigeon", "carrier_pigeon:1", "udp_multicast:239.1.1.1:99", "slcan:/dev/x"]
)
def test_unknown_buses_are_one_line(bus: str) -> None:
    with pytest.raises(SimError) as caught:
        open_port(bus)
    assert "\n" not in str(caught.value)


def test_an_identifier_that_a_client_computed_with_numpy_is_one() -> None:
    frame = sound(can.Message(arbitration_id=np.int64(0x17FFF01), is_extended_id=True, data=b"\x01"))
    assert frame is not None
    assert (frame.identifier, type(frame.identifier)) == (0x17FFF01, int)
