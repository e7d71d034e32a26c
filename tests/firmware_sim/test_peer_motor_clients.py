"""Simulated MIT, Damiao, CubeMars and RobStride drives under clients that others wrote."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import can
import pytest
from bench_thread import BenchThread
from sim_two_mass import TwoMass

from firmware_sim.bench import Bench
from firmware_sim.build import BenchConfig, make_bench
from firmware_sim.firmware import DriveConfig, DriveState
from firmware_sim.ports import open_port

HINT = "peer not installed: pip install 'cablecomp[peers]'"
AS_DELIVERED = DriveConfig(command_timeout_s=0.0)


@contextmanager
def running(drive: DriveConfig = AS_DELIVERED, **options: Any) -> Iterator[tuple[str, Bench]]:
    """A bench in a thread, and the channel that it is on."""
    channel = uuid.uuid4().hex
    bench = make_bench(
        BenchConfig(drive=drive, **options), lambda n: TwoMass(), open_port(f"virtual:{channel}")
    )
    with BenchThread(bench):
        yield channel, bench


def bus_on(channel: str, *identifiers: int, extended: bool = False) -> can.BusABC:
    """The client's end; of a bus with other devices it hears these identifiers alone (empty = all)."""
    mask = 0x1FFFFFFF if extended else 0x7FF
    filters = [{"can_id": i, "can_mask": mask, "extended": extended} for i in identifiers] or None
    return can.Bus(interface="virtual", channel=channel, ignore_config=True, can_filters=filters)


def until(
    reached: Callable[[], object], each: Callable[[], object] = lambda: None, seconds: float = 30.0
) -> None:
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, "not reached"
        each()
        time.sleep(0.002)


# ---- damiao-motor ------------------------------------------------------------------------------------


@pytest.fixture
def damiao(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    core = pytest.importorskip("damiao_motor.core.controller", reason=HINT)
    made = []

    def connect(channel: str, motor_type: str) -> Any:
        bus = bus_on(channel, 0x11)
        monkeypatch.setattr(core.can.interface, "Bus", lambda **_: bus)
        controller = core.DaMiaoController(channel=channel, bustype="virtual")
        made.append(controller)
        return controller.add_motor(1, 0x11, motor_type)

    yield connect
    for controller in made:
        controller.shutdown()


def test_damiao_motor_runs_every_mode(damiao: Any) -> None:
    with running(protocol="mit", model="DM4310", reply_id=0x11) as (channel, bench):
        motor, drive = damiao(channel, "4310"), bench.joints[0].drive
        motor.ensure_control_mode("MIT")
        motor.enable()
        until(lambda: motor.get_states().get("status") == "ENABLED", motor.enable)
        until(
            lambda: abs(motor.get_states()["pos"] - 0.3) < 0.02,
            lambda: motor.send_cmd_mit(0.3, 0.0, 20.0, 0.5, 0.0),
        )
        motor.write_register(10, 2)  # `ensure_control_mode` verifies against its own cache
        until(lambda: abs(motor.get_states()["pos"] + 0.2) < 0.03, lambda: motor.send_cmd_pos_vel(-0.2, 5.0))
        motor.write_register(10, 3)
        until(lambda: motor.get_states()["vel"] > 0.5, lambda: motor.send_cmd_vel(3.0))
        motor.disable()
        until(lambda: drive.state is DriveState.DISABLED)


def test_damiao_motor_reads_and_writes_registers(damiao: Any) -> None:
    with running(protocol="mit", model="DM4340P", reply_id=0x11) as (channel, bench):
        motor = damiao(channel, "4340P")
        assert [motor.get_register(n, 30.0) for n in (21, 22, 23)] == pytest.approx([12.5, 10.0, 28.0])
        motor.set_can_timeout(200)
        assert motor.get_register(9, 30.0) == 4000
        assert bench.joints[0].drive.config.command_timeout_s == pytest.approx(0.2)


# ---- TMotorCANControl --------------------------------------------------------------------------------


@pytest.fixture
def tmotor(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    module = pytest.importorskip("TMotorCANControl.mit_can", reason=HINT)
    module.CAN_Manager.__del__ = lambda self: None  # it would take the network interface down
    open_ones: list[Any] = []

    def connect(channel: str) -> Any:
        manager = object.__new__(module.CAN_Manager)
        manager.bus = bus_on(channel, 0)
        manager.notifier = can.Notifier(bus=manager.bus, listeners=[])
        monkeypatch.setattr(module.CAN_Manager, "_instance", manager)
        open_ones.append(manager)
        return module.TMotorManager_mit_can("AK80-9", 1)

    yield connect
    for manager in open_ones:
        manager.notifier.stop()
        manager.bus.shutdown()


@pytest.mark.filterwarnings("ignore:State update requested:RuntimeWarning")
def test_tmotor_holds_zeroes_and_survives_silence(tmotor: Any) -> None:
    timeout = DriveConfig(command_timeout_s=0.05)
    with running(timeout, protocol="mit") as (channel, bench), tmotor(channel) as motor:
        drive = bench.joints[0].drive
        motor.set_impedance_gains_real_unit(K=20.0, B=0.5)

        def hold() -> None:
            motor.position = 0.3
            motor.update()

        until(lambda: abs(motor.position - 0.3) < 0.02, hold)
        until(lambda: drive.velocity_rad_s < 1e-2 and drive.report().torque_command_Nm == 0.0)
        assert drive.state is DriveState.ENABLED  # it fell silent and lets go, without an error
        until(lambda: abs(drive.report().torque_command_Nm) > 1e-3, hold)
        angle = drive.position_rad
        motor.set_zero_position()
        until(lambda: abs(drive.position_rad - angle) > 0.2)
        assert drive.state is DriveState.ENABLED
        asked = motor._last_update_time
        motor.power_on()
        time.sleep(0.05)
        assert motor._last_update_time == asked  # says nothing for about a second


def test_tmotor_reads_a_servo_status() -> None:
    servo = pytest.importorskip("TMotorCANControl.servo_can", reason=HINT)
    with running(protocol="cubemars") as (channel, bench), bus_on(channel, 0x2901, extended=True) as ear:
        message = ear.recv(2.0)
        assert message is not None
        manager = object.__new__(servo.CAN_Manager_servo)
        state = servo.CAN_Manager_servo.parse_servo_message(manager, bytes(message.data))
        servo.CAN_Manager_servo.__del__ = lambda self: None  # it would take the network interface down
        assert (state.position, state.velocity, state.temperature, state.error) == (0.0, 0.0, 25, 0)
        assert bench.joints[0].drive.state is DriveState.DISABLED


# ---- RobStride ---------------------------------------------------------------------------------------


def test_robstride_client() -> None:
    module = pytest.importorskip("robstride.client", reason=HINT)
    with running(protocol="robstride", model="RS01") as (channel, bench), bus_on(channel) as bus:
        bus.set_filters([{"can_id": 0x02000000, "can_mask": 0x02000000, "extended": True},
                         {"can_id": 0x11000000, "can_mask": 0x1F000000, "extended": True}])  # fmt: skip
        client, drive = module.Client(bus, host_can_id=0xAA), bench.joints[0].drive
        told = client.enable(1)
        assert (told.servo_id, told.errors, told.temp) == (1, [], 25.0)
        until(lambda: drive.state is DriveState.ENABLED)
        assert client.read_param(1, "vbus") == 24.0
        assert client.read_param(1, "run_mode") is module.RunMode.Operation
        client.write_param(1, "run_mode", module.RunMode.Speed)
        told = client.write_param(1, "spd_ref", 2.0)
        until(lambda: drive.velocity_rad_s > 0.3)
        assert client.disable(1).velocity > 0.1
        until(lambda: drive.state is DriveState.DISABLED)


def test_robstride_sdk_moves_the_motor() -> None:
    module = pytest.importorskip("robstride_dynamics.bus", reason=HINT)
    with running(protocol="robstride", model="RS03") as (channel, bench), bus_on(channel) as bus:
        bus.set_filters([{"can_id": 0x02000000, "can_mask": 0x1F000000, "extended": True}])
        client = module.RobstrideBus(channel, {"elbow": module.Motor(1, "rs-03")})
        client.channel_handler = bus
        client.enable("elbow")
        status = (0.0, 0.0, 0.0, 0.0)

        def hold() -> None:
            nonlocal status
            client.write_operation_frame("elbow", 0.4, 20.0, 0.5)
            status = client.read_operation_frame("elbow")

        until(lambda: abs(status[0] - 0.4) < 0.02, hold)
        assert status[3] == pytest.approx(25.0)
        client.disable("elbow")
        client.channel_handler = None
        until(lambda: bench.joints[0].drive.state is DriveState.DISABLED)
