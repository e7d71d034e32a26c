"""A path seen from both ends: balance of moments, capstan ratio, thinning, fits that find what was put in."""

from __future__ import annotations

from dataclasses import replace
from math import inf, radians

import numpy as np
import pytest

from cablecomp.config import JointConfig, parse_joint
from cablecomp.errors import InputError
from cablecomp.identification.path_fit import JOINT, MOTOR, Unknown, fit_path, misfit_of, rms
from cablecomp.identification.path_selection import best_of, loop_of, select_effects
from cablecomp.identification.transmission_path import (
    BEND,
    FRICTION,
    STIFFENING,
    ZERO_EA,
    PathRecording,
    after_first_reversal,
    by_travel,
    direction,
    path_config,
    predict_path,
    with_path_effects,
)
from cablecomp.observer import Observer

STAGE = {
    "output_radius_m": 0.005, "input_radius_m": 0.004, "free_length_m": 0.4, "EA_N": 9000.0,
    "pretension_N": 12.0,
    "mu_output": 0.1, "mu_input": 0.1, "wrap_output_rad": 6.0, "wrap_input_rad": 6.0,
}  # fmt: skip
GUIDE = {"routing_friction": {"mu_angle": 0.3, "arc_length_m": 0.1}}
MU = "effect.routing_friction.mu_angle"


def drive(**tolerance: float) -> JointConfig:
    return parse_joint(
        {
            "schema": 1,
            "name": "path",
            "drive": {"circuit": "closed", "stage": [STAGE]},
            "tolerance": tolerance,
        },
        "path",
    )


def swings(load_Nm: float = 0.02, samples: int = 400, name: str = "a", **more: float) -> PathRecording:
    time = np.linspace(0.0, 10.0, samples)
    columns = {
        "time_s": time,
        "motor_position_rad": 0.5 - 0.5 * np.cos(1.5 * time),
        "joint_torque_Nm": np.full(samples, load_Nm) + 0.2 * load_Nm * np.sin(0.7 * time),
    }
    return PathRecording(name, "s", columns, np.ones(samples, dtype=bool), **more)


def measured(config: JointConfig, values: dict[str, float], recording: PathRecording) -> PathRecording:
    found = predict_path(config, values, recording)
    both = {JOINT: found.joint_position_rad, MOTOR: found.motor_torque_Nm}
    return replace(recording, columns={**recording.columns, **both})


def test_the_joint_end_is_the_observers_own_prediction() -> None:
    config, recording = with_path_effects(drive(), GUIDE), swings()
    np.testing.assert_array_equal(
        predict_path(config, {}, recording).joint_position_rad,
        Observer(config).run(recording.columns)["joint_position_rad"],
    )


def test_without_friction_on_the_path_the_moments_balance() -> None:
    recording = swings()
    torque = predict_path(drive(), {}, recording).motor_torque_Nm
    np.testing.assert_allclose(torque, -0.8 * recording.columns["joint_torque_Nm"], rtol=1e-9)


def test_a_sliding_path_shows_the_capstan_ratio_at_its_ends() -> None:
    config, recording = with_path_effects(drive(), GUIDE), swings()
    found = Observer(config).run(recording.columns)
    inside = predict_path(config, {}, recording).tension_in_N
    middle = np.abs(recording.columns["motor_position_rad"] - 0.5) < 0.1
    ratio = np.abs(np.log(inside[:, 0] / found["tension_h_N"]))[middle]
    np.testing.assert_allclose(ratio, 0.3, rtol=1e-6)


def test_friction_at_the_motor_adds_its_torque_along_the_motion() -> None:
    recording = swings()
    plain = predict_path(drive(), {}, recording).motor_torque_Nm
    rubbing = predict_path(drive(), {FRICTION: 0.01}, recording).motor_torque_Nm
    way = direction(recording.columns["motor_position_rad"], radians(0.15))
    np.testing.assert_allclose(rubbing - plain, 0.01 * way, atol=1e-15)
    assert way.min() == -1.0
    assert way.max() == 1.0


def test_more_pretension_leaves_the_cable_its_own_law() -> None:
    config = with_path_effects(drive(), {"nonlinear_cable": {"stiffening": 0.0}})
    law = {ZERO_EA: 2000.0, STIFFENING: 500.0}
    for tension in (3.0, 9.0):
        found = path_config(config, {**law, "pretension_N": tension}, swings())
        stage, b = found.drive.stage[0], found.effect[0].parameters["stiffening"]
        at_20 = stage.EA_N * (1.0 + b * (20.0 / tension - 1.0))
        assert at_20 == pytest.approx(2000.0 + 500.0 * 20.0)


def test_thinning_by_travel_changes_little_where_no_rate_acts() -> None:
    config, full = (
        with_path_effects(drive(), GUIDE),
        measured(with_path_effects(drive(), GUIDE), {}, swings(samples=8000)),
    )
    thin = by_travel(full.columns, 1, radians(1.0))
    assert len(thin["time_s"]) < 600
    again = predict_path(config, {}, PathRecording("t", "s", thin, np.ones(len(thin["time_s"]), dtype=bool)))
    worst = np.max(np.abs(again.joint_position_rad - thin[JOINT]))
    assert worst < 0.1 * np.ptp(full.columns[JOINT] - 0.8 * full.columns["motor_position_rad"])


def test_thinning_counts_swings_and_judging_starts_at_the_first_reversal() -> None:
    recording = swings(samples=2000)
    thin = by_travel(recording.columns, 1, radians(1.0), swings=2)
    assert thin["time_s"][-1] == pytest.approx(2.0 * np.pi / 1.5, abs=1.2)
    counted = after_first_reversal(recording.columns)
    assert recording.columns["time_s"][counted][0] == pytest.approx(np.pi / 1.5, abs=0.25)


def test_a_fit_over_recordings_finds_friction_by_bend_and_what_is_one_recordings_own() -> None:
    config = with_path_effects(drive(), {**GUIDE, "gravity_load": {"moment_Nm": 0.01, "phase_rad": 0.0}})
    phase = "effect.gravity_load.phase_rad"
    truth = {MU: 0.15, BEND: 0.2, "EA_N": 7000.0}
    parts = []
    for k, (bend, rest) in enumerate(((0.0, 0.3), (1.0, -0.2), (2.0, 0.5))):
        blank = swings(0.01, 150, str(k), bend_rad=bend, own={f"rest[{k}]": phase})
        parts.append(measured(config, {**truth, f"rest[{k}]": rest}, blank))
    unknowns = [
        Unknown(MU, 0.3, 0.01, 3.0), Unknown(BEND, 0.1, 0.01, 2.0), Unknown("EA_N", 9000.0, 900.0, 90000.0),
        *(Unknown(f"rest[{k}]", 0.1, -3.0, 3.0, inf, False) for k in range(3)),
    ]  # fmt: skip
    fit = fit_path(config, parts, unknowns, scale={JOINT: 1e-3, MOTOR: 1e-3}, iterations=30, weigh=False)
    for name, value in truth.items():
        assert fit.values[name] == pytest.approx(value, rel=0.02)
    assert rms(misfit_of(fit, parts)) < 1e-5


def test_priors_hold_what_the_recordings_do_not_show() -> None:
    config = with_path_effects(drive(), GUIDE)
    part = measured(config, {}, swings(samples=150))
    unknowns = [Unknown(MU, 0.3, 0.01, 3.0, 0.5), Unknown("mu_output", 0.1, 0.01, 1.0, 0.5)]
    fit = fit_path(config, [part], unknowns, scale={MOTOR: 1e-3}, iterations=10)
    assert fit.values["mu_output"] == pytest.approx(0.1, rel=0.05)
    assert fit.values[MU] == pytest.approx(0.3, rel=1e-3)


def test_the_search_names_the_path_and_nothing_else() -> None:
    truth = with_path_effects(drive(), {"routing_friction": {"mu_angle": 0.35, "arc_length_m": 0.12}})
    rng = np.random.default_rng(3)
    parts = []
    for k, load in enumerate((0.005, 0.02, 0.04)):
        part = measured(truth, {FRICTION: 0.01}, swings(load, 150, str(k)))
        noisy = {c: part.columns[c] + s * rng.standard_normal(150) for c, s in ((JOINT, 1e-3), (MOTOR, 5e-4))}
        parts.append(
            replace(part, columns={**part.columns, **noisy}, counted=after_first_reversal(part.columns))
        )
    assert loop_of(parts).torque_Nm > 0.01
    trials = select_effects(
        drive(EA_N=1.0, pretension_N=1.0), parts[::2], parts[1:2], ("series_compliance", "routing_friction"),
        {JOINT: 1e-3, MOTOR: 5e-4},
    )  # fmt: skip
    assert best_of(trials).effects == ("routing_friction",)
    assert best_of(trials).heldout == pytest.approx(2.0, abs=0.5)


def test_an_effect_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="routing_friction"):
        predict_path(drive(), {BEND: 0.1}, swings())
    with pytest.raises(InputError, match="add it"):
        predict_path(drive(), {MU: 0.1}, swings())
