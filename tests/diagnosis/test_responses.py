"""Where a law of the drive changes along the load, an angle or the speed of slip, the drive's own memory tells it: held
against recordings of the independent plant."""

from __future__ import annotations

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed

from cablecomp.config import parse_joint
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.locate.remainders import covariates_of
from cablecomp.diagnosis.locate.responses import Place, every_row, responses
from cablecomp.diagnosis.outcome import Case
from cablecomp.errors import SlackError
from cablecomp.estimation.evidence import JOINT
from cablecomp.mechanics.change import Change
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

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


def calibrated(effect: str, values: dict[str, float], loads: float, *, locked: bool = False) -> Case:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 90.0, 0.04)
    soft = 1.0 - np.exp(-time)
    motor = soft * (0.8 * np.sin(1.1 * time) + 0.5 * np.sin(2.1 * time))
    motor = 0.0 * motor if locked else motor
    load = loads * soft * (0.9 * np.sin(1.7 * time) + 0.6 * np.sin(2.9 * time))
    found = simulate(
        PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=[EffectSpec(effect, values)]
    ).channels()
    columns: dict[str, FloatArray] = {"time_s": time}
    for name, noise in SMALL_NOISE.items():
        turned = 0.0 if locked and name == "motor_position_rad" else noise
        columns[name] = found[name] + turned * rng.standard_normal(len(time))
    joint = parse_joint(
        {**closed(SMALL, "small"), "tolerance": {"pretension_N": 0.06, "mu_output": 0.25}}, "small"
    )
    body = gather_body(joint, {"small/1": columns}, None)
    drive = calibrate_drive(joint, body.used, np.random.default_rng(0))
    return Case(joint, body, drive, tuple(covariates_of(joint, e) for e in drive.fit.problem.evidence))


@pytest.mark.parametrize("effect", LOCATED)
def test_the_covariate_along_which_a_law_changes_comes_first(effect: str) -> None:
    values, loads, covariates = LOCATED[effect]
    first = calibrated(effect, values, loads).located(np.random.default_rng(0)).mismatch[0]
    assert first.covariate in covariates
    assert first.p_value <= 0.002
    assert first.share > 0.3


def test_the_fit_on_every_row_predicts_the_judged_rows_alike() -> None:
    case = calibrated("nonlinear_cable", {"stiffening": 0.6}, 1.0)
    fit = case.drive.fit
    every = every_row(fit)
    for judged, fine in zip(fit.problem.evidence, every.problem.evidence, strict=True):
        assert len(fine.rows) == len(fine.columns["time_s"]) > len(judged.rows)
    few, all_rows = fit.problem.misfits(fit.x)[JOINT][0], every.problem.misfits(fit.x)[JOINT][0]
    there = all_rows[fit.problem.evidence[0].rows]
    # a law without rates is done with the turning points; what thinning rounds off is far below the noise
    assert float(np.sqrt(np.mean((few - there) ** 2))) < 0.2 * case.drive.floor_rad


def test_responses_stand_on_counted_rows() -> None:
    fit = calibrated("nonlinear_cable", {"stiffening": 0.6}, 1.0).drive.fit
    said = responses(fit)
    counted = len(fit.problem.owners(JOINT))
    assert {name for name, _ in said.sensitivities} == {"pretension", "friction on the joint's drum"}
    for columns in (*(r.columns for r in said.of_laws), *(c[:, None] for _, c in said.sensitivities)):
        assert columns.shape[0] == counted
        assert np.isfinite(columns).all()
        assert np.abs(columns).max() > 0.0


def test_a_change_that_the_drive_cannot_follow_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = calibrated("nonlinear_cable", {"stiffening": 0.6}, 1.0).drive.fit

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
    case = calibrated("nonlinear_cable", {"stiffening": 0.6}, 1.0, locked=True)
    assert "motor_angle" not in {m.covariate for m in case.located(np.random.default_rng(0)).mismatch}
