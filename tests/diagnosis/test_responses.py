"""Where a law of the drive changes along the load, an angle or the speed of slip, the drive's own memory tells it: held
against recordings of the independent plant."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.locate.remainders import covariates_of
from cablecomp.diagnosis.locate.responses import Place, every_row, left_on_every_row, responses
from cablecomp.diagnosis.outcome import Case
from cablecomp.errors import SlackError
from cablecomp.estimation.evidence import JOINT
from cablecomp.mechanics.change import Change
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec

LOCATED = {
    "nonlinear_cable": ({"stiffening": 0.6}, 1.0, ("load",)),
    "pressure_dependent_friction": ({"exponent": 0.6}, 1.7, ("load",)),
    "position_dependent_friction:input_drum": (
        {"amplitude": 0.6, "phase_rad": 0.5},
        1.0,
        ("motor_angle", "joint_angle"),
    ),
    "viscous_slip": ({"coefficient_Ns_per_m_rad": 2e5}, 1.0, ("load_rate", "dwell")),
}
"""What the plant has, how large its loads are, and the covariates along which its law changes."""


def case_of(effect: str, values: dict[str, float], loads: float, *, locked: bool = False) -> Case:
    body, drive = calibrated(recorded([EffectSpec(effect, values)], 90.0, loads, locked=locked))
    left = left_on_every_row(drive.fit)
    seen = (covariates_of(TOLERANT, e, m) for e, m in zip(drive.fit.problem.evidence, left, strict=True))
    return Case(TOLERANT, body, drive, tuple(seen))


@pytest.mark.parametrize("effect", LOCATED)
def test_the_covariate_along_which_a_law_changes_comes_first(effect: str) -> None:
    values, loads, covariates = LOCATED[effect]
    first = case_of(effect, values, loads).located(np.random.default_rng(0)).mismatch[0]
    assert first.covariate in covariates
    assert first.p_value <= 0.002
    assert first.share > 0.3


def test_the_fit_on_every_row_predicts_the_judged_rows_alike() -> None:
    case = case_of("nonlinear_cable", {"stiffening": 0.6}, 1.0)
    fit = case.drive.fit
    every = every_row(fit)
    for judged, fine in zip(fit.problem.evidence, every.problem.evidence, strict=True):
        assert len(fine.rows) == len(fine.columns["time_s"]) > len(judged.rows)
    judged, fine = fit.problem.evidence[0], every.problem.evidence[0]
    # of the judged rows' readings noise is averaged off: predictions are compared, measured less misfit
    few = judged.at_rows(JOINT) - fit.problem.misfits(fit.x)[JOINT][0]
    there = (fine.at_rows(JOINT) - every.problem.misfits(fit.x)[JOINT][0])[judged.rows]
    # a law without rates is done with the turning points; what thinning rounds off is far below the noise
    assert float(np.sqrt(np.mean((few - there) ** 2))) < 0.2 * case.drive.floor_rad


def test_responses_stand_on_counted_rows() -> None:
    fit = case_of("nonlinear_cable", {"stiffening": 0.6}, 1.0).drive.fit
    said = responses(fit)
    counted = len(fit.problem.owners(JOINT))
    assert {name for name, _ in said.sensitivities} == {"pretension", "friction on the joint's drum"}
    for columns in (*(r.columns for r in said.of_laws), *(c[:, None] for _, c in said.sensitivities)):
        assert columns.shape[0] == counted
        assert np.isfinite(columns).all()
        assert np.abs(columns).max() > 0.0


def test_a_change_that_the_drive_cannot_follow_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = case_of("nonlinear_cable", {"stiffening": 0.6}, 1.0).drive.fit

    def slack(tau: FloatArray) -> FloatArray:
        raise SlackError("the load would slacken the cable")

    changes = (Change(tension_factor=slack), Change(stiffening=0.1))
    monkeypatch.setattr(
        "cablecomp.diagnosis.locate.responses._places",
        lambda joint, reach: [Place("load", "changes", changes)],
    )
    (only,) = responses(fit).of_laws
    assert only.columns.shape[1] == 1


def test_what_does_not_change_is_not_asked_about() -> None:
    case = case_of("nonlinear_cable", {"stiffening": 0.6}, 1.0, locked=True)
    assert "motor_angle" not in {m.covariate for m in case.located(np.random.default_rng(0)).mismatch}
