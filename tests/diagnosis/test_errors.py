"""Errors on data left out: nothing of them is an unrecorded history's carry-over, all of them is what a model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from turning import LIMITED, NOISE_RAD, after_a_history

from cablecomp.diagnosis.answer.errors import errors_of
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive, without_history


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
