"""The simulated ODrive under a client of others (odrive-can), and its frames in ODrive's own tables."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import can
import cantools
import pytest
from bench_thread import BenchThread
from sim_two_mass import TwoMass

from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveConfig
from firmware_sim.ports import open_port

odrive_can = pytest.importorskip("odrive_can", reason="peer not installed: pip install 'cablecomp[peers]'")
TABLES = {"0.5": "odrive-cansimple-0.5.6", "0.6": "odrive-cansimple-0.6.10"}


@pytest.mark.parametrize("firmware", TABLES)
def test_every_frame_told_is_one_of_odrives_table(firmware: Any) -> None:
    table = cantools.database.load_file(Path(odrive_can.__file__).parent / "dbc" / f"{TABLES[firmware]}.dbc")
    channel = uuid.uuid4().hex
    config = BenchConfig(protocol="odrive", firmware=firmware)
    with (
        make_bench(config, lambda number: TwoMass(), open_port(f"virtual:{channel}")) as bench,
        can.Bus(interface="virtual", channel=channel, ignore_config=True) as ear,
    ):
        told = [
            m for m in table.messages if m.senders == ["ODrive_Axis1"] and not m.name.endswith("ADC_Voltage")
        ]
        for message in told:
            ear.send(can.Message(arbitration_id=message.frame_id, is_extended_id=False, is_remote_frame=True))
        for k in range(120):
            bench.tick(1e-3 * k)
        heard = {}
        while (m := ear.recv(0)) is not None:
            if m.arbitration_id >> 5 == 1:
                message = table.get_message_by_frame_id(m.arbitration_id)
                assert len(m.data) == message.length, message.name
                heard[message.name] = message.decode(bytes(m.data))
    assert set(heard) >= {m.name for m in told if not m.name.endswith("TxSdo")}
    assert heard["Axis1_Heartbeat"]["Axis_State"] == "IDLE"
    assert heard["Axis1_Heartbeat"]["Axis_Error"] == "NONE"
    assert heard["Axis1_Get_Bus_Voltage_Current"]["Bus_Voltage"] == 24.0


async def reached(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    end = asyncio.get_running_loop().time() + seconds
    while not condition():
        assert asyncio.get_running_loop().time() < end, "not reached"
        await asyncio.sleep(0.005)


async def answer(ask: Callable[[], Awaitable[dict[str, Any]]], name: str) -> dict[str, Any]:
    """What the client hears of its question. It takes cyclic frames for answers, and of two that come before it
    looks the second for the answer to its next question, whatever that is: then it asks again.
    """
    for _ in range(3):
        found = await ask()
        if name in found:
            return found
    raise AssertionError(f"no answer with {name}")


def test_a_client_of_others_moves_the_motor() -> None:
    channel = uuid.uuid4().hex
    config = BenchConfig(protocol="odrive", drive=DriveConfig(command_timeout_s=0.0))  # as delivered
    bench = make_bench(config, lambda number: TwoMass(), open_port(f"virtual:{channel}"))
    angles: list[float] = []

    async def client() -> None:
        bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        drive = odrive_can.ODriveCAN(axis_id=1, can_bus=bus)
        drive.feedback_callback = lambda m, _: angles.append(m.data["Pos_Estimate"])
        await drive.start()
        try:
            drive.check_alive()
            drive.clear_errors()
            drive.set_controller_mode("POSITION_CONTROL", "POS_FILTER")
            await drive.set_axis_state("CLOSED_LOOP_CONTROL")
            drive.check_errors()
            drive.set_vel_gains(0.5, 2.0)
            for _ in range(300):
                drive.set_input_pos(0.25)
                await asyncio.sleep(0.005)
                if abs(angles[-1] - 0.25) < 0.01:
                    break
            iq = await answer(drive.get_iq, "Iq_Measured")
            assert set(iq) == {"Iq_Setpoint", "Iq_Measured"}
            assert (await answer(drive.get_bus_voltage_current, "Bus_Voltage"))["Bus_Voltage"] == 24.0
            drive.set_controller_mode("POSITION_CONTROL", "MIRROR")
            await reached(lambda: drive.axis_state == "IDLE")
            with pytest.raises(Exception, match="BAD_CONFIG"):
                drive.check_errors()
        finally:
            drive.stop()
            bus.shutdown()

    with BenchThread(bench):
        asyncio.run(client())
    assert angles[-1] == pytest.approx(0.25, abs=0.02)
