"""The thesis's closed forms must come out of the general history law; none of them is coded into it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from observer_joints import joint, pull_unit
from series_forms import series_loading_deflection_rad, series_unloading_deflection_rad

from cablecomp.observer import Observer
from cablecomp.thesis.closed_forms.closed import (
    closed_loading_deflection_rad,
    closed_unloading_deflection_rad,
)
from cablecomp.thesis.closed_forms.open import open_loading_deflection_rad, open_unloading_deflection_rad
from cablecomp.thesis.closed_forms.stage import equivalent_stage

Array = NDArray[np.float64]
STIFF = 6e11  # N: strains of 1e-10, so that the drums hardly turn and the thesis's locked pulleys are met
LONG = {"wrap_output_rad": 60.0, "wrap_input_rad": 60.0, "EA_N": STIFF}


def locked(observer: Observer, loads: Array) -> Array:
    """Deflection under loads with the motor at zero."""
    return observer.run(
        {
            "time_s": np.arange(float(len(loads))),
            "motor_position_rad": np.zeros(len(loads)),
            "joint_torque_Nm": loads,
        }
    )["deflection_rad"]


def ramp(*corners: float, points: int = 40) -> Array:
    """Straight segments through corners."""
    parts = [np.linspace(a, b, points + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([[corners[0]], *parts])


@pytest.mark.parametrize("length", [1e-3, 0.08, 1.0, 10.0])
@pytest.mark.parametrize("peak", [0.4, 1.3, -0.9])
def test_closed_circuit_loading_and_unloading(length: float, peak: float) -> None:
    config = joint("closed", {**LONG, "free_length_m": length})
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, peak * unit)[1:], ramp(peak * unit, 0.05 * peak * unit)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [closed_loading_deflection_rad(up, stage), closed_unloading_deflection_rad(down, peak * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


@pytest.mark.parametrize("peak", [1.5, -0.6])
def test_open_circuit_loading_and_unloading(peak: float) -> None:
    config = joint("open", LONG)
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, peak * unit)[1:], ramp(peak * unit, 0.0)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [open_loading_deflection_rad(up, stage), open_unloading_deflection_rad(down, peak * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_a_cable_that_goes_slack_and_is_taken_up_again() -> None:
    config = joint("closed", {**LONG, "free_length_m": 40.0})
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up = ramp(0.0, 3.0 * unit, points=60)[1:]
    loads = np.concatenate([[0.0], up, ramp(3.0 * unit, 0.0)[1:]])
    observer = Observer(config)
    found = locked(observer, loads)
    expected = closed_loading_deflection_rad(up, stage)
    assert found[1:61] == pytest.approx(expected, rel=2e-5)  # a slack cable keeps a millionth of T0
    assert np.all(np.diff(found[60:]) < 0.0)


def test_chains_of_open_stages_are_their_equivalent_stage() -> None:
    first = {
        **LONG,
        "pretension_N": 60.0 * (0.015 / 0.04) * 0.04 / 0.03,
        "output_radius_m": 0.03,
        "mu_output": 0.2,
    }
    config = joint("open", first, LONG)
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, 0.9 * unit)[1:], ramp(0.9 * unit, 0.0)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [open_loading_deflection_rad(up, stage), open_unloading_deflection_rad(down, 0.9 * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_closed_stages_in_series_add_with_their_ratios() -> None:
    config = joint("closed", {**LONG, "free_length_m": 0.3}, LONG)
    unit = pull_unit(config)
    up, down = ramp(0.0, 1.1 * unit)[1:], ramp(1.1 * unit, 0.1 * unit)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [
            series_loading_deflection_rad(up, config.drive),
            series_unloading_deflection_rad(down, 1.1 * unit, config.drive),
        ]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_return_point_memory_and_wiping_out() -> None:
    config = joint("closed")
    unit = pull_unit(config)
    outer = ramp(0.0, 1.2 * unit, -1.0 * unit, 0.5 * unit)
    inner = ramp(0.5 * unit, 0.1 * unit, 0.4 * unit, 0.2 * unit, 0.5 * unit)[1:]
    rest = ramp(0.5 * unit, 1.1 * unit, -0.4 * unit)[1:]
    plain = locked(Observer(config), np.concatenate([outer, rest]))
    nested = locked(Observer(config), np.concatenate([outer, inner, rest]))
    scale = float(np.ptp(plain))
    assert abs(nested[len(outer) + len(inner) - 1] - plain[len(outer) - 1]) < 1e-12 * scale
    assert np.max(np.abs(nested[-len(rest) :] - plain[-len(rest) :])) < 1e-12 * scale
