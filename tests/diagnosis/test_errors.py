"""Errors on data left out: nothing of them is an unrecorded history's carry-over, all of them is what a model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_drive import TOLERANT
from small_drive import recorded as small_recorded
from turning import JOINT as WRIST
from turning import LIMITED, NOISE_RAD, after_a_history, recorded

from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive, without_history
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import solve
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec


def test_an_unrecorded_history_is_no_error_and_a_missing_law_is() -> None:
    left = []
    for softness in (0.0, 4e-4):
        body = gather_body(LIMITED, {f"{k}/1": after_a_history(k, softness * k) for k in range(2)})
        drive = calibrate_drive(LIMITED, body.used, np.random.default_rng(0))
        left.append(errors_of(drive.fit, body.final, body.final_by))
    right, wrong = left
    for error in (right.rmse_rad, right.heldout_rmse_rad, right.final_rmse_rad):
        assert error < 1.5 * NOISE_RAD
    assert wrong.heldout_rmse_rad > 2.0 * right.heldout_rmse_rad
    assert wrong.final_rmse_rad > 2.0 * right.final_rmse_rad


def test_the_carryover_of_a_recording_that_the_fit_has_not_seen_is_told_by_its_own_rows() -> None:
    body = gather_body(LIMITED, {f"{k}/1": after_a_history(k) for k in range(2)})
    seen, unseen = body.used
    drive = calibrate_drive(LIMITED, [seen], np.random.default_rng(0))
    known = without_history(drive.fit, [unseen])[0]
    blind = [replace(e, carryover={}) for e in known]
    errors = [errors_of(drive.fit, final, "block").final_rmse_rad for final in (known, blind)]
    assert errors[0] < 1.5 * NOISE_RAD
    assert errors[1] > 2.0 * errors[0]


def gapped(seed: int, begin_s: float) -> dict[str, FloatArray]:
    """A recording that misses a swing of the load and back, of 0.8 s."""
    time = np.arange(0.0, 16.0, 0.02)
    into = np.clip((time - begin_s) / 0.8, 0.0, 1.0)
    load = 0.8 * np.sin(2.0 * time + seed) * (1.0 - np.exp(-time)) + 0.45 * np.sin(np.pi * into)
    whole = {"time_s": time, "motor_position_rad": np.zeros_like(time), "joint_torque_Nm": load}
    noise = NOISE_RAD * np.random.default_rng(seed).standard_normal(len(time))
    whole[JOINT] = Observer(LIMITED).run(whole)[JOINT] + noise
    return {c: v[(into <= 0.0) | (into >= 1.0)] for c, v in whole.items()}


def test_what_a_gap_leaves_is_no_error_of_rows_that_alone_tell_it() -> None:
    """It is forgotten by the next swing: while that is left out, nothing says where the load went in the gap."""
    body = gather_body(LIMITED, {f"{k}/1": gapped(k, 5.2 + 0.3 * k) for k in range(2)})
    drive = calibrate_drive(LIMITED, body.used, np.random.default_rng(0))
    assert any(e.hidden for e in drive.fit.problem.evidence)
    assert errors_of(drive.fit, body.final, body.final_by).heldout_rmse_rad < 1.3 * NOISE_RAD


def test_a_recording_that_the_drive_cannot_follow_is_predicted_as_by_a_rigid_one() -> None:
    """Motion beyond what is wound on the drums, kept for the end: no number would hide it, and hide a name with it."""
    body = gather_body(LIMITED, {f"{k}/1": after_a_history(k) for k in range(2)})
    drive = calibrate_drive(LIMITED, body.used, np.random.default_rng(0))
    (one,) = body.final[:1]
    count = len(one.columns["time_s"])
    motor = np.linspace(0.0, 50.0, count)
    joint = LIMITED.drive.ratio * motor + 0.01 * np.where(np.arange(count) % 2, 1.0, -1.0)
    far = replace(
        one, columns={**one.columns, "motor_position_rad": motor, JOINT: joint}, name="far", session="far"
    )
    error = errors_of(drive.fit, [far], "recording").final_rmse_rad
    assert error == pytest.approx(0.01, rel=0.1)


def test_what_does_not_carry_to_the_end_is_explained_in_part() -> None:
    """A bearing that drags, and an encoder that is knocked in the stretch that is kept for the end."""
    columns = small_recorded(
        [EffectSpec("bearing_friction", {"torque_Nm": 0.03, "presliding_rad": 2e-4})], 20.0
    )
    columns["joint_position_rad"][columns["time_s"] > 18.0] += 3e-4
    found = diagnose(TOLERANT, {"small/1": columns})
    assert [named.effect for named in found.named] == ["bearing_friction"]
    assert found.augmented.final_rmse_rad > 10.0 * found.augmented.heldout_rmse_rad
    assert found.verdict == "partly explained"


def test_an_error_is_one_of_the_time_that_its_rows_stand_for_and_a_zero_of_its_own_is_none() -> None:
    """Rows kept for the end that stand for more time than usual (a hold) make no larger error of the same misfit."""
    joint = WRIST.model_copy(update={"tolerance": {"EA_N": 0.05}})
    two = [
        gather(joint, f"{k}", recorded(offset_rad=k * 5e-3, seed=k), "a", fine_rows=1000, judged_rows=80)
        for k in range(2)
    ]
    weighing = Weighing({JOINT: NOISE_RAD}, {JOINT: 1e-2})
    fit = solve(Problem(joint, of_drive(joint), tuple(two), weighing), evaluations=2)
    misfit = np.where(np.arange(len(two[0].columns[JOINT])) % 2, 1e-3, -1e-3)
    rough = replace(two[0], columns={**two[0].columns, JOINT: two[0].columns[JOINT] + misfit})
    for rows in (rough.weight > 1.2, rough.weight < 0.8):
        errors = errors_of(fit, [replace(rough, counted={JOINT: rows})], "recording")
        assert errors.final_rmse_rad == pytest.approx(1e-3, rel=0.02)
    assert errors.heldout_own_zero_rmse_rad < 2.0 * NOISE_RAD < 0.1 * errors.heldout_rmse_rad
