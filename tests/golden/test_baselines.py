"""Laws of the baselines: each one recovers data that its own equation made, and says what it cannot use."""

from __future__ import annotations

import numpy as np
import pytest
from baseline_operators import bouc_wen, plays
from baselines import (
    BASELINES,
    fit_bouc_wen,
    fit_linear,
    fit_plays,
    fit_polynomial,
    rmse,
)

from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray

TIME = np.arange(4_000) * 5e-3


def channels(seed: int = 0) -> dict[str, FloatArray]:
    motor = 0.8 * np.sin(0.9 * TIME + seed) * (1.0 + 0.3 * np.sin(0.23 * TIME))
    load = 1.5 * np.sin(0.55 * TIME + 2.0 * seed + 1.0)
    return {"time_s": TIME, "motor_position_rad": motor, "joint_torque_Nm": load, "joint_position_rad": motor}


def with_joint(make: object, seeds: tuple[int, ...] = (0, 1)) -> list[dict[str, FloatArray]]:
    assert callable(make)
    out = []
    for seed in seeds:
        given = channels(seed)
        given["joint_position_rad"] = make(given)
        out.append(given)
    return out


def test_linear_recovers_ratio_and_compliance() -> None:
    data = with_joint(lambda c: 0.1 + 0.6 * c["motor_position_rad"] + 0.02 * c["joint_torque_Nm"])
    model = fit_linear(data)
    assert model.parameters == pytest.approx(
        {"offset": 0.1, "motor_position_rad": 0.6, "joint_torque_Nm": 0.02}, rel=1e-6
    )
    assert rmse(model, data) < 1e-9


def test_plays_recover_weights_and_never_go_below_zero() -> None:
    reach = max(np.ptp(channels(seed)["motor_position_rad"]) for seed in (0, 1)) / 2.0
    radii = reach * (np.array([4.0, 8.0]) / 12.0) ** 2
    data = with_joint(
        lambda c: 0.5 * c["motor_position_rad"] + plays(c["motor_position_rad"], radii) @ [0.3, 0.2]
    )
    model = fit_plays(data)
    assert rmse(model, data) < 1e-6
    weights = [value for label, value in model.parameters.items() if label.startswith("play")]
    assert min(weights) >= 0.0
    assert sum(weights) == pytest.approx(0.5, rel=1e-3)


def test_bouc_wen_finds_its_own_parameters() -> None:
    data = with_joint(
        lambda c: (
            0.9 * c["motor_position_rad"]
            + 0.01 * c["joint_torque_Nm"]
            - 0.05 * bouc_wen(c["motor_position_rad"], 0.12, 0.7, 1.3)
        )
    )
    model = fit_bouc_wen(data)
    assert rmse(model, data) < 2e-4
    assert model.parameters["reach"] == pytest.approx(0.12, rel=0.1)
    assert model.parameters["hysteretic"] == pytest.approx(-0.05, rel=0.1)


def test_bouc_wen_saturates_and_unloads() -> None:
    out = bouc_wen(np.concatenate((np.linspace(0.0, 5.0, 500), np.linspace(5.0, 0.0, 500))), 0.2, 0.5, 1.0)
    assert out[499] == pytest.approx(1.0, abs=1e-3)
    assert out[-1] == pytest.approx(-1.0, abs=1e-3)
    assert np.all(np.abs(out) <= 1.0)


def test_polynomial_is_memoryless_and_general() -> None:
    data = with_joint(lambda c: c["motor_position_rad"] + 0.02 * c["joint_torque_Nm"] ** 2)
    model = fit_polynomial(data)
    assert rmse(model, data) < 1e-4
    hysteretic = with_joint(lambda c: plays(c["motor_position_rad"], np.array([0.3]))[:, 0])
    assert rmse(fit_polynomial(hysteretic), hysteretic) > 5.0 * rmse(fit_plays(hysteretic), hysteretic)


def test_own_offsets_are_no_error() -> None:
    data = with_joint(lambda c: 0.6 * c["motor_position_rad"])
    data[1]["joint_position_rad"] = data[1]["joint_position_rad"] + 0.3
    assert rmse(fit_linear(data), data) > 0.05
    for fit in BASELINES.values():
        assert rmse(fit(data, offsets="each"), data, "each") < 1e-3


def test_missing_channels_are_named() -> None:
    with pytest.raises(InputError, match="joint_position_rad"):
        fit_linear([{"time_s": TIME, "motor_position_rad": TIME}])
    with pytest.raises(InputError, match="at least one"):
        fit_linear([])
