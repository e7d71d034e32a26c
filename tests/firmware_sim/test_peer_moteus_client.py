"""The simulated moteus under the maker's own client, and its registers by the maker's documents."""

from __future__ import annotations

import asyncio
import math
import uuid
import warnings
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from bench_thread import BenchThread
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import Drive, DriveConfig, DriveState
from firmware_sim.ports import open_port
from firmware_sim.wire.base import Answer
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.moteus import MoteusWire

GAINS = (100.0, 5.0)


def peer() -> Any:
    with warnings.catch_warnings():  # of the client's own imports
        warnings.simplefilter("ignore")
        return pytest.importorskip("moteus", reason="peer not installed: pip install 'cablecomp[peers]'")


@asynccontextmanager
async def connected(moteus: Any, **drive: Any) -> AsyncIterator[tuple[Any, Bench]]:
    channel = uuid.uuid4().hex
    config = BenchConfig(protocol="moteus", gains_per_turn=GAINS, drive=DriveConfig(**drive))
    bench = make_bench(config, lambda n: TwoMass(), open_port(f"virtual:{channel}"))
    with BenchThread(bench):
        transport = moteus.PythonCan(interface="virtual", channel=channel)
        try:
            yield moteus.Controller(id=1, transport=transport), bench
        finally:
            transport.close()


async def until(result: Callable[[], Any], reached: Callable[[Any], object], seconds: float = 30.0) -> Any:
    end = asyncio.get_running_loop().time() + seconds
    while True:
        told = await result()
        if reached(told):
            return told
        assert asyncio.get_running_loop().time() < end, f"not reached: {told}"


def test_the_makers_client_moves_the_motor() -> None:
    moteus = peer()
    register, mode = moteus.Register, moteus.Mode

    async def run() -> None:
        async with connected(moteus, command_timeout_s=2.0) as (controller, bench):
            drive = bench.joints[0].drive
            told = await controller.set_stop(query=True)
            assert told.values[register.MODE] == mode.STOPPED
            assert told.values[register.VOLTAGE] == pytest.approx(24.0)
            told = await until(
                lambda: controller.set_position(position=0.1, velocity=0.0, query=True),
                lambda told: abs(told.values[register.POSITION] - 0.1) < 0.005,
            )
            assert told.values[register.MODE] == mode.POSITION
            assert drive.position_rad == pytest.approx(0.2 * math.pi, abs=0.05)
            await until(
                lambda: controller.set_position(position=math.nan, velocity=-0.3, query=True),
                lambda told: told.values[register.VELOCITY] < -0.2 and told.values[register.POSITION] < 0.0,
            )
            told = await controller.set_stop(query=True)
            assert told.values[register.MODE] == mode.STOPPED
            assert drive.state is DriveState.DISABLED

    asyncio.run(run())


def test_a_time_out_lasts_until_a_stop() -> None:
    moteus = peer()
    register, mode = moteus.Register, moteus.Mode

    async def run() -> None:
        async with connected(moteus, command_timeout_s=0.05) as (controller, _):
            await controller.set_position(position=math.nan, query=True)
            await until(controller.query, lambda told: told.values[register.MODE] == mode.TIMEOUT)
            told = await controller.set_position(position=math.nan, query=True)
            assert told.values[register.MODE] == mode.TIMEOUT
            await controller.set_stop()
            told = await controller.set_position(position=math.nan, watchdog_timeout=math.nan, query=True)
            assert told.values[register.MODE] == mode.POSITION
            await asyncio.sleep(0.2)
            told = await controller.query()
            assert told.values[register.MODE] == mode.POSITION

    asyncio.run(run())


def test_every_resolution_reads_the_same() -> None:
    moteus = peer()
    register = moteus.Register

    async def run() -> None:
        async with connected(moteus) as (controller, bench):
            for value in (0.25, -0.375):
                await until(
                    lambda value=value: controller.set_output_exact(position=value, query=True),
                    lambda told, value=value: abs(told.values[register.POSITION] - value) < 1e-3,
                )
                for kind, error in (
                    (moteus.INT8, 0.01),
                    (moteus.INT16, 1e-4),
                    (moteus.INT32, 1e-5),
                    (moteus.F32, 1e-6),
                ):
                    told = await controller.custom_query(
                        {register.POSITION: kind, register.TEMPERATURE: kind}
                    )
                    assert told.values[register.POSITION] == pytest.approx(value, abs=error)
                    assert told.values[register.TEMPERATURE] == pytest.approx(25.0, abs=0.2)
            seen = bench.joints[0].drive.report().second_position_rad
            told = await controller.custom_query(
                {register.ENCODER_1_POSITION: moteus.F32, register.ENCODER_VALIDITY: moteus.INT8}
            )
            assert told.values[register.ENCODER_1_POSITION] == pytest.approx(
                seen / (2 * math.pi) % 1.0, abs=1e-3
            )
            assert told.values[register.ENCODER_VALIDITY] == 0b1111
            told = await controller.custom_query(
                {register.MULTIPLEX_ID: moteus.INT32, register.FIRMWARE_VERSION: moteus.INT32}
            )
            assert told.values[register.MULTIPLEX_ID] == 1

    asyncio.run(run())


# ---- by the documents alone -----------------------------------------------------------------------------


def hear(data: str, identifier: int = 0x8001) -> tuple[Drive, Frame | None, bool]:
    drive, wire = Drive(DriveConfig()), MoteusWire(1, *GAINS)
    frame = Frame(identifier, bytes.fromhex(data), extended=identifier > 0x7FF, fd=True)
    heard = wire.hear(frame, drive, 0.0)
    return drive, wire.answer(Answer.ASKED, frame, drive) if heard.answers else None, heard.steps


def test_the_documents_example() -> None:
    # "CAN Protocol": position mode, three int16 from 0x20, four int16 from 0, three int8 from 0x0D
    drive, answer, steps = hear("01000a07206000200150ff140400130d")
    assert drive.state is DriveState.ENABLED
    assert steps
    assert drive.setpoint.position_rad == pytest.approx(math.radians(3.456))
    assert drive.setpoint.velocity_rad_s == pytest.approx(math.radians(25.92))
    assert drive.setpoint.torque_Nm == pytest.approx(-1.76)
    assert drive.setpoint.kp_Nm_per_rad == pytest.approx(100.0 / (2 * math.pi))
    assert answer is not None
    assert (answer.identifier, answer.fd, len(answer.data)) == (0x100, True, 16)
    assert answer.data.hex() == "2404000a00000000000000230d301900"


def test_velocity_alone_moves_the_position_on_however_often_it_is_commanded() -> None:
    # int16 from 0x20: no position (NaN), 0.1 turns a second; commands half-way between the drive's cycles of 1 ms
    drive, wire = Drive(DriveConfig()), MoteusWire(1, *GAINS)
    frame = Frame(0x8001, bytes.fromhex("01000a" + "0620" + "0080" + "9001"), extended=True, fd=True)
    for k in range(1000):
        wire.cyclic(drive, 1e-3 * k)
        wire.hear(frame, drive, 1e-3 * k + 5e-4)
    wire.cyclic(drive, 1.0005)
    assert drive.setpoint.position_rad == pytest.approx(0.1 * 2 * math.pi, rel=1e-3)


def test_no_reply_without_its_bit() -> None:
    drive, answer, _ = hear("01000a", identifier=0x0001)
    assert answer is None
    assert drive.state is DriveState.ENABLED


def test_a_register_that_is_not_there_is_refused_alone() -> None:
    # two int16 registers from 0x00F on: the fault code, and 0x010, a PWM phase that is not simulated
    _, told, _ = hear("160f")
    assert told is not None
    assert told.data.hex() == "250f0000" + "311001"


def test_a_frame_for_a_longer_prefix_is_for_somebody_else() -> None:
    drive, answer, _ = hear("01000a", identifier=0x0001_8001)
    assert (answer, drive.state) == (None, DriveState.DISABLED)


@pytest.mark.parametrize("data", ["0c0620", "01", "1c", "e0", "0d", "00ffffffffffff"])
def test_a_frame_that_is_cut_short_commands_nothing(data: str) -> None:
    drive, _, steps = hear(data)
    assert (drive.state, steps) == (DriveState.DISABLED, False)
