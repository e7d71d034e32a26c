"""The drive: its state table, watchdog, limits, index search, and control law."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim_two_mass import TwoMass

from firmware_sim.firmware import Drive, DriveConfig, DriveFlag, DriveState, Gearbox, Mode, Request, Setpoint
from firmware_sim.firmware.states import TABLE
from firmware_sim.plantlike import Readings
from firmware_sim.scenario import Scenario, plant_maker

STEP = 2.5e-4
STILL = Readings(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 25.0)


def run(drive: Drive, plant: TwoMass, seconds: float, command: Setpoint | None = None) -> Readings:
    """Drive and plant for a while, the command repeated each step; returns the last readings."""
    readings = plant.step(STEP, 0.0)
    for _ in range(round(seconds / STEP)):
        if command is not None:
            drive.command(command, plant.time_s)
        readings = plant.step(STEP, drive.update(readings, STEP, plant.time_s))
    drive.observe(readings)
    return readings


def enabled(config: DriveConfig | None = None, mode: Mode = Mode.IMPEDANCE) -> Drive:
    drive = Drive(DriveConfig() if config is None else config)
    drive.set_mode(mode)
    assert drive.request(Request.ENABLE, 0.0)
    return drive


@pytest.mark.parametrize(("state", "request_"), list(itertools.product(DriveState, Request)))
def test_state_table_is_the_whole_truth(state: DriveState, request_: Request) -> None:
    drive = Drive(DriveConfig())
    drive.update(STILL, STEP, 0.0)
    drive.state = state
    accepted = drive.request(request_, 0.0)
    assert accepted is ((state, request_) in TABLE)
    want = TABLE.get((state, request_), state)
    if request_ is Request.CALIBRATE and accepted:
        want = DriveState.DISABLED  # an absolute encoder has nothing to search
    assert drive.state is want


def test_no_way_from_fault_to_torque_but_through_clear_and_enable() -> None:
    drive = enabled()
    drive.request(Request.STOP, 0.0)
    drive.command(Setpoint(torque_Nm=1.0), 0.0)
    for request in (Request.ENABLE, Request.CALIBRATE, Request.DISABLE, Request.SET_ZERO):
        assert not drive.request(request, 0.0)
        assert drive.update(STILL, STEP, 0.0) == 0.0
    assert drive.request(Request.CLEAR_FAULTS, 0.0)
    assert drive.update(STILL, STEP, 0.0) == 0.0
    assert drive.request(Request.ENABLE, 0.0)
    drive.command(Setpoint(torque_Nm=1.0), 0.0)
    assert drive.update(STILL, STEP, 0.0) == 1.0


@given(*(st.floats(-3, 3) for _ in range(5)), st.floats(0, 4), st.floats(0, 1))
def test_impedance_law(
    p_des: float, v_des: float, tau: float, p: float, v: float, kp: float, kd: float
) -> None:
    drive = enabled(DriveConfig(torque_limit_Nm=1e3))
    drive.command(Setpoint(p_des, v_des, tau, kp, kd), 0.0)
    got = drive.update(STILL._replace(motor_position_rad=p, motor_velocity_rad_s=v), STEP, 0.0)
    # the velocity that the law uses is that of the same reading
    assert got == pytest.approx(kp * (p_des - p) + kd * (v_des - v) + tau, abs=1e-12)


@given(st.floats(-1e6, 1e6), st.floats(0.1, 5.0))
def test_torque_never_exceeds_the_limit(torque: float, limit: float) -> None:
    drive = enabled(DriveConfig(torque_limit_Nm=limit), Mode.TORQUE)
    drive.command(Setpoint(torque_Nm=torque), 0.0)
    got = drive.update(STILL, STEP, 0.0)
    assert abs(got) <= limit
    assert bool(drive.flags & DriveFlag.OVER_TORQUE) is (abs(torque) > limit)
    drive.set_limits(torque_Nm=10 * limit)
    assert drive.config.torque_limit_Nm == limit


def test_position_and_velocity_modes_reach_their_targets() -> None:
    drive = enabled(mode=Mode.POSITION)
    assert run(drive, TwoMass(), 1.5, Setpoint(0.8)).motor_position_rad == pytest.approx(0.8, abs=2e-3)
    config = DriveConfig(velocity_integrator_Nm_per_rad=1.0)
    drive = enabled(config, Mode.VELOCITY)
    assert run(drive, TwoMass(), 3.0, Setpoint(velocity_rad_s=2.0)).motor_velocity_rad_s == pytest.approx(
        2.0, rel=1e-2
    )


def test_watchdog_stops_an_enabled_drive_and_only_that() -> None:
    drive, plant = enabled(DriveConfig(command_timeout_s=0.02)), TwoMass()
    run(drive, plant, 0.019)
    assert drive.state is DriveState.ENABLED
    run(drive, plant, 0.002)
    assert drive.state is DriveState.FAULT
    assert drive.flags & DriveFlag.COMMAND_TIMEOUT
    assert plant.last_command_Nm == 0.0
    idle = Drive(DriveConfig(command_timeout_s=0.02))
    run(idle, TwoMass(), 0.1)
    assert idle.state is DriveState.DISABLED


def test_a_drive_whose_silence_is_no_fault_lets_go_until_it_hears_again() -> None:
    drive, plant = enabled(DriveConfig(command_timeout_s=0.02, timeout_faults=False)), TwoMass()
    push = Setpoint(torque_Nm=0.5)
    run(drive, plant, 0.019, push)
    assert plant.last_command_Nm == pytest.approx(0.5)
    run(drive, plant, 0.03)
    assert (drive.state, plant.last_command_Nm) == (DriveState.ENABLED, 0.0)
    assert drive.flags & DriveFlag.COMMAND_TIMEOUT
    run(drive, plant, 0.002, push)
    assert plant.last_command_Nm == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("readings", "flag"),
    [
        (STILL._replace(motor_velocity_rad_s=61.0), DriveFlag.OVER_VELOCITY),
        (STILL._replace(temperature_degC=91.0), DriveFlag.OVER_TEMPERATURE),
        (STILL._replace(motor_position_rad=math.nan), DriveFlag.MOTOR_ENCODER),
        (STILL._replace(motor_position_rad=0.5), DriveFlag.MOTOR_ENCODER),
        (STILL._replace(motor_position_rad=math.inf), DriveFlag.MOTOR_ENCODER),
    ],
)
def test_each_fault_is_found_within_one_period_and_takes_the_torque_away(
    readings: Readings, flag: DriveFlag
) -> None:
    drive = enabled()
    drive.update(STILL, STEP, 0.0)
    drive.command(Setpoint(torque_Nm=1.0), 0.0)
    assert drive.update(STILL, STEP, 0.0) == 1.0
    assert drive.update(readings, STEP, 0.0) == 0.0
    assert drive.state is DriveState.FAULT
    assert drive.flags & flag
    assert math.isfinite(drive.report().position_rad)


def test_position_limit() -> None:
    drive = enabled(DriveConfig(position_min_rad=-0.5, position_max_rad=0.5))
    end = run(drive, TwoMass(), 1.0, Setpoint(3.0, 0.0, 0.0, 2.0, 0.1))
    assert end.motor_position_rad == pytest.approx(0.5, abs=1e-2)  # the target is clamped
    run(drive, TwoMass(start_rad=0.51), 0.1, Setpoint(torque_Nm=1.0))
    assert drive.flags & (DriveFlag.POSITION_LIMIT | DriveFlag.MOTOR_ENCODER)


def test_commands_that_are_not_finite_are_refused() -> None:
    drive = enabled()
    drive.command(Setpoint(torque_Nm=math.nan), 0.0)
    assert drive.flags & DriveFlag.BAD_FRAME
    assert drive.update(STILL, STEP, 0.0) == 0.0


@pytest.mark.parametrize("turns", [8.0, -3.0])
def test_a_drive_behind_a_gear_moves_the_pulley_as_one_without(turns: float) -> None:
    """Its gains are 1/turns^2, its angles turns (q + offset), its torque 1/turns of those at the pulley."""
    gear, offset = Gearbox(turns, 0.25), 0.25
    plain, geared, one, other = enabled(), enabled(DriveConfig(torque_limit_Nm=100.0)), TwoMass(), TwoMass()
    near, far = one.step(STEP, 0.0), other.step(STEP, 0.0)
    for _ in range(400):
        plain.command(Setpoint(0.1, 0.0, 0.05, 20.0, 0.2), one.time_s)
        geared.command(
            Setpoint(turns * (0.1 + offset), 0.0, 0.05 / turns, 20.0 / turns**2, 0.2 / turns**2), other.time_s
        )
        near = one.step(STEP, plain.update(near, STEP, one.time_s))
        far = other.step(STEP, gear.at_pulley(geared.update(gear.at_shaft(far), STEP, other.time_s)))
        assert far.motor_position_rad == pytest.approx(near.motor_position_rad, abs=1e-9)
    assert near.motor_position_rad > 0.05
    assert geared.position_rad == pytest.approx(turns * (near.motor_position_rad + offset), abs=1e-2)


@pytest.mark.parametrize("start", [-0.7, 0.05, 0.7])
def test_index_search_finds_the_absolute_angle_and_then_enables(start: float) -> None:
    config = DriveConfig(index_position_rad=0.3, velocity_gain_Nms_per_rad=0.2, search_range_rad=1.5)
    drive, plant = Drive(config), TwoMass(start_rad=start)
    run(drive, plant, 0.01)
    assert drive.position_rad == pytest.approx(0.0, abs=1e-3)  # it counts from where it woke
    drive.request(Request.ENABLE, plant.time_s)
    assert drive.state is DriveState.CALIBRATING
    for _ in range(int(6.0 / 0.01)):
        readings = run(drive, plant, 0.01)
        if drive.state is not DriveState.CALIBRATING:
            break
    assert drive.state is DriveState.ENABLED
    assert drive.homed
    assert drive.position_rad == pytest.approx(readings.motor_position_rad, abs=1e-9)


@pytest.mark.parametrize("name", ["capstan-arm", "snow-closed-rig"])
def test_index_search_overcomes_what_holds_a_joint_back(name: str) -> None:
    """Both hold the motor harder than the search's speed alone would push."""
    make = plant_maker(Path(__file__).parents[2] / f"configs/joints/{name}.toml", Scenario())
    drive, plant = Drive(DriveConfig(index_position_rad=0.3)), make(1)
    readings = plant.step(STEP, 0.0)
    drive.update(readings, STEP, readings.time_s)
    assert drive.request(Request.ENABLE, readings.time_s)
    while drive.state is DriveState.CALIBRATING and readings.time_s < 2.0:
        readings = plant.step(STEP, drive.update(readings, STEP, readings.time_s))
    assert drive.state is DriveState.ENABLED
    assert drive.position_rad == pytest.approx(readings.motor_position_rad, abs=1e-3)


def test_index_search_of_a_motor_that_cannot_turn_ends() -> None:
    drive = Drive(DriveConfig(index_position_rad=0.3))
    drive.update(STILL, STEP, 0.0)
    drive.request(Request.ENABLE, 0.0)
    for k in range(130):
        drive.update(STILL, 0.1, 0.1 * k)
    assert drive.state is DriveState.FAULT
    assert drive.flags & DriveFlag.INDEX_NOT_FOUND


def test_index_out_of_reach_is_a_fault() -> None:
    config = DriveConfig(index_position_rad=3.0, search_range_rad=0.3, search_velocity_rad_s=2.0)
    drive, plant = Drive(config), TwoMass()
    drive.request(Request.CALIBRATE, 0.0)
    run(drive, plant, 2.0)
    assert drive.flags & DriveFlag.INDEX_NOT_FOUND
    assert drive.state is DriveState.FAULT
    strict = Drive(DriveConfig(index_position_rad=0.1, calibrate_on_enable=False))
    strict.request(Request.ENABLE, 0.0)
    assert strict.state is DriveState.DISABLED
    assert strict.flags & DriveFlag.NOT_CALIBRATED


def test_reset_in_motion_forgets_everything() -> None:
    drive, plant = enabled(DriveConfig(index_position_rad=None)), TwoMass()
    drive.set_limits(torque_Nm=0.5)
    run(drive, plant, 0.1, Setpoint(torque_Nm=0.1))
    drive.request(Request.RESET, plant.time_s)
    assert drive.state is DriveState.DISABLED
    assert drive.flags == DriveFlag.STARTED_AFRESH
    assert drive.config == DriveConfig()
    run(drive, plant, 0.01)
    assert plant.last_command_Nm == 0.0


def test_zero_and_declared_position() -> None:
    drive, plant = Drive(DriveConfig()), TwoMass(start_rad=0.4)
    run(drive, plant, 0.001)
    drive.request(Request.SET_ZERO, 0.0)
    assert drive.position_rad == 0.0
    drive.set_position(2.0)
    assert drive.position_rad == pytest.approx(2.0)


def test_a_braked_fault_takes_energy_out() -> None:
    config = DriveConfig(fault_damping_Nms_per_rad=0.05)
    coasting, braked = enabled(), enabled(config)
    speeds = []
    for drive in (coasting, braked):
        plant = TwoMass()
        run(drive, plant, 0.2, Setpoint(torque_Nm=0.3))
        drive.request(Request.STOP, plant.time_s)
        speeds.append(abs(run(drive, plant, 0.2).motor_velocity_rad_s))
    assert speeds[1] < 0.2 * speeds[0]
