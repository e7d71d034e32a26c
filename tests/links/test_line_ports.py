"""Ports on serial lines: records and slcan over a terminal, and lines that break."""

from __future__ import annotations

import contextlib
import os
import tty
from collections.abc import Iterator

from port_rig import Catch, settle

from cablecomp.links.port_can import can_port
from cablecomp.links.port_line import serial_port
from cablecomp.links.records import EXTENDED, REMOTE, BusState
from cablecomp.links.serial_frames import pack_record


def heard(fd: int, end: bytes) -> bytes:
    """What has come, up to its `end`: a terminal may hand one write over in pieces."""
    said = b""
    while not said.endswith(end):
        settle(fd)
        said += os.read(fd, 1000)
    return said


@contextlib.contextmanager
def terminal() -> Iterator[tuple[int, str]]:
    master, slave = os.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)
    os.close(slave)
    os.set_blocking(master, False)
    yield master, path
    with contextlib.suppress(OSError):
        os.close(master)


def test_serial_line_and_cable_pull() -> None:
    with terminal() as (master, path):
        port = serial_port(path, 921_600)
        port.open()
        assert port.send(0x681, b"\xaa\x00")
        settle(master)
        assert os.read(master, 100) == pack_record(0x681, b"\xaa\x00")
        os.write(master, b"\x55\x55\x00" + pack_record(5, b"\x01") + pack_record(6, b"")[:4])
        settle(port._fd)
        got = Catch()
        assert port.drain(got, 100) == 1
        os.write(master, pack_record(6, b"")[4:])
        settle(port._fd)
        port.drain(got, 100)
        assert got == [(5, b"\x01"), (6, b"")]
        assert port.counters.invalid == 1
        os.close(master)
        port.drain(got, 100)
        port.send(1, b"")
        assert port.state == BusState.LOST
        assert "the line is gone" in port.fault
        assert port.drain(got, 100) == 0
        assert not port.send(1, b"")
        port.close()
        assert port.state == BusState.CLOSED


def read_all(fd: int) -> bytes:
    found = b""
    with contextlib.suppress(BlockingIOError):
        while chunk := os.read(fd, 65_536):
            found += chunk
    return found


def test_a_line_that_takes_nothing_does_not_block_and_nothing_waits_on_it() -> None:
    """What it does not take is not sent later: commands would come late, and the stop behind them."""
    with terminal() as (master, path):
        port = serial_port(path, 921_600)
        port.open()
        taken = [port.send(1, k.to_bytes(8, "little")) for k in range(8000)]
        assert not all(taken)
        assert port.counters.send_failures == taken.count(False)
        assert port.state == BusState.ACTIVE
        # once the line takes again, all that it took is there, whole and in order, and then what is sent now
        expected = b"".join(pack_record(1, k.to_bytes(8, "little")) for k, done in enumerate(taken) if done)
        seen = b""
        while not port.send(2, b"\x07"):
            seen += read_all(master)
        expected += pack_record(2, b"\x07")
        while len(seen) < len(expected):
            settle(master)
            seen += read_all(master)
        assert seen == expected
        port.close()


def test_a_line_without_a_file_descriptor() -> None:
    port = serial_port("loop://", 921_600)
    port.open()
    port.send(7, b"\x00\x01")
    got = Catch()
    assert port.drain(got, 10) == 1
    assert got == [(7, b"\x00\x01")]
    port.close()


def test_slcan_over_a_terminal() -> None:
    with terminal() as (master, path):
        port = can_port("slcan", path, 1_000_000, {"sleep_after_open": 0})
        port.open()
        assert heard(master, b"O\rO\r").startswith(b"C\rS8\r"), (
            "opened twice: with its bit rate, and as it is"
        )
        assert port.send(0x100, b"\x11\x33")
        assert heard(master, b"\r") == b"t10021133\r"
        os.write(master, b"z\r\at0011AA\rT1ABCDEF080000000000000000\rr7F70\rt99\r")
        settle(port._fd)
        got = Catch()
        assert port.drain(got, 10) == 3
        assert got == [(1, b"\xaa"), (0x1ABCDEF0 | EXTENDED, bytes(8)), (0x7F7 | REMOTE, b"")]
        assert (port.counters.invalid, port.counters.overflows) == (1, 1)
        port.close()
        assert heard(master, b"C\r") == b"F\rC\r", "a refusal is asked about once, then the channel is closed"


def test_a_pulled_slcan_adapter_leaves_no_file_open() -> None:
    with terminal() as (master, path):
        port = can_port("slcan", path, 1_000_000, {"sleep_after_open": 0})
        before = set(os.listdir("/proc/self/fd")) if os.path.exists("/proc/self/fd") else set()
        port.open()
        os.close(master)
        port.send(1, b"")
        port.close()
        assert "failed" in port.fault or "gone" in port.fault
        assert port.state == BusState.CLOSED
        if before:
            assert not set(os.listdir("/proc/self/fd")) - before
