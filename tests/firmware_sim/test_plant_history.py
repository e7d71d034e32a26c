"""What the plant remembers: nested loops, wiping out, erasure by turning, and an independent finite-element
plant."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from plant_joints import clock, course, joint

from firmware_sim.plant import PlantConfig, Resolution, StageConfig, simulate

DATA = Path(__file__).parent / "data"

WIDE = ("closed", (0.04, 0.015, 0.08, 25000.0, 60.0, 0.12, 0.18, 10.0, 12.0))
SHORT = ("closed", (0.04, 0.04, 0.01, 25000.0, 40.0, 0.08, 0.08, 5.0, 5.0))
OPEN = ("open", (0.03, 0.02, 0.12, 20000.0, 30.0, 0.1, 0.14, 12.0, 12.0))


@pytest.mark.parametrize(
    ("name", "drive", "limit"),
    [
        ("wide_locked-nested", WIDE, 3e-4),
        ("wide_moving", WIDE, 3e-4),
        ("short-wrap_locked-finite-wrap", SHORT, 3e-4),
        # strains of 4e-3: here the plant's finite strain shows against the reference's small strain
        ("open_moving", OPEN, 9e-4),
    ],
)
def test_agrees_with_reference_runs(name: str, drive: tuple[str, tuple[float, ...]], limit: float) -> None:
    with gzip.open(DATA / f"reference_{name}.csv.gz", "rt") as file:
        table = np.loadtxt(file, delimiter=",", skiprows=3)
    config = PlantConfig(name, drive[0], (StageConfig(*drive[1]),))
    run = simulate(config, table[:, 0], table[:, 1], table[:, 3])
    span = np.ptp(table[:, 2] - config.ratio * table[:, 1])
    assert np.max(np.abs(run.joint_position_rad - table[:, 2])) < limit * span
    assert np.max(np.abs(run.tension_h_N - table[:, 4])) < 2e-3 * config.stages[0].pretension_N


def test_a_closed_inner_loop_leaves_no_trace() -> None:
    config = joint()
    scale = config.stages[0].output_radius_m * config.stages[0].pretension_N
    direct = course(0.0, 1.0, 1.3) * scale
    detour = course(0.0, 1.0, 0.2, 0.7, 0.4, 0.7, 0.2, 1.0, 1.3) * scale
    a = simulate(config, clock(direct), 0 * direct, direct)
    b = simulate(config, clock(detour), 0 * detour, detour)
    size = a.joint_position_rad[-1]
    assert b.joint_position_rad[-1] == pytest.approx(a.joint_position_rad[-1], abs=1e-8 * size)
    assert b.joint_position_rad[1400] == pytest.approx(a.joint_position_rad[200], abs=1e-8 * size)


def test_a_larger_swing_erases_what_was_before() -> None:
    config = joint()
    scale = config.stages[0].output_radius_m * config.stages[0].pretension_N
    ends = []
    for before in ((0.0, 0.3), (0.0, 0.6, -0.5, 0.2), (0.0, -0.7, 0.1)):
        load = course(*before, 1.4, -1.4, 1.4, 0.5) * scale
        ends.append(simulate(config, clock(load), 0 * load, load).joint_position_rad[-1])
    assert np.ptp(ends) < 2e-4 * abs(ends[0])


def test_step_length_does_not_matter() -> None:
    config = joint()
    t = np.arange(0, 8, 0.02)
    fine = np.arange(0, t[-1] + 1e-9, 0.0025)
    motor, moment = 1.5 * np.sin(0.9 * t), 1.5 * np.sin(1.7 * t + 0.3)
    a = simulate(config, t, motor, moment)
    b = simulate(config, fine, np.interp(fine, t, motor), np.interp(fine, t, moment))
    # the finer run follows the same straight pieces, so the two should meet at the coarser one's samples
    assert np.max(np.abs(a.deflection_rad - b.deflection_rad[::8])) < 5e-4 * np.ptp(b.deflection_rad)


def test_turning_the_pulley_erases_a_bump_where_the_sheet_says() -> None:
    """Peak 2.2 T0, then 1.3 T0: gone once (|u_pk| − |u_app|)/mu has been unwound; here the tension stays
    above T0."""
    mu, peak, held = 0.15, 2.2, 1.3
    config = joint(
        "open", mu_output=mu, mu_input=mu, wrap_output_rad=14.0, input_radius_m=0.04, free_length_m=0.3
    )
    s = config.stages[0]
    scale = s.output_radius_m * s.pretension_N
    turn = np.linspace(0.0, -5.0, 1000)

    def deflections(*loads: float) -> np.ndarray:
        up = course(*loads)
        motor = np.concatenate([0 * up, turn[1:]])
        load = np.concatenate([up, np.full(len(turn) - 1, up[-1])]) * scale
        run = simulate(config, clock(load), motor, load, resolution=Resolution(friction_step=0.01))
        return run.deflection_rad[len(up) - 1 :]

    # a bump with its corner at α' adds 2 [T_app (e^(mu α') − 1)/mu − α' T0]/EA to the deflection
    bump = deflections(0.0, peak - 1.0, held - 1.0) - deflections(0.0, held - 1.0)
    corners = np.linspace(0.0, 2.5, 2000)
    adds = 2 * s.pretension_N / s.EA_N * (held * np.expm1(mu * corners) / mu - corners)
    corner = np.interp(bump - bump[-1], adds, corners)
    whole = (math.log(peak) - math.log(held)) / mu
    expected = np.maximum(0.5 * (whole + turn), 0.0)  # (2-72), and gone at the general form of (2-74)
    assert np.max(np.abs(corner - expected)) < 0.02


def test_efficiency_of_a_stroke_after_a_load_reversal_meets_its_limit() -> None:
    """(2-118): loss over work is M/(R EA) while cable leaves a drum at T_h that was stored at T_l."""
    config = joint(
        input_radius_m=0.04, mu_output=0.15, mu_input=0.15, wrap_output_rad=20.0, wrap_input_rad=20.0
    )
    s = config.stages[0]
    moment = 0.4 * s.output_radius_m * s.pretension_N
    load = np.concatenate([course(0.0, -moment), np.full(1499, -moment), course(-moment, moment)])
    load = np.concatenate([load, np.full(600, moment)])
    there, back = np.linspace(0.0, 6.0, 1500), np.linspace(6.0, 3.6, 601)
    motor = np.concatenate([np.zeros(200), there, np.full(200, 6.0), back])
    run = simulate(config, clock(load), motor, load)
    stroke = slice(len(load) - 600, len(load))
    put_in = np.trapezoid(run.motor_torque_Nm[stroke], run.motor_position_rad[stroke])
    taken_out = -np.trapezoid(run.joint_torque_Nm[stroke], run.joint_position_rad[stroke])
    assert put_in > taken_out > 0
    assert 1 - taken_out / put_in == pytest.approx(moment / (s.output_radius_m * s.EA_N), rel=5e-3)


def test_a_closed_load_cycle_never_gives_work_back() -> None:
    config = joint()
    t = np.arange(0, 12, 0.01)
    motor, load = 1.2 * np.sin(2 * math.pi * t / 3), 1.5 * np.sin(2 * math.pi * t / 4 + 0.7)
    run = simulate(config, t, motor, load)
    power = run.motor_torque_Nm * np.gradient(run.motor_position_rad, t) + load * np.gradient(
        run.joint_position_rad, t
    )
    # the course repeats every 12 s; what it takes beyond that is lost in friction
    assert np.trapezoid(power, t) > 0
