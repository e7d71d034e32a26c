"""What a calibration makes of a drive behind its own loop: it leans inside one count of its encoder, and it shakes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cablecomp.config import JointConfig, load_joint, read_toml
from cablecomp.control.standard import calibration_protocol
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.diagnosis.calibration.counts import with_places
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.calibration.every_sample import by_wide_steps, in_common, on_every_sample
from cablecomp.diagnosis.pace import Pace
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit
from cablecomp.examples import example
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import PlantConfig, simulate

ARM = load_joint("capstan-arm")
TRUE = {"EA_N": 67_000.0, "pretension_N": 175.0, "mu_output": 0.17, "mu_input": 0.16}
COUNT = 3.835e-4


def plant(config: JointConfig) -> PlantConfig:
    found = PlantConfig.from_dict(read_toml(example("joints", config.name)), config.name)
    return replace(found, stages=(replace(found.stages[0], **TRUE),))


def recorded(
    time: FloatArray, motor: FloatArray, load: FloatArray, read: FloatArray
) -> dict[str, FloatArray]:
    """What the plant's joint does, with noise on it; `read`: what the motor's encoder says."""
    noise = np.random.default_rng(1)
    joint = simulate(plant(ARM), time, motor, load).joint_position_rad
    return {
        "time_s": time,
        "motor_position_rad": read,
        "joint_position_rad": joint + 1.7e-5 * noise.standard_normal(len(time)),
        "joint_torque_Nm": load + 0.01 * noise.standard_normal(len(time)),
    }


def leaning() -> tuple[dict[str, FloatArray], FloatArray]:
    """The calibration's motion; where the motor rests it leans on the edge of a count that the load pulls it to. And by
    how much that is [rad of the motor]."""
    protocol = calibration_protocol(ARM)
    time = np.arange(0.0, protocol.duration_s, 0.02)
    asked = [protocol.reference(float(t)) for t in time]
    load = np.array([a.joint_torque_Nm for a in asked])
    motor = np.array([a.joint_position_rad for a in asked]) / ARM.drive.ratio
    rests = np.abs(np.gradient(motor)) < 1e-9
    read = COUNT * np.round(motor / COUNT)
    leans = np.where(rests, 0.45 * COUNT * np.sign(np.gradient(load)), 0.0)
    return recorded(time, np.where(rests, read, motor) + leans, load, read), leans


def test_a_motor_that_leans_inside_a_count_is_no_friction() -> None:
    columns, _ = leaning()
    found = calibrate(ARM, {"leaning": columns})
    off = {name: (found[name].value - true) / found[name].sd for name, true in TRUE.items()}
    assert max(map(abs, off.values())) < 3.0, off


def test_each_rest_and_way_of_the_load_has_a_place_of_its_own() -> None:
    """Together they make up for all that the motor leaned, and no row has two."""
    columns, leans = leaning()
    count = len(leans)
    e = gather(ARM, "leaning", columns, "all", fine_rows=count, judged_rows=count)
    places = with_places(ARM, e, COUNT).carryover["joint_position_rad"]
    assert np.max(np.count_nonzero(places, axis=1)) == 1
    seen = ARM.drive.ratio * np.interp(e.at_rows("time_s"), columns["time_s"], leans)
    left = seen - places @ np.linalg.lstsq(places, seen, rcond=None)[0]
    assert np.linalg.norm(left) < 0.3 * np.linalg.norm(seen)


def shaking() -> Fit:
    """Fitted to every sample of an arm that turns under a load that shakes."""
    time = np.arange(0.0, 12.0, 0.002)
    motor = 9.0 * np.sin(0.9 * time)
    load = 7.0 * np.sin(1.7 * time) * np.minimum(time, 1.0) + 0.3 * np.sin(2.0 * np.pi * 87.0 * time)
    columns = {"shaking": recorded(time, motor, load, motor)}
    drive = calibrate_drive(ARM, gather_body(ARM, columns).used, np.random.default_rng(0))
    return on_every_sample(drive, columns, Pace(lambda what, share: None, np.inf))


def test_a_drive_that_shakes_is_told_by_wide_steps() -> None:
    """A derivative over them says what a change of a value does; one over a thousandth says what its jumps do."""
    fit = by_wide_steps(shaking(), 0)
    fine = fit.problem.jacobian(fit.x, fit.residual)
    k = next(k for k, p in enumerate(fit.problem.parameters) if p.name == "mu_input")
    for side in (-1.0, 1.0):
        step = side * 0.4 * fit.problem.parameters[k].sd  # about as wide as its interval
        there = fit.problem.residual(fit.x + step * np.eye(len(fit.x))[k]) - fit.residual
        wide_misses, fine_misses = (np.linalg.norm(there - step * J[:, k]) for J in (fit.J, fine))
        assert wide_misses < 0.5 * fine_misses


def test_jumps_of_a_derivative_pass_for_no_knowledge() -> None:
    """Two columns that the rows tell apart by little, jumps far larger than that: the width of what is not known is
    that of the derivative without them (a square of one alone has it five times too narrow); where jumps
    hide all, the priors' width is left."""
    rng = np.random.default_rng(2)
    base = np.sin(np.linspace(0.0, 60.0, 4000))
    true = np.column_stack((base, base + 0.02 * np.cos(np.linspace(0.0, 60.0, 4000))))
    one, other = (true + 0.1 * rng.standard_normal(true.shape) for _ in range(2))
    J = in_common(np.vstack((one, np.eye(2))), np.vstack((other, np.eye(2))))
    wide, told, jumps = (
        np.sqrt(np.diag(np.linalg.inv(j.T @ j)))
        for j in (np.vstack((true, np.eye(2))), J, np.vstack((one, np.eye(2))))
    )
    assert np.allclose(told, wide, rtol=0.25)
    assert np.all(jumps < 0.25 * wide)
    hidden = in_common(*(np.vstack((k * rng.standard_normal(true.shape), np.eye(2))) for k in (1.0, 1.0)))
    assert np.all(np.diag(np.linalg.inv(hidden.T @ hidden)) <= 1.0 + 1e-9)
