"""Laws of the covariates: directions, distances and dwell of known motions, noisy and quantised."""

from __future__ import annotations

import numpy as np
import pytest
from planted import columns
from turning import JOINT, recorded

from cablecomp.diagnosis.locate.covariates import FURTHER, UNITS, covariates, join, reversals
from cablecomp.diagnosis.locate.remainders import covariates_of
from cablecomp.errors import InputError
from cablecomp.estimation.gather import gather


def test_a_triangle_has_its_direction_rate_and_distance() -> None:
    time = np.arange(0.0, 40.0, 5e-3)
    load = 2.0 * np.abs((time / 10.0) % 2.0 - 1.0)
    rng = np.random.default_rng(2)
    read = np.round((load + 2e-3 * rng.standard_normal(len(time))) / 5e-3) * 5e-3
    found = covariates({"time_s": time, "motor_position_rad": 0.0 * time, "joint_torque_Nm": read})
    away = np.abs((time % 10.0) - 5.0) < 4.0
    rate = np.where((time // 10.0) % 2 == 0, -0.2, 0.2)
    assert np.array_equal(found.values["load_direction"][away], np.sign(rate[away]))
    np.testing.assert_allclose(found.values["load_rate"][away], rate[away], atol=0.02)
    np.testing.assert_allclose(found.values["reversal"][away], (0.2 * (time % 10.0))[away], atol=0.02)
    assert float(found.values["dwell"].max()) == 0.0


def test_dwell_is_the_time_since_the_load_stopped() -> None:
    time = np.arange(0.0, 20.0, 2e-3)
    load = np.interp(time, [0, 2, 8, 10, 20], [0, 1, 1, 2, 2])
    read = load + 1e-3 * np.random.default_rng(4).standard_normal(len(time))
    found = covariates({"time_s": time, "motor_position_rad": 0.0 * time, "joint_torque_Nm": read})
    dwell = found.values["dwell"]
    assert dwell[2_500] == pytest.approx(3.0, abs=0.3)
    assert dwell[-1] == pytest.approx(10.0, abs=0.3)
    assert np.all(dwell[(time > 0.5) & (time < 1.5)] == 0.0)
    assert found.resting_share == pytest.approx(0.8, abs=0.05)


def test_noise_makes_no_reversals() -> None:
    rng = np.random.default_rng(5)
    values = np.linspace(0.0, 1.0, 1_000) + 0.01 * rng.standard_normal(1_000)
    assert np.all(reversals(values, 0.1).direction[150:] == 1.0)
    assert np.count_nonzero(np.diff(reversals(values, 0.0).direction)) > 100


def test_a_reversal_is_dated_back_to_the_turning_point() -> None:
    values = np.array([0.0, 1.0, 2.0, 1.95, 1.5, 1.0])
    found = reversals(values, 0.2)
    assert list(found.direction) == [0.0, 1.0, 1.0, 1.0, -1.0, -1.0]
    assert found.distance[-1] == pytest.approx(1.0)


def test_names_are_those_of_the_contract() -> None:
    found = covariates(columns("sweep"))
    assert set(found.values) == {*UNITS, "other:elbow"}
    assert all(len(values) == found.samples for values in found.values.values())


def test_a_condition_s_channel_is_called_after_the_condition() -> None:
    read = {
        **recorded(),
        "other_bend": np.full(len(recorded()["time_s"]), 0.7),
        "other_near": recorded()["time_s"],
    }
    bent = JOINT.model_copy(update={"condition": {"bend_rad": "other_bend"}})
    seen = covariates_of(bent, gather(bent, "r", read, "all", fine_rows=400, judged_rows=100))
    assert [name for name in seen.values if name.startswith(FURTHER)] == ["condition:bend_rad", "other:near"]


def test_joining_keeps_what_all_recordings_have() -> None:
    first, second = columns("sweep", 2_000), columns("sweep", 1_000)
    del second["temperature_degC"]
    both = join([covariates(first), covariates(second)])
    assert both.samples == 3_000
    assert list(both.starts) == [0, 2_000]
    assert "temperature" not in both.values


def test_a_missing_channel_is_named() -> None:
    with pytest.raises(InputError, match="joint_torque_Nm"):
        covariates({"time_s": np.arange(50.0), "motor_position_rad": np.zeros(50)})


def test_noise_of_the_encoders_is_not_in_the_acceleration_that_a_residual_follows() -> None:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 40.0, 5e-3)
    motion = 0.3 * np.sin(2.0 * np.pi * time / 20.0)
    measured, predicted = (motion + sd * _slowly(rng, len(time)) for sd in (4e-4, 1e-4))
    columns = {"time_s": time, "motor_position_rad": motion, "joint_torque_Nm": np.sin(time)}
    columns["joint_position_rad"] = measured
    left = measured - predicted

    def goes_along(given: np.ndarray | None) -> float:
        return float(np.corrcoef(covariates(columns, given).values["acceleration"], left)[0, 1])

    assert goes_along(None) < -0.4  # by the joint's encoder alone
    assert abs(goes_along(predicted)) < 0.1


def _slowly(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Half of it white, half remembered for twenty samples."""
    white = rng.standard_normal((2, samples))
    for k in range(1, samples):
        white[1, k] = 0.95 * white[1, k - 1] + np.sqrt(1.0 - 0.95**2) * white[1, k]
    return np.asarray(white.sum(axis=0) / np.sqrt(2.0))
