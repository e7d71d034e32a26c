"""The simulated Dynamixel under the maker's own SDK, over a pseudo-terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from bench_thread import BenchThread
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveConfig, DriveState
from firmware_sim.ports import open_port

sdk = pytest.importorskip("dynamixel_sdk", reason="peer not installed: pip install 'cablecomp[peers]'")

MODE, TORQUE, LEVEL, ERRORS, WATCHDOG = 11, 64, 68, 70, 98
GOAL_CURRENT, GOAL_VELOCITY, GOAL, CURRENT, VELOCITY, POSITION = 102, 104, 116, 126, 128, 132


class Client:
    """Port and packet handler of the SDK, and what came of a call."""

    def __init__(self, path: str) -> None:
        self.port = sdk.PortHandler(path)
        assert self.port.openPort()
        self.port.ser.write_timeout = 1.0
        self.handler = sdk.PacketHandler(2.0)
        self.error = 0
        # its time-outs count on a line's baud rate and an adapter's 16 ms; a busy computer may take longer
        self.port.setPacketTimeout = lambda length: self.port.setPacketTimeoutMillis(5000)

    def read(self, node: int, address: int, size: int) -> int:
        call = {1: self.handler.read1ByteTxRx, 2: self.handler.read2ByteTxRx, 4: self.handler.read4ByteTxRx}
        value, result, self.error = call[size](self.port, node, address)
        assert result == sdk.COMM_SUCCESS, self.handler.getTxRxResult(result)
        return int(value - (1 << 32) if size == 4 and value >> 31 else value)

    def write(self, node: int, address: int, size: int, value: int) -> int:
        call = {
            1: self.handler.write1ByteTxRx,
            2: self.handler.write2ByteTxRx,
            4: self.handler.write4ByteTxRx,
        }
        result, self.error = call[size](self.port, node, address, value)
        assert result == sdk.COMM_SUCCESS, self.handler.getTxRxResult(result)
        return int(self.error)


@pytest.fixture
def met() -> Iterator[tuple[Client, Bench]]:
    drive = DriveConfig(position_gain_per_s=40.0, velocity_gain_Nms_per_rad=2.0)
    config = BenchConfig(protocol="dynamixel", joints=2, torque_constant=1.78, drive=drive)
    bench = make_bench(config, lambda n: TwoMass(), open_port("dynamixel"))
    with BenchThread(bench):
        client = Client(str(bench.port.describe()["channel"]))
        try:
            yield client, bench
        finally:
            client.port.closePort()


def until(reached: Callable[[], Any], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, "not reached"


def test_ping_and_what_is_refused(met: tuple[Client, Bench]) -> None:
    client, _ = met
    model, result, error = client.handler.ping(client.port, 1)
    assert (model, result, error) == (1020, sdk.COMM_SUCCESS, 0)
    assert client.write(1, MODE, 1, 7) == 4  # no such mode: data range
    assert client.write(1, POSITION, 4, 0) == 7  # read only
    assert client.write(1, GOAL, 2, 0) == 5  # half an item
    assert client.write(1, GOAL, 4, 5000) == 6  # beyond a turn, in position mode
    assert client.write(1, TORQUE, 1, 1) == 0
    assert client.write(1, MODE, 1, 4) == 7  # EEPROM is locked by torque
    assert (client.read(1, MODE, 1), client.read(1, TORQUE, 1)) == (3, 1)


def test_every_mode_moves_the_motor(met: tuple[Client, Bench]) -> None:
    client, bench = met
    drive = bench.joints[0].drive
    for mode, goal, size, value, reached in (
        (4, GOAL, 4, -700, lambda: abs(client.read(1, POSITION, 4) + 700) < 20),
        (1, GOAL_VELOCITY, 4, 40, lambda: abs(client.read(1, VELOCITY, 4) - 40) < 8),
        (0, GOAL_CURRENT, 2, 20, lambda: abs(client.read(1, CURRENT, 2) - 20) <= 2),
    ):
        assert client.write(1, TORQUE, 1, 0) == 0
        assert client.write(1, MODE, 1, mode) == 0
        assert client.write(1, TORQUE, 1, 1) == 0
        assert client.write(1, goal, size, value & (1 << 8 * size) - 1) == 0
        until(reached)
        if mode == 4:
            assert drive.position_rad == pytest.approx(-700 / 4096 * 6.2832, abs=0.05)


def test_sync_and_bulk(met: tuple[Client, Bench]) -> None:
    client, _ = met
    for node in (1, 2):
        client.write(node, MODE, 1, 4)
        client.write(node, TORQUE, 1, 1)
    writer = sdk.GroupSyncWrite(client.port, client.handler, GOAL, 4)
    for node, value in ((1, 300), (2, 500)):
        assert writer.addParam(node, list(value.to_bytes(4, "little")))
    assert writer.txPacket() == sdk.COMM_SUCCESS
    reader = sdk.GroupSyncRead(client.port, client.handler, VELOCITY, 8)
    assert reader.addParam(1)
    assert reader.addParam(2)

    def near() -> bool:
        assert reader.txRxPacket() == sdk.COMM_SUCCESS
        return all(abs(reader.getData(n, POSITION, 4) - v) < 12 for n, v in ((1, 300), (2, 500)))

    until(near)
    bulk = sdk.GroupBulkWrite(client.port, client.handler)
    assert bulk.addParam(1, GOAL, 4, list((100).to_bytes(4, "little")))
    assert bulk.addParam(2, 65, 1, [1])
    assert bulk.txPacket() == sdk.COMM_SUCCESS
    asked = sdk.GroupBulkRead(client.port, client.handler)
    assert asked.addParam(1, GOAL, 4)
    assert asked.addParam(2, 65, 1)
    assert asked.txRxPacket() == sdk.COMM_SUCCESS
    assert (asked.getData(1, GOAL, 4), asked.getData(2, 65, 1)) == (100, 1)


def test_registered_writes_and_indirect_data(met: tuple[Client, Bench]) -> None:
    client, _ = met
    handler, port = client.handler, client.port
    assert handler.regWriteTxRx(port, 1, 65, 1, [1]) == (sdk.COMM_SUCCESS, 0)
    assert (client.read(1, 65, 1), client.read(1, 69, 1)) == (0, 1)
    assert handler.action(port, 1) == sdk.COMM_SUCCESS
    until(lambda: client.read(1, 65, 1) == 1)
    assert client.write(1, 168, 2, 146) == 0
    assert client.read(1, 224, 1) == client.read(1, 146, 1) == 25


def test_the_bus_watchdog_stops_and_locks_goals(met: tuple[Client, Bench]) -> None:
    client, bench = met
    client.write(1, MODE, 1, 1)
    client.write(1, TORQUE, 1, 1)
    assert client.write(1, WATCHDOG, 1, 2) == 0
    client.write(1, GOAL_VELOCITY, 4, 100)
    until(lambda: bench.joints[0].wire.items[WATCHDOG].value == -1)  # type: ignore[attr-defined]  # its own wire
    assert client.read(1, WATCHDOG, 1) == 0xFF
    assert client.write(1, GOAL_VELOCITY, 4, 100) == 4
    until(lambda: abs(client.read(1, VELOCITY, 4)) <= 3)
    assert client.write(1, WATCHDOG, 1, 0) == 0
    assert client.write(1, GOAL_VELOCITY, 4, 100) == 0


def test_a_hardware_error_alerts_until_a_reboot(met: tuple[Client, Bench]) -> None:
    client, bench = met
    client.write(1, TORQUE, 1, 1)
    drive = bench.joints[0].drive
    drive.refuse_mode()  # any fault of its own
    assert drive.state is DriveState.FAULT
    assert client.read(1, TORQUE, 1) == 0
    assert client.error == 0x80
    assert client.read(1, ERRORS, 1) == 1 << 5
    client.write(1, TORQUE, 1, 1)
    assert client.read(1, TORQUE, 1) == 0
    client.handler.reboot(client.port, 1)
    until(lambda: client.read(1, ERRORS, 1) == 0)
    assert client.error == 0
    assert client.write(1, TORQUE, 1, 1) == 0
    assert client.read(1, TORQUE, 1) == 1


def test_the_status_return_level(met: tuple[Client, Bench]) -> None:
    client, _ = met
    handler, port = client.handler, client.port
    assert client.write(1, LEVEL, 1, 2) == 0
    assert handler.write1ByteTxOnly(port, 1, LEVEL, 1) == sdk.COMM_SUCCESS
    port.is_using = False
    until(lambda: port.getBytesAvailable() == 0)
    assert client.read(1, LEVEL, 1) == 1
    port.setPacketTimeout = lambda length: port.setPacketTimeoutMillis(30)
    result, _ = handler.write1ByteTxRx(port, 1, 65, 1)
    assert result == sdk.COMM_RX_TIMEOUT
