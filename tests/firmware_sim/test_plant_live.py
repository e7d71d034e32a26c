"""The live plant: motor, link and sensors, against closed forms and against the bench plant."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from plant_joints import joint

from firmware_sim.plant import (
    LISTED,
    EffectSpec,
    LinkSpec,
    MotorSpec,
    Plant,
    PlantConfig,
    PlantError,
    PlantReadings,
    PlantTruth,
    SensorSpec,
    simulate,
)

MOTOR = MotorSpec(2e-3, 4.0, coulomb_Nm=0.0, viscous_Nms_per_rad=0.0)
LINK = LinkSpec(0.01)


def hold(plant: Plant, target: float, readings: PlantReadings | None, stiffness: float) -> float:
    """Torque of a stiff, well damped hold of the motor; none before its first reading."""
    if readings is None:
        return 0.0
    truth = readings.truth
    damping = 2 * math.sqrt(stiffness * plant.motor.rotor_inertia_kgm2)
    return stiffness * (target - truth.motor_position_rad) - damping * truth.motor_velocity_rad_s


def truths(plant: Plant, commands: np.ndarray, dt: float = 1e-3, **more: float) -> list[PlantTruth]:
    return [plant.step(dt, float(c), **more).truth for c in commands]


def test_joint_accelerates_like_its_inertia() -> None:
    config = joint()
    plant = Plant(config, MOTOR, LINK)
    torque = 0.05
    last = truths(plant, np.full(200, torque))[-1]
    inertia = MOTOR.rotor_inertia_kgm2 + 1.02 * LINK.inertia_kgm2 * config.ratio**2
    assert last.motor_velocity_rad_s == pytest.approx(torque / inertia * 0.2, rel=0.01)
    assert last.joint_position_rad == pytest.approx(config.ratio * last.motor_position_rad, rel=0.01)


def test_link_swings_on_the_drive_at_its_natural_frequency() -> None:
    """Small swings on the zero-load stiffness 2 EA R²/L in series with the torque sensor."""
    config = joint(EA_N=2e4, mu_output=1.0, mu_input=1.0, free_length_m=0.3)
    s = config.stages[0]
    sensors = SensorSpec(joint_torque_compliance_rad_per_Nm=1e-3)
    plant = Plant(config, MotorSpec(10.0, 4.0), LINK, sensors)
    plant.step(1e-3, 0.0, external_torque_Nm=0.2)
    angle = np.array([t.joint_position_rad for t in truths(plant, np.zeros(2000), 5e-4)])
    stiffness = 1 / (s.free_length_m / (2 * s.EA_N * s.output_radius_m**2) + 1e-3)
    expected = math.sqrt(stiffness / LINK.inertia_kgm2) / (2 * math.pi)
    rises = np.nonzero((angle[1:] > 0) & (angle[:-1] <= 0))[0]
    found = (len(rises) - 1) / ((rises[-1] - rises[0]) * 5e-4)
    assert found == pytest.approx(expected, rel=0.03)


def test_a_torque_sensor_without_compliance_yields_nothing_that_shows() -> None:
    """The joint's encoder sits behind it: what it reads is the pulley, on the stiffest joint too."""
    config = joint(EA_N=2e5, free_length_m=0.02)
    plant = Plant(config, MotorSpec(10.0, 4.0), LINK)
    last = truths(plant, np.zeros(200), external_torque_Nm=1.0)[-1]
    yields = last.pulley_position_rad - config.ratio * last.motor_position_rad
    assert yields > 1e-5
    assert abs(last.joint_position_rad - last.pulley_position_rad) < 0.005 * yields


def test_live_and_bench_plant_are_one_drive() -> None:
    """What the live plant's cables went through, played to the bench plant, gives the same joint angle and
    tensions."""
    config = joint()
    plant = Plant(config, MOTOR, LinkSpec(0.01, gravity_Nm=0.8))
    rows, readings = [], None
    for k in range(1500):
        target = 1.2 * math.sin(2 * math.pi * 0.8 * k * 1e-3)
        readings = plant.step(1e-3, hold(plant, target, readings, 20.0))
        truth = readings.truth
        rows.append(
            (
                readings.time_s,
                truth.motor_position_rad,
                truth.load_path_Nm,
                truth.pulley_position_rad,
                truth.tension_h_N,
            )
        )
    table = np.array(rows)
    run = simulate(config, table[:, 0], table[:, 1], table[:, 2])
    span = np.ptp(table[:, 3] - config.ratio * table[:, 1])
    assert np.ptp(table[:, 1]) > 1.5
    assert np.max(np.abs(run.pulley_position_rad - table[:, 3])) < 3e-3 * span
    assert np.max(np.abs(run.tension_h_N - table[:, 4])) < 0.01 * config.stages[0].pretension_N


def test_link_rests_against_the_wall() -> None:
    link = LinkSpec(0.01, wall_rad=0.1, wall_stiffness_Nm_per_rad=300.0, wall_loss_s_per_rad=3.0)
    plant = Plant(joint(), MOTOR, link)
    readings = None
    for _ in range(3000):
        readings = plant.step(1e-3, hold(plant, 0.22, readings, 10.0))
    assert readings is not None
    truth = readings.truth
    depth = truth.joint_position_rad - 0.1
    assert truth.contact_torque_Nm == pytest.approx(-300.0 * depth, rel=1e-3)
    assert truth.joint_torque_Nm == pytest.approx(truth.contact_torque_Nm, rel=1e-3)
    s = plant.config.stages[0]
    assert s.output_radius_m * (truth.tension_h_N - truth.tension_l_N) == pytest.approx(
        truth.contact_torque_Nm, rel=1e-3
    )


def test_motor_friction_limit_and_current_loop() -> None:
    config = joint()
    stuck = Plant(config, MotorSpec(2e-3, 4.0, coulomb_Nm=0.1, presliding_rad=1e-4), LINK)
    slowly = np.linspace(0.0, 0.09, 1000)
    assert truths(stuck, slowly)[-1].motor_position_rad == pytest.approx(0.9e-4, rel=0.05)
    free = Plant(config, MotorSpec(2e-3, 4.0, coulomb_Nm=0.1, presliding_rad=1e-4), LINK)
    assert truths(free, np.full(200, 0.2))[-1].motor_position_rad > 0.1
    limited = Plant(config, MotorSpec(2e-3, 0.5, current_bandwidth_Hz=50.0), LINK)
    first = limited.step(1e-3, 10.0)
    assert first.motor_torque_Nm == pytest.approx(0.5 * (1 - math.exp(-2 * math.pi * 50.0 * 1e-3)))
    for _ in range(50):
        last = limited.step(1e-3, 10.0)
    assert last.motor_torque_Nm == pytest.approx(0.5)
    assert last.motor_current_A == pytest.approx(0.5 / limited.motor.torque_constant_Nm_per_A)


def test_it_starts_at_rest_and_stays_there_under_its_holding_torque() -> None:
    """A motor whose current loop never answers keeps the torque that it starts with."""
    unanswering = replace(MOTOR, current_bandwidth_Hz=0.0)
    for config in (joint(), joint("open")):
        plant = Plant(config, unanswering, LinkSpec(0.01, gravity_Nm=0.5, gravity_phase_rad=math.pi / 2))
        seen = truths(plant, np.zeros(300))
        # weight pulls the joint back; the motor carries it, and in an open circuit the preload too
        s = config.stages[0]
        preload = -s.input_radius_m * s.pretension_N if config.circuit == "open" else 0.0
        assert seen[0].motor_torque_Nm == pytest.approx(0.5 * config.ratio + preload, rel=0.02)
        assert np.ptp([t.motor_position_rad for t in seen]) < 1e-3
        assert seen[-1].joint_torque_Nm == pytest.approx(-0.5, rel=0.01)


def test_sensors_count_and_add_noise_from_the_seed() -> None:
    sensors = SensorSpec(
        motor_position_resolution_rad=1e-3,
        joint_position_noise_rad=1e-4,
        joint_torque_gain=1.1,
        joint_torque_offset_Nm=0.2,
    )
    a, b, c = (Plant(joint(), MOTOR, LINK, sensors, seed=seed) for seed in (3, 3, 4))
    command = 0.05 * np.sin(np.arange(400) * 0.02)
    one, two, three = ([p.step(1e-3, float(u)) for u in command] for p in (a, b, c))
    assert one == two
    assert one != three
    counts = np.array([r.motor_position_rad for r in one]) / 1e-3
    assert np.max(np.abs(counts - np.round(counts))) < 1e-9
    noise = np.array([r.joint_position_rad - r.truth.joint_position_rad for r in one])
    assert np.std(noise) == pytest.approx(1e-4, rel=0.15)
    for r in one[::50]:
        assert r.joint_torque_Nm == pytest.approx(1.1 * r.truth.joint_torque_Nm + 0.2)


def test_clearance_lets_the_link_rattle_within_its_gap() -> None:
    gap = 0.02
    plant = Plant(joint(), MOTOR, LINK, effects=(EffectSpec("termination_backlash", {"gap_rad": gap}),))
    readings = None
    lag = []
    for k in range(2000):
        readings = plant.step(1e-3, hold(plant, 0.5 * math.sin(0.012 * k), readings, 10.0))
        lag.append(readings.truth.joint_position_rad - readings.truth.pulley_position_rad)
    assert max(lag) == pytest.approx(gap / 2, rel=0.1)
    assert min(lag) == pytest.approx(-gap / 2, rel=0.1)


BENCH_ONLY = {
    "input_play",
    "self_heating",
    "neighbour_tightens",
    "encoder_hub_slip",
    "torque_sensor_lag",
    "joint_encoder_drift",
}


def test_every_effect_runs_live_or_says_that_it_cannot() -> None:
    from test_plant_effects import NEUTRAL, SIZES

    assert not BENCH_ONLY & set(LISTED)
    target = 0.3 * np.sin(0.02 * np.arange(60))
    for name, neutral in NEUTRAL.items():
        effect = EffectSpec(name, SIZES.get(name, {k: (v or 1e-3) for k, v in neutral.items()}))
        if name in BENCH_ONLY:
            with pytest.raises(PlantError, match=f"{name} can be played on the bench only"):
                Plant(joint(), MOTOR, LINK, effects=(effect,))
            continue
        plant = Plant(joint(), MOTOR, LINK, effects=(effect,))
        readings = None
        for wanted in target:
            readings = plant.step(1e-3, hold(plant, float(wanted), readings, 10.0))
        assert readings is not None
        assert math.isfinite(readings.joint_position_rad), name


def test_late_clock_delays_the_joint_reading() -> None:
    effect = EffectSpec("clock_skew", {"delay_s": 0.005})
    plant = Plant(joint(), MOTOR, LINK, effects=(effect,))
    seen = [plant.step(1e-3, 0.1) for _ in range(100)]
    for k in (20, 50, 99):
        assert seen[k].joint_position_rad == pytest.approx(seen[k - 5].truth.joint_position_rad, abs=1e-9)
    with pytest.raises(PlantError, match="delay_s >= 0"):
        Plant(joint(), MOTOR, LINK, effects=(EffectSpec("clock_skew", {"delay_s": -0.005}),))


def test_a_motor_that_runs_away_ends_in_one_clear_line() -> None:
    config = PlantConfig("short", "closed", joint(wrap_output_rad=1.0, wrap_input_rad=2.0).stages)
    plant = Plant(config, MOTOR, LINK)
    with pytest.raises(PlantError, match="cable is left on a drum"):
        truths(plant, np.ones(3000))
    with pytest.raises(PlantError, match="finite torques"):
        plant.step(1e-3, math.nan)
