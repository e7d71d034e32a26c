"""The simulated CiA 402 drive under a client of others: the `canopen` package and its profile 402."""

from __future__ import annotations

import struct
import time
import uuid
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from bench_thread import BenchThread
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveConfig, DriveState
from firmware_sim.ports import open_port

canopen = pytest.importorskip("canopen", reason="peer not installed: pip install 'cablecomp[peers]'")
p402 = pytest.importorskip(
    "canopen.profiles.p402", reason="peer not installed: pip install 'cablecomp[peers]'"
)

TURN = 65536
TYPES = {"u8": 0x5, "u16": 0x6, "u32": 0x7, "i8": 0x2, "i16": 0x3, "i32": 0x4}
SINGLE = {
    0x1017: "u16", 0x603F: "u16", 0x6040: "u16", 0x6041: "u16", 0x6060: "i8", 0x6061: "i8", 0x6064: "i32",
    0x606C: "i32", 0x6071: "i16", 0x6076: "u32", 0x6077: "i16", 0x607A: "i32", 0x60B2: "i16", 0x60FF: "i32",
    0x6502: "u32",
}  # fmt: skip


def dictionary() -> Any:
    od = canopen.ObjectDictionary()

    def variable(index: int, sub: int, kind: str) -> Any:
        made = canopen.objectdictionary.ODVariable(f"x{index:04X}_{sub}", index, sub)
        made.data_type = TYPES[kind]
        return made

    for index, kind in SINGLE.items():
        od.add_object(variable(index, 0, kind))
    records = {0x1400: ("u8", "u32", "u8"), 0x1600: ("u8", *["u32"] * 4), 0x1016: ("u8", "u32")}
    records |= {0x1800 + k: records[0x1400] for k in range(3)} | {
        0x1A00 + k: records[0x1600] for k in range(3)
    }
    for index, kinds in records.items():
        record = canopen.objectdictionary.ODRecord(f"r{index:04X}", index)
        for sub, kind in enumerate(kinds):
            record.add_member(variable(index, sub, kind))
        od.add_object(record)
    return od


@pytest.fixture
def met() -> Iterator[tuple[Any, Any, Bench]]:
    channel = uuid.uuid4().hex
    drive = DriveConfig(position_gain_per_s=40.0, velocity_gain_Nms_per_rad=2.0)
    bench = make_bench(
        BenchConfig(protocol="cia402", drive=drive), lambda n: TwoMass(), open_port(f"virtual:{channel}")
    )
    network = canopen.Network()
    network.connect(interface="virtual", channel=channel)
    with BenchThread(bench):
        try:
            node = p402.BaseNode402(1, dictionary())
            network.add_node(node)
            until(lambda: bench.joints[0].wire.node.state == 0x7F)  # type: ignore[attr-defined]  # its own wire
            yield network, node, bench
        finally:
            network.disconnect()


def until(reached: Callable[[], Any], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, "not reached"
        time.sleep(1e-3)


def ready(network: Any, node: Any, mode: str) -> None:
    node.nmt.state = "PRE-OPERATIONAL"
    until(lambda: network.nmt is not None)
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    node.op_mode = mode
    node.state = "OPERATION ENABLED"


def test_the_clients_state_machine_climbs_and_comes_down(met: Any) -> None:
    network, node, bench = met
    assert node.sdo[0x6502].raw == 0x380
    ready(network, node, "CYCLIC SYNCHRONOUS POSITION")
    assert bench.joints[0].drive.state is DriveState.ENABLED
    node.state = "SWITCHED ON"
    assert bench.joints[0].drive.state is DriveState.DISABLED
    node.state = "OPERATION ENABLED"
    node.state = "SWITCH ON DISABLED"
    assert bench.joints[0].drive.state is DriveState.DISABLED


def test_pdos_mapped_by_the_client_move_the_motor(met: Any) -> None:
    network, node, bench = met
    node.nmt.state = "PRE-OPERATIONAL"
    node.tpdo.read()
    node.rpdo.read()
    for pdo, objects in ((node.rpdo[1], (0x6040, 0x607A)), (node.tpdo[1], (0x6041, 0x6064))):
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type, pdo.enabled = 1, True
        pdo.save()
    told: list[int] = []
    node.tpdo[1].add_callback(lambda pdo: told.append(pdo[0x6064].raw))
    node.sdo[0x6060].raw = 8
    node.nmt.state = "OPERATIONAL"
    for word, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        node.rpdo[1][0x6040].raw = word
        node.rpdo[1][0x607A].raw = TURN // 8
        node.rpdo[1].transmit()
        network.sync.transmit()
        until(lambda state=state: node.sdo[0x6041].raw & 0x6F == state)
    until(lambda: network.sync.transmit() or (told and abs(told[-1] - TURN // 8) < TURN // 100))
    assert bench.joints[0].drive.position_rad == pytest.approx(0.785, abs=0.1)


@pytest.mark.parametrize(
    ("mode", "index", "target"), [("VELOCITY", 0x60FF, TURN // 4), ("TORQUE", 0x6071, 50)]
)
def test_the_other_modes(met: Any, mode: str, index: int, target: int) -> None:
    network, node, bench = met
    ready(network, node, f"CYCLIC SYNCHRONOUS {mode}")
    node.sdo[index].raw = target
    node.rpdo[1][0x6040].raw = 0x0F
    node.rpdo[1].transmit()
    until(lambda: node.sdo[0x606C].raw > TURN // 8)
    assert bench.joints[0].drive.velocity_rad_s > 0.5


def test_a_host_that_falls_silent_is_an_emergency_and_a_fault(met: Any) -> None:
    network, node, bench = met
    emergencies: list[int] = []
    node.emcy.add_callback(lambda e: emergencies.append(e.code))
    node.sdo[0x1016][1].raw = 100 << 16 | 60
    ready(network, node, "CYCLIC SYNCHRONOUS POSITION")
    for _ in range(10):
        network.send_message(0x764, [5])
        time.sleep(0.01)
    assert bench.joints[0].drive.state is DriveState.ENABLED
    until(lambda: node.sdo[0x6041].raw & 0x4F == 0x08)
    assert bench.joints[0].drive.state is DriveState.FAULT
    until(lambda: emergencies)
    assert (emergencies, node.sdo[0x603F].raw) == ([0x8130], 0x8130)
    node.rpdo[1][0x6040].raw = 0x80
    node.rpdo[1].transmit()
    until(lambda: emergencies == [0x8130, 0])
    assert node.sdo[0x6041].raw & 0x4F == 0x40


def test_heartbeats_boot_up_and_reset(met: Any) -> None:
    network, node, _ = met
    node.sdo[0x1017].raw = 10
    assert node.nmt.wait_for_heartbeat(5) == "PRE-OPERATIONAL"
    node.nmt.state = "OPERATIONAL"
    until(lambda: node.nmt.state == "OPERATIONAL" and node.nmt.wait_for_heartbeat(5) == "OPERATIONAL")
    network.send_message(0, [0x81, 1])
    node.nmt.wait_for_bootup(5)
    assert node.sdo[0x1017].raw == 0


def test_what_is_refused(met: Any) -> None:
    _, node, _ = met

    def code(write: Callable[[], None]) -> int:
        with pytest.raises(canopen.SdoAbortedError) as caught:
            write()
        return int(caught.value.code)

    assert code(lambda: node.sdo.download(0x6041, 0, b"\0\0")) == 0x0601_0002
    assert code(lambda: node.sdo.download(0x6040, 0, b"\0")) == 0x0607_0010
    assert code(lambda: node.sdo.download(0x6060, 0, b"\x01")) == 0x0609_0030
    assert code(lambda: node.sdo.download(0x1A00, 1, struct.pack("<I", 0x6064_0020))) == 0x0601_0000
    assert code(lambda: node.sdo.upload(0x2000, 0)) == 0x0602_0000
    assert code(lambda: node.sdo.upload(0x6040, 7)) == 0x0609_0011
