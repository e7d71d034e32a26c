"""CAN ports against python-can's own buses and hand-packed frames."""

from __future__ import annotations

import os
import socket
import struct
import uuid
from collections.abc import Iterator

import can
import pytest
from port_rig import FRAMES, Catch, settle

from cablecomp.errors import DeviceError, InputError
from cablecomp.links.port_can import GenericPort, VirtualPort, can_port
from cablecomp.links.port_line import serial_port
from cablecomp.links.port_socket import SocketCanPort
from cablecomp.links.records import EXTENDED, REMOTE, BusState


def bus(channel: str, **options: object) -> can.BusABC:
    return can.Bus(interface="virtual", channel=channel, ignore_config=True, **options)


@pytest.fixture
def channel() -> str:
    return uuid.uuid4().hex


@pytest.mark.parametrize("kind", ["direct", "generic", "bounded"])
def test_virtual_both_ways_with_a_stock_client(channel: str, kind: str) -> None:
    options = {"rx_queue_size": 100} if kind == "bounded" else {}
    port = (
        GenericPort(lambda: bus(channel))
        if kind == "generic"
        else can_port("virtual", channel, None, options)
    )
    client = bus(channel)
    port.open()
    try:
        assert all(port.send(*frame) for frame in FRAMES)
        for identifier, data in FRAMES:
            message = client.recv(0)
            assert message is not None
            assert message.is_extended_id == bool(identifier & EXTENDED)
            assert message.is_remote_frame == bool(identifier & REMOTE)
            assert message.arbitration_id == identifier & 0x1FFFFFFF
            assert bytes(message.data) == data
            client.send(message)
        got = Catch()
        assert port.drain(got, 100) == 3
        assert got == FRAMES
        assert port.drain(got, 100) == 0
    finally:
        port.close()
        client.shutdown()
    port.close()
    assert port.state == BusState.CLOSED
    assert not port.send(1, b"")


class Unplugged:
    """A bus whose adapter is gone, once it is."""

    def __init__(self, channel: str) -> None:
        self._bus = bus(channel)
        self.gone = False

    def _there(self) -> None:
        if self.gone:
            raise can.CanOperationError("unplugged")

    def recv(self, timeout: float | None) -> can.Message | None:
        self._there()
        return self._bus.recv(timeout)

    def shutdown(self) -> None:
        self._bus.shutdown()
        self._there()


@pytest.mark.parametrize("noticed", [True, False])
def test_closing_an_adapter_that_is_gone_says_so_and_closes(channel: str, noticed: bool) -> None:
    made = Unplugged(channel)
    port = GenericPort(lambda: made)
    port.open()
    made.gone = True
    if noticed:
        port.drain(Catch(), 1)
        assert port.state == BusState.LOST
    port.close()
    assert port.fault == ("receiving failed (unplugged)" if noticed else "closing failed (unplugged)")
    assert port.state == BusState.CLOSED
    port.close()


def test_a_receiver_does_not_share_the_senders_bytes(channel: str) -> None:
    port, one, two = can_port("virtual", channel, None, {}), bus(channel), bus(channel)
    port.open()
    try:
        port.send(1, b"\x05")
        first = one.recv(0)
        first.data[0] = 9
        assert two.recv(0).data[0] == 5
    finally:
        port.close()
        one.shutdown()
        two.shutdown()


def test_limit_leaves_the_rest_for_the_next_poll(channel: str) -> None:
    port, client = can_port("virtual", channel, None, {}), bus(channel)
    port.open()
    try:
        for i in range(25):
            client.send(can.Message(arbitration_id=i, is_extended_id=False))
        got = Catch()
        assert [port.drain(got, 10) for _ in range(4)] == [10, 10, 5, 0]
        assert [i for i, _ in got] == list(range(25))
        assert port.counters.backlogs == 2
    finally:
        port.close()
        client.shutdown()


def error_message(bits: int, data: bytes = bytes(8)) -> can.Message:
    return can.Message(arbitration_id=bits, is_error_frame=True, is_extended_id=False, data=data)


@pytest.mark.parametrize("generic", [False, True])
def test_error_messages_of_the_controller(channel: str, generic: bool) -> None:
    port = (GenericPort if generic else VirtualPort)(lambda: bus(channel))
    client = bus(channel)
    port.open()
    got = Catch()
    try:
        # linux/can/error.h: CRTL 0x04 with data[1] 0x10 rx passive, 0x40 active again, 0x01 rx overflow;
        # BUSOFF 0x40; RESTARTED 0x100
        states = []
        for bits, flags in ((0x04, 0x10), (0x04, 0x40), (0x04, 0x01), (0x40, 0), (0x100, 0), (0x40, 0)):
            client.send(error_message(bits, bytes([0, flags, 0, 0, 0, 0, 0, 0])))
            port.drain(got, 10)
            states.append(port.state)
        assert states == [
            BusState.PASSIVE,
            BusState.ACTIVE,
            BusState.ACTIVE,
            BusState.OFF,
            BusState.ACTIVE,
            BusState.OFF,
        ]
        assert "bus-off" in port.fault
        assert (port.counters.error_frames, port.counters.overflows) == (6, 1)
        client.send(can.Message(arbitration_id=1, is_extended_id=False))
        port.drain(got, 10)
        assert (port.state, port.fault, got) == (BusState.ACTIVE, "", [(1, b"")])
    finally:
        port.close()
        client.shutdown()


@pytest.fixture
def wire() -> Iterator[tuple[SocketCanPort, socket.socket]]:
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    port = SocketCanPort(lambda: (near, None))
    port.open()
    yield port, far
    port.close()
    far.close()


def can_frame(identifier: int, data: bytes, length: int | None = None) -> bytes:
    """struct can_frame of linux/can.h: u32 id, u8 len, three bytes, 8 bytes data."""
    n = len(data) if length is None else length
    return struct.pack("=I", identifier) + bytes([n, 0, 0, 0]) + data.ljust(8, b"\x00")


def test_socketcan_frames_as_the_kernel_packs_them(wire: tuple[SocketCanPort, socket.socket]) -> None:
    port, far = wire
    far.send(can_frame(0x123, b"\x01\x02"))
    far.send(can_frame(0x1ABCDEF0 | 0x80000000, bytes(8)))
    far.send(can_frame(0x7F7 | 0x40000000, b"", 8))
    got = Catch()
    assert port.drain(got, 10) == 3
    assert got[:2] == FRAMES[:2]
    assert got[2][0] == FRAMES[2][0]
    assert port.send(0x123, b"\x01\x02")
    assert far.recv(100) == can_frame(0x123, b"\x01\x02")
    assert port.send(0x7F7 | REMOTE, b"")
    assert far.recv(100) == can_frame(0x7F7 | 0x40000000, b"", 8)


def test_socketcan_bus_off_and_damage(wire: tuple[SocketCanPort, socket.socket]) -> None:
    port, far = wire
    far.send(can_frame(0x20000040, bytes(8)))
    far.send(b"\x01\x02\x03")
    got = Catch()
    port.drain(got, 10)
    assert (port.state, port.counters.error_frames, port.counters.invalid) == (BusState.OFF, 1, 1)
    far.send(can_frame(1, b"\x07"))
    port.drain(got, 10)
    assert (port.state, got) == (BusState.ACTIVE, [(1, b"\x07")])
    far.close()
    assert port.drain(got, 10) == 0
    assert port.state == BusState.LOST
    assert port.fault
    assert not port.send(1, b"")
    assert port.counters.send_failures == 1


@pytest.fixture
def group() -> dict[str, object]:
    return {"port": 20000 + os.getpid() % 20000, "hop_limit": 0}


def test_multicast_with_a_stock_client(group: dict[str, object]) -> None:
    port = can_port("udp_multicast", "239.74.163.2", None, group)
    try:
        port.open()
        client = can.Bus(interface="udp_multicast", channel="239.74.163.2", ignore_config=True, **group)
    except (DeviceError, can.CanError, OSError) as error:
        port.close()
        pytest.skip(f"no multicast here: {error}")
    try:
        if not port.send(*FRAMES[0]):
            pytest.skip(f"no multicast here: {port.fault}")
        message = client.recv(2.0)
        if message is None:
            pytest.skip("multicast is not handed back on this computer")
        assert (message.arbitration_id, bytes(message.data)) == FRAMES[0]
        got = Catch()
        assert port.drain(got, 100) == 0, "a port must not hear its own frames"
        for identifier, data in FRAMES:
            client.send(
                can.Message(
                    arbitration_id=identifier & 0x1FFFFFFF,
                    is_extended_id=bool(identifier & EXTENDED),
                    is_remote_frame=bool(identifier & REMOTE),
                    data=data,
                )
            )
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as noisy:
            noisy.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            noisy.sendto(b"\xc1noise", ("239.74.163.2", group["port"]))
        while len(got) < 3 or not port.counters.invalid:
            settle(port._socket.fileno())
            port.drain(got, 100)
        assert got == FRAMES
        assert (port.counters.invalid, port.dropped()) == (1, 0)
    finally:
        port.close()
        client.shutdown()


def test_what_cannot_be_opened_is_said_in_one_line(tmp_path) -> None:
    with pytest.raises(InputError, match="unknown CAN interface `cannon`; python-can has"):
        can_port("cannon", "x", None, {}).open()
    with pytest.raises(InputError, match=r"did you mean `udp_multicast`\?"):
        can_port("udp_multicst", "x", None, {}).open()
    with pytest.raises(DeviceError, match="cannot be opened") as caught:
        serial_port(str(tmp_path / "none"), 9600).open()
    assert "\n" not in str(caught.value)
    with pytest.raises(DeviceError, match=r"CAN slcan .* cannot be opened"):
        can_port("slcan", str(tmp_path / "none"), None, {"sleep_after_open": 0}).open()
    with pytest.raises(DeviceError, match="CAN socketcan nocan9: cannot be opened"):
        can_port("socketcan", "nocan9", None, {}).open()
