"""CAN FD on every kind of port, against python-can's own buses and text, and the kernel's frame layout."""

from __future__ import annotations

import os
import pty
import socket
import struct
import tty
import uuid
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st
from link_rig import Rig

from cablecomp.links.port_can import GenericPort, can_port, fd_options
from cablecomp.links.port_socket import SocketCanPort
from cablecomp.links.records import EXTENDED, FD, FD_LENGTHS, SWITCH
from cablecomp.links.serial_frames import RecordReader, pack_record
from cablecomp.links.slcan_frames import LineReader, pack_line, parse_line
from firmware_sim.wire.serial_records import decode_record

FRAMES = [
    (0x123 | FD, bytes(range(12))),
    (0x8001 | EXTENDED | FD | SWITCH, bytes(range(64))),
    (0x7FF | FD | SWITCH, b""),
    (0x123, b"\x01\x02"),
]
AS_HEARD = [(identifier & ~SWITCH, data) for identifier, data in FRAMES]


class Catch(list):
    def __call__(self, identifier: int, data: bytes) -> None:
        self.append((identifier, bytes(data)))


def alike(message: can.Message | None, identifier: int, data: bytes) -> bool:
    assert message is not None
    return (
        message.arbitration_id,
        message.is_extended_id,
        message.is_fd,
        message.bitrate_switch,
        bytes(message.data),
    ) == (
        identifier & 0x1FFF_FFFF,
        bool(identifier & EXTENDED),
        bool(identifier & FD),
        bool(identifier & SWITCH),
        data,
    )


@pytest.mark.parametrize("kind", ["direct", "generic"])
def test_virtual_with_a_stock_client(kind: str) -> None:
    channel = uuid.uuid4().hex

    def bus() -> can.BusABC:
        return can.Bus(interface="virtual", channel=channel, ignore_config=True, fd=True)

    port = GenericPort(bus) if kind == "generic" else can_port("virtual", channel, None, {"fd": True})
    client, heard = bus(), Catch()
    port.open()
    for frame in FRAMES:
        assert port.send(*frame)
        message = client.recv(0)
        assert alike(message, *frame)
        client.send(message)
    assert port.drain(heard, 100) == len(FRAMES)
    assert heard == AS_HEARD
    port.close()
    client.shutdown()


def test_multicast_with_a_stock_client() -> None:
    where = {"channel": "239.74.163.2", "port": 20000 + os.getpid() % 20000, "hop_limit": 0}
    try:
        client = can.Bus(interface="udp_multicast", ignore_config=True, fd=True, **where)
    except (can.CanError, OSError) as error:
        pytest.skip(f"no multicast here: {error}")
    port = can_port("udp_multicast", where.pop("channel"), None, {**where, "fd": True})
    port.open()
    heard = Catch()
    messages = []
    for frame in FRAMES:
        assert port.send(*frame)
        messages.append(client.recv(5.0))
        assert alike(messages[-1], *frame)
    for message in messages:  # sent afterwards: the group hands the client its own frames back
        client.send(message)
    while len(heard) < len(FRAMES):
        port.drain(heard, 100)
    assert heard == AS_HEARD
    assert port.counters.invalid == 0
    port.close()
    client.shutdown()


def test_the_kernels_layout() -> None:
    # struct canfd_frame of linux/can.h: u32 identifier, u8 length, u8 flags (BRS 1), two bytes, 64 bytes of data
    ours, kernel = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    port, heard = SocketCanPort(lambda: (ours, None)), Catch()
    port.open()
    for frame in FRAMES[:3]:
        assert port.send(*frame)
        raw = kernel.recv(100)
        identifier, length, flags = struct.unpack_from("=IBB", raw)
        assert (identifier, length, raw[8 : 8 + length]) == (frame[0] & 0x9FFF_FFFF, len(frame[1]), frame[1])
        assert (len(raw), flags & 1) == (72, bool(frame[0] & SWITCH))
        kernel.send(raw)
    kernel.send(struct.pack("=IB3x8s", 0x123, 2, b"\x01\x02"))
    kernel.send(struct.pack("=IBB2x64s", 0x123, 65, 0, b""))
    kernel.send(bytes(40))
    port.drain(heard, 100)
    assert heard == AS_HEARD
    assert port.counters.invalid == 2
    port.close()
    kernel.close()


def test_slcan_lines_are_python_cans() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    bus = can.Bus(interface="slcan", channel=os.ttyname(slave), ignore_config=True, sleep_after_open=0)
    os.read(master, 1000)
    for identifier, data in FRAMES[:3]:
        message = can.Message(
            arbitration_id=identifier & 0x1FFF_FFFF,
            is_extended_id=bool(identifier & EXTENDED),
            is_fd=True,
            bitrate_switch=bool(identifier & SWITCH),
            data=data,
        )
        bus.send(message)
        line = os.read(master, 1000)
        assert pack_line(identifier, data) == line
        assert parse_line(line[:-1]) == (identifier & ~SWITCH, data)
        os.write(master, line)
        assert alike(bus.recv(5.0), identifier, data)
    bus.shutdown()
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    "line", ["d1239" + "00" * 8, "d123G", "b1230990", "D123900", "d12310102", "t12390102030405060708 9"]
)
def test_damaged_fd_lines(line: str) -> None:
    assert parse_line(line.encode()) is None


fd_frames = st.tuples(
    st.integers(0, 0x7FF).map(lambda n: n | FD),
    st.sampled_from(FD_LENGTHS).flatmap(lambda n: st.binary(min_size=n, max_size=n)),
)


@given(st.lists(fd_frames, max_size=5), st.integers(1, 9))
def test_fd_frames_come_whole_however_a_line_is_cut(frames: list[tuple[int, bytes]], n: int) -> None:
    for pack, reader in ((pack_line, LineReader()), (pack_record, RecordReader())):
        stream, out = b"".join(pack(*f) for f in frames), Catch()
        for i in range(0, len(stream), n):
            reader.feed(stream[i : i + n], out)
        assert out == frames
        assert reader.invalid == 0


@given(fd_frames)
def test_both_ends_of_a_serial_line_agree_on_fd(frame: tuple[int, bytes]) -> None:
    heard = decode_record(pack_record(*frame)[:-1])
    assert heard is not None
    assert (heard.identifier, heard.data, heard.fd) == (frame[0] & 0x7FF, frame[1], True)


def test_what_drivers_are_told() -> None:
    assert fd_options("socketcan", False, 1_000_000, None) == {}
    assert fd_options("kvaser", True, 1_000_000, 5_000_000) == {"fd": True, "data_bitrate": 5_000_000}
    timing = fd_options("slcan", True, 1_000_000, 5_000_000)["timing"]
    assert (timing.nom_bitrate, timing.data_bitrate) == (1_000_000, 5_000_000)


def test_an_fd_frame_is_not_taken_for_a_classic_one(rigs: Any) -> None:
    rig: Rig = rigs("mit-virtual.toml")
    data = bytes.fromhex("01 80 00 7F F7 FF 24 00")
    rig.client.send(can.Message(arbitration_id=0, is_extended_id=False, is_fd=True, data=data))
    assert rig.link.poll(1.0) == 0
    assert rig.link.status().ignored == 1
    rig.tell(0, data)
    assert rig.link.poll(1.0) == 4
