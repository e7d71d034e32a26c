"""Calibration: what was put in comes out, within its stated uncertainty; priors, bounds and zeros do what they say."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from turning import LIMITED, NOISE_RAD, after_a_history

from cablecomp.config import JointConfig, Session, load_joint, with_values
from cablecomp.diagnosis.calibrate import Calibration, calibrate
from cablecomp.diagnosis.calibration.drive import _drums_exchanged
from cablecomp.errors import InputError
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit, solve
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.observer import Observer
from cablecomp.report.calibration import calibration_notes
from cablecomp.signal.smoothing import FloatArray

NOMINAL = load_joint(Path(__file__).parents[2] / "configs/joints/wrist-capstan.toml")
TRUE = {"EA_N": 16900.0, "pretension_N": 56.0, "mu_output": 0.15, "mu_input": 0.10}


def recording(
    config: JointConfig, seed: int, noise_rad: float = 2e-5, offset_rad: float = 0.0
) -> dict[str, FloatArray]:
    """30 s of the given joint's own observer, both pulleys turning, with encoder noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 30.0, 0.02)
    swell = np.minimum(1.0, time / 2.0)
    columns = {
        "time_s": time,
        "motor_position_rad": 1.8 * np.sin(0.7 * time + 0.3 * seed) * swell,
        "joint_torque_Nm": 1.6 * np.sin(1.9 * time) * np.cos(0.23 * time + seed) * swell,
        "temperature_degC": np.full(len(time), 20.0),
    }
    joint = Observer(config).run(columns)["joint_position_rad"]
    columns["joint_position_rad"] = joint + offset_rad + noise_rad * rng.standard_normal(len(time))
    return columns


@pytest.fixture(scope="module")
def fitted() -> Calibration:
    return calibrate(NOMINAL, {"one": recording(with_values(NOMINAL, TRUE), 1)})


def test_true_parameters_lie_within_four_sd(fitted: Calibration) -> None:
    for name, true in TRUE.items():
        found = fitted[name]
        assert abs(found.value - true) < 4.0 * found.sd + 2e-3 * true, found


def test_what_is_left_comes_down_to_the_noise(fitted: Calibration) -> None:
    assert fitted.nominal_rmse_rad > 5.0 * fitted.noise_rad
    assert fitted.rmse_rad < 1.3 * fitted.noise_rad


def test_the_configuration_holds_the_values(fitted: Calibration) -> None:
    stage = fitted.config.drive.stage[0]
    for name in TRUE:
        assert getattr(stage, name) == fitted[name].value
        assert fitted[name].nominal == getattr(NOMINAL.drive.stage[0], name)


def test_each_session_has_its_own_zero() -> None:
    true = with_values(NOMINAL, TRUE)
    pair = {"a/1": recording(true, 1, offset_rad=3e-3), "b/1": recording(true, 2, offset_rad=-2e-3)}
    found = calibrate(NOMINAL, pair)
    apart = found["joint_position_offset_rad@a"].value - found["joint_position_offset_rad@b"].value
    assert apart == pytest.approx(5e-3, abs=5e-5)
    own = {s.name: s.values["joint_position_offset_rad"] for s in found.config.sessions}
    assert own["a"] - own["b"] == pytest.approx(apart)


def test_sessions_whose_own_values_go_along_with_those_of_another_are_said() -> None:
    """Wednesday's cables are a fifth tighter than the joint's: so would be those of the days before."""
    nominal_N = NOMINAL.drive.stage[0].pretension_N
    days = (
        Session(name="mon", recordings=("mon",)),
        Session(name="tue", recordings=("tue",), values={"pretension_N": 0.8 * nominal_N}),
    )
    joint = NOMINAL.model_copy(
        update={"session": days, "tolerance": {**NOMINAL.tolerance, "pretension_N": 0.3}}
    )
    columns = recording(with_values(NOMINAL, {"pretension_N": 1.2 * nominal_N}), 1)
    found = calibrate(joint, {"wed/0": columns})
    (said,) = (w for w in found.warnings if "went along" in w)
    assert said.startswith("pretension_N of sessions that these recordings are not of")
    tighter = (nominal_N, found["pretension_N"].value)
    numbers = [float(v) for v in re.findall(r"`(?:mon|tue)` (\S+) -> (\S+?)[,;]", said) for v in v]
    assert numbers == pytest.approx([*tighter, *(0.8 * v for v in tighter)], rel=1e-3)
    same = recording(with_values(NOMINAL, {"pretension_N": 0.8 * nominal_N}), 1)
    assert not [w for w in calibrate(joint, {"tue/0": same}).warnings if "went along" in w]


def test_two_recordings_know_more_than_one(fitted: Calibration) -> None:
    true = with_values(NOMINAL, TRUE)
    both = calibrate(NOMINAL, {"one": recording(true, 1), "two": recording(true, 2)}, sessions="one")
    assert both["mu_output"].sd < fitted["mu_output"].sd


def test_without_information_the_prior_stays_and_that_is_said() -> None:
    columns = recording(NOMINAL, 1)
    columns["joint_torque_Nm"] = 0.0 * columns["joint_torque_Nm"]
    columns["motor_position_rad"] = 0.0 * columns["motor_position_rad"]
    rng = np.random.default_rng(2)
    columns["joint_position_rad"] = 2e-5 * rng.standard_normal(len(columns["time_s"]))
    found = calibrate(NOMINAL, {"one": columns})
    kept = {k.name: k for k in found.kept}
    assert "mu_output" in kept
    assert "mu_output" not in {v.name for v in found.values}
    assert found.config.drive.stage[0].mu_output == NOMINAL.drive.stage[0].mu_output
    assert found.config.tolerance["mu_output"] == NOMINAL.tolerance["mu_output"]
    assert "tell nothing" in kept["mu_output"].why
    advice = kept["mu_output"].advice  # motion under load would tell it, and is named
    assert advice is not None
    assert advice.sd < 0.7 * NOMINAL.tolerance["mu_output"]


def test_of_a_zero_that_is_not_told_the_amount_is_said_and_no_share() -> None:
    """Of the drive's friction a share."""
    tolerance = {**NOMINAL.tolerance, "joint_torque_offset_Nm": 0.05}
    columns = recording(NOMINAL, 1)
    for name in ("joint_torque_Nm", "motor_position_rad"):
        columns[name] = 0.0 * columns[name]
    columns["joint_position_rad"] = 2e-5 * np.random.default_rng(2).standard_normal(len(columns["time_s"]))
    found = calibrate(NOMINAL.model_copy(update={"tolerance": tolerance}), {"one": columns})
    kept = {k.name: k for k in found.kept}
    assert (kept["joint_torque_offset_Nm"].tolerance, kept["joint_torque_offset_Nm"].share) == (0.05, False)
    lines = list(calibration_notes(found))
    assert any(line.startswith("joint_torque_offset_Nm stays nominal, 0 ± 0.05: ") for line in lines)
    share = f"{100 * NOMINAL.tolerance['mu_output']:.2g} %"
    assert any(line.startswith(f"mu_output stays nominal, 0.12 ± {share}: ") for line in lines)


def test_without_time_left_the_quick_fit_is_given_and_that_is_said(fitted: Calibration) -> None:
    found = calibrate(NOMINAL, {"one": recording(with_values(NOMINAL, TRUE), 1)}, budget_s=0.0)
    assert "best so far" in found.warnings[0]
    assert not any("best so far" in line for line in fitted.warnings)
    for name, true in TRUE.items():
        assert abs(found[name].value - true) < 4.0 * found[name].sd + 0.02 * true, found[name]


def test_a_missing_channel_is_named() -> None:
    columns = recording(NOMINAL, 1)
    del columns["joint_position_rad"]
    with pytest.raises(InputError, match="joint_position_rad") as caught:
        calibrate(NOMINAL, {"one": columns})
    assert "\n" not in str(caught.value)


def test_what_went_before_the_first_sample_is_no_misfit() -> None:
    """Recordings after a history that nobody recorded: what is left is the noise, and no law is said to be missing."""
    found = calibrate(LIMITED, {f"{k}/1": after_a_history(k) for k in range(2)})
    assert found.rmse_rad < 1.3 * NOISE_RAD
    assert not any("more than noise" in line for line in found.warnings)


def test_a_load_read_off_the_motor_is_said_to_hold_its_friction() -> None:
    columns = recording(NOMINAL, 1)
    columns["motor_torque_Nm"] = -NOMINAL.drive.ratio * columns["joint_torque_Nm"]
    by_motor = NOMINAL.model_copy(
        update={"observer": NOMINAL.observer.model_copy(update={"load": "motor_torque"})}
    )
    for config, said in ((by_motor, True), (NOMINAL, False)):
        found = calibrate(config, {"one": columns}, budget_s=0.0)
        assert any("motor's own friction" in line for line in found.warnings) == said


def test_a_torque_of_the_wrong_sign_does_not_stop_the_drive() -> None:
    """An encoder that died, a motor torque that goes on, a drive known by order of magnitude: the joint's angle is
    followed, not the torque by a drive that does not turn."""
    tolerance = dict.fromkeys(("input_radius_m", "EA_N", "pretension_N", "mu_output", "mu_input"), 1.0)
    vague = NOMINAL.model_copy(update={"tolerance": tolerance})
    columns = recording(NOMINAL, 1, noise_rad=2e-3)
    columns["motor_torque_Nm"] = 3.0 * NOMINAL.drive.ratio * columns["joint_torque_Nm"]
    columns["joint_position_rad"][len(columns["time_s"]) // 5 :] = np.nan
    found = calibrate(vague, {"one": columns}, budget_s=0.0)
    assert found.rmse_rad < 1.2 * found.nominal_rmse_rad


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_motors_own_friction_in_the_load_is_not_taken_for_the_cables(way: float) -> None:
    """2 % of the greatest load, as a motor that yields to its load holds it: no value lies further from the truth than
    its interval allows, and none of friction is said to be better known than before."""
    columns = recording(with_values(NOMINAL, TRUE), 1)
    load = columns["joint_torque_Nm"]
    holds = way * 0.02 * float(np.max(np.abs(load))) * np.tanh(np.gradient(load) / 1e-3)
    columns["motor_torque_Nm"] = NOMINAL.drive.ratio * (holds - load)
    by_motor = NOMINAL.model_copy(
        update={"observer": NOMINAL.observer.model_copy(update={"load": "motor_torque"})}
    )
    found = calibrate(by_motor, {"one": columns})
    known = {v.name: v for v in found.values}
    off = {n: (known[n].value - true) / known[n].sd for n, true in TRUE.items() if n in known}
    assert "EA_N" in off
    assert max(map(abs, off.values())) < 2.0, off
    for name in ("mu_output", "mu_input"):
        assert found.config.tolerance[name] >= NOMINAL.tolerance[name]


def loosely_stated(tolerance: float) -> JointConfig:
    """An open circuit at 60 N, stated as 50 N: at 1.5 N m its cable would hang slack."""
    opened = NOMINAL.model_copy(update={"drive": NOMINAL.drive.model_copy(update={"circuit": "open"})})
    stated = with_values(opened, {"pretension_N": 50.0})
    return stated.model_copy(update={"tolerance": {**NOMINAL.tolerance, "pretension_N": tolerance}})


def test_a_pretension_stated_too_low_for_the_load_is_calibrated() -> None:
    """Within its tolerance (0.18 in the logarithm are 2.3 deviations) it is raised to what carries the load."""
    stated = loosely_stated(0.08)
    columns = recording(with_values(stated, {"pretension_N": 60.0}), 1)
    assert columns["joint_torque_Nm"].min() < -1.5
    found = calibrate(stated, {"one": columns})
    T0 = found["pretension_N"]
    assert T0.nominal == 50.0
    assert abs(T0.value - 60.0) < 4.0 * T0.sd + 0.12


def test_a_pretension_stated_surely_too_low_is_refused() -> None:
    stated = loosely_stated(0.002)
    columns = recording(with_values(stated, {"pretension_N": 60.0}), 1)
    with pytest.raises(InputError, match="slacken"):
        calibrate(stated, {"one": columns})


def test_the_rough_drum_is_told_from_the_smooth_one() -> None:
    """A fit that ended with the drums' coefficients the wrong way about crosses the ridge between the two answers; one
    that has them right does not (seed 1)."""
    rough, smooth = 0.25, 0.05
    time = np.arange(0.0, 20.0, 0.02)
    columns = {
        "time_s": time,
        "motor_position_rad": np.sin(0.7 * time),
        "joint_torque_Nm": 1.5 * np.sin(1.9 * time) * np.cos(0.23 * time),
    }
    true = with_values(NOMINAL, {"mu_output": rough, "mu_input": smooth})
    joint = Observer(true).run(columns)["joint_position_rad"]
    columns["joint_position_rad"] = joint + 2e-5 * np.random.default_rng(1).standard_normal(len(time))
    e = gather(NOMINAL, "one", columns, "all", fine_rows=800, judged_rows=300)
    weighing = Weighing({"joint_position_rad": 2e-5}, {"joint_position_rad": 2e-6})
    problem = Problem(NOMINAL, of_drive(NOMINAL), (e,), weighing)
    about = {"mu_output": smooth, "mu_input": rough}
    wrong = solve(problem, np.array([p.x(about.get(p.name, p.start)) for p in problem.parameters]), 30)
    right = _drums_exchanged(wrong)
    assert wrong.values["mu_input"] > wrong.values["mu_output"]
    assert right.values["mu_output"] > 2.0 * right.values["mu_input"]
    assert right.cost < 0.5 * wrong.cost
    assert _drums_exchanged(right).values["mu_output"] > _drums_exchanged(right).values["mu_input"]


def test_drums_that_cannot_change_places_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no drive can follow the other answer (a cable that would slacken)."""
    monkeypatch.setattr("cablecomp.diagnosis.calibration.drive.multi_start", lambda *_: [])
    problem: Any = SimpleNamespace(parameters=of_drive(NOMINAL))
    fit = Fit(problem, np.array([p.x(p.start) for p in problem.parameters]), np.ones(3), np.empty((3, 0)))
    assert _drums_exchanged(fit) is fit
