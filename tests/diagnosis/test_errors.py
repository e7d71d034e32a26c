"""Errors on data left out: nothing of them is what an unrecorded past still does, all of them is what a model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from turning import JOINT, course

from cablecomp.config import Limits
from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive, without_history
from cablecomp.effects import with_effects
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

NOISE = 2e-5
REACH = Limits(motor_position_min_rad=-1.8, motor_position_max_rad=1.8, joint_torque_max_Nm=1.6)
LIMITED = JOINT.model_copy(update={"limits": REACH})


def after_a_past(seed: int, softness: float = 0.0) -> dict[str, FloatArray]:
    """A recording of small loads with the motor at rest, after the joint was wound back and forth under great ones that
    nobody recorded."""
    before = course(14.0, seed=seed)
    time = np.arange(0.0, 16.0, 0.02)
    small = 0.5 * np.sin(1.1 * time + seed) * (1.0 - np.exp(-time))
    ease = np.linspace(1.0, 0.0, 100)
    motor, load = (before[c] for c in ("motor_position_rad", "joint_torque_Nm"))
    whole = {
        "motor_position_rad": np.concatenate([motor, motor[-1] * ease, np.zeros_like(time)]),
        "joint_torque_Nm": np.concatenate([load, load[-1] * ease, small]),
    }
    whole["time_s"] = 0.02 * np.arange(len(whole["joint_torque_Nm"]))
    joint = with_effects(JOINT, [("series_compliance", {"compliance_rad_per_Nm": softness})])
    angle = Observer(joint).run(whole)["joint_position_rad"]
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(angle))
    return {c: v[-len(time) :] for c, v in {**whole, "joint_position_rad": angle + noise}.items()}


def test_an_unrecorded_past_is_no_error_and_a_missing_law_is() -> None:
    left = []
    for softness in (0.0, 4e-4):
        body = gather_body(LIMITED, {f"{k}/1": after_a_past(k, softness * k) for k in range(2)})
        drive = calibrate_drive(LIMITED, body.used, np.random.default_rng(0))
        left.append(errors_of(drive.fit, body.final, body.final_by))
    right, wrong = left
    for error in (right.rmse_rad, right.heldout_rmse_rad, right.final_rmse_rad):
        assert error < 1.5 * NOISE
    assert wrong.heldout_rmse_rad > 2.0 * right.heldout_rmse_rad
    assert wrong.final_rmse_rad > 2.0 * right.final_rmse_rad


def test_the_past_of_a_recording_that_the_fit_has_not_seen_is_told_by_its_own_rows() -> None:
    body = gather_body(LIMITED, {f"{k}/1": after_a_past(k) for k in range(2)})
    seen, unseen = body.used
    drive = calibrate_drive(LIMITED, [seen], np.random.default_rng(0))
    known = without_history(drive.fit, [unseen])[0]
    blind = [replace(e, past={}) for e in known]
    errors = [errors_of(drive.fit, final, "block").final_rmse_rad for final in (known, blind)]
    assert errors[0] < 1.5 * NOISE
    assert errors[1] > 2.0 * errors[0]
