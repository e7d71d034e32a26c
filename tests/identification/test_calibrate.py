"""Calibration: what was put in comes out, within its stated uncertainty; priors, bounds and offsets do
what they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cablecomp.config import JointConfig, load_joint
from cablecomp.errors import InputError
from cablecomp.identification.calibrate import Calibration, FitOptions, calibrate
from cablecomp.identification.parameters import free_parameters, with_values
from cablecomp.observer import Observer

NOMINAL = load_joint(Path(__file__).parents[2] / "configs/joints/wrist-capstan.toml")
TRUE = {"EA_N": 16900.0, "pretension_N": 56.0, "mu_output": 0.15, "mu_input": 0.10}
ONE = FitOptions(rows=1500, starts=1)


def recording(
    config: JointConfig, seed: int, noise_rad: float = 2e-5, offset_rad: float = 0.0
) -> dict[str, np.ndarray]:
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
    return calibrate(NOMINAL, [recording(with_values(NOMINAL, TRUE), 1)], options=ONE)


def test_true_parameters_lie_within_four_sd(fitted: Calibration) -> None:
    for name, true in TRUE.items():
        found = fitted[name]
        assert abs(found.value - true) < 4.0 * found.sd + 1e-3 * true, found


def test_residual_comes_down_to_the_noise(fitted: Calibration) -> None:
    assert fitted.nominal_rmse_rad[0] > 5.0 * fitted.noise_rad
    assert fitted.rmse_rad[0] < 1.2 * fitted.noise_rad
    assert fitted["EA_N"].value == fitted.config.drive.stage[0].EA_N
    assert not fitted.at_bound


def test_covariance_belongs_to_the_sds(fitted: Calibration) -> None:
    assert np.allclose(np.sqrt(np.diag(fitted.covariance)), [v.sd for v in fitted.values])
    assert np.all(
        np.linalg.eigvalsh(fitted.covariance / np.outer(*(2 * (np.sqrt(np.diag(fitted.covariance)),)))) > 0
    )


def test_each_recording_has_its_own_offset_if_asked() -> None:
    true = with_values(NOMINAL, TRUE)
    pair = [recording(true, 1, offset_rad=3e-3), recording(true, 2, offset_rad=-2e-3)]
    both = calibrate(NOMINAL, pair, options=FitOptions(rows=2000, starts=1, offset_each=True))
    assert both["joint_position_offset_rad[0]"].value == pytest.approx(3e-3, abs=2e-5)
    assert both["joint_position_offset_rad[1]"].value == pytest.approx(-2e-3, abs=2e-5)
    assert abs(both["mu_output"].value - 0.15) < 4.0 * both["mu_output"].sd + 2e-4


def test_two_recordings_know_more_than_one(fitted: Calibration) -> None:
    true = with_values(NOMINAL, TRUE)
    both = calibrate(
        NOMINAL, [recording(true, 1), recording(true, 2)], options=FitOptions(rows=3000, starts=1)
    )
    assert both["mu_output"].sd < fitted["mu_output"].sd


def test_a_parameter_that_ends_on_its_bound_is_a_warning() -> None:
    columns = recording(with_values(NOMINAL, {"EA_N": 17500.0}), 1)
    found = calibrate(NOMINAL, [columns], ["EA_N"], bounds={"EA_N": (16000.0, 16800.0)}, options=ONE)
    assert found.at_bound == ("EA_N",)
    assert any("EA_N" in line for line in found.warnings)


def test_without_information_the_prior_stays() -> None:
    columns = recording(NOMINAL, 1)
    columns["joint_torque_Nm"] = 0.0 * columns["joint_torque_Nm"]
    columns["joint_position_rad"] = columns["motor_position_rad"] / 3.0
    found = calibrate(NOMINAL, [columns], ["mu_output"], options=ONE)
    assert found["mu_output"].value == pytest.approx(0.12, rel=0.05)
    assert found["mu_output"].sd == pytest.approx(0.30 * 0.12, rel=0.1)


def test_values_go_into_the_configuration_and_back() -> None:
    values = {"EA_N": 17000.0, "joint_position_offset_rad": 1e-3, "mu_output.1": 0.2}
    changed = with_values(NOMINAL, values)
    assert changed.drive.stage[0].EA_N == 17000.0
    assert changed.drive.stage[0].mu_output == 0.2
    assert changed.sensors.joint_position_offset_rad == 1e-3
    for p in free_parameters(NOMINAL, ["EA_N", "joint_torque_gain", "joint_position_offset_rad"]):
        assert p.value(0.0) == p.nominal
        assert (p.value(1e-6) - p.value(-1e-6)) / 2e-6 == pytest.approx(p.slope(0.0), rel=1e-6)


@pytest.mark.parametrize("name", ["stiffness", "EA_N.2", "effect.viscous_slip.coefficient", "breaking"])
def test_unknown_names_are_refused_in_one_line(name: str) -> None:
    with pytest.raises(InputError) as caught:
        calibrate(NOMINAL, [recording(NOMINAL, 1)], [name], options=ONE)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_channel_is_named() -> None:
    columns = recording(NOMINAL, 1)
    del columns["joint_position_rad"]
    with pytest.raises(InputError, match="joint_position_rad"):
        calibrate(NOMINAL, [columns], options=ONE)
