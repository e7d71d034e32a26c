"""Effects on the pretension: creep and temperature, each against its own law."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from effect_cases import Floats, excitation, joint, resting, run, still
from scipy.integrate import quad

from cablecomp.effects import catalogue

LONG = 400.0  # m of free span: the wraps hardly matter beside it


def late_by_one(values: Floats) -> Floats:
    return np.concatenate((values[:1], values[:-1]))


@pytest.mark.parametrize("name", ["snow-closed-rig", "two-stage-series"])
def test_relaxation_lowers_the_tensions_by_its_law(name: str) -> None:
    config = joint(name)
    time = np.geomspace(1.0, 5000.0, 60) - 1.0
    found = run(
        config, resting(time + 17.0), ("pretension_relaxation", {"fraction": 0.04, "time_constant_s": 3.0})
    )
    # what lies on the drums follows with the next sample
    expected = config.drive.stage[-1].pretension_N * (1.0 - 0.04 * np.log1p(late_by_one(time) / 3.0))
    assert found["tension_h_N"] == pytest.approx(expected, rel=1e-9)
    assert found["tension_l_N"] == pytest.approx(expected, rel=1e-9)
    assert found["deflection_rad"] == pytest.approx(np.zeros_like(time), abs=1e-12)


def test_creep_goes_on_evenly_where_its_first_stage_has_come_to_rest() -> None:
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 60.0, 601)
    law = {"fraction": 0.04, "time_constant_s": 3.0, "power": -20.0, "steady": 0.1}
    found = run(config, resting(time), ("pretension_relaxation", law))["tension_h_N"]
    first = 21.0 / 20.0 * (1.0 - (1.0 + time / 63.0) ** -20.0)
    expected = config.drive.stage[0].pretension_N * (1.0 - 0.04 * (first + 0.1 * time / 3.0))
    assert found == pytest.approx(late_by_one(expected), rel=1e-9)
    assert -np.gradient(found, time)[-1] == pytest.approx(33.54 * 0.04 * 0.1 / 3.0, rel=1e-3)


def test_warmth_quickens_creep_and_a_missing_reading_does_not() -> None:
    """The material's own time by an integral of its own."""
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 20.0, 2001)
    warm = 20.0 + 10.0 * np.sin(0.5 * time)
    law = {"fraction": 0.04, "time_constant_s": 3.0, "quickening_per_K": 0.1}
    columns = resting(time) | {"temperature_degC": warm}
    found = run(config, columns, ("pretension_relaxation", law))["tension_h_N"]
    own = [quad(lambda t: math.exp(math.sin(0.5 * t)), 0.0, end, limit=200)[0] for end in time[::200]]
    expected = config.drive.stage[0].pretension_N * (1.0 - 0.04 * np.log1p(np.array(own) / 3.0))
    assert found[201::200] == pytest.approx(expected[1:-1], rel=1e-4)  # within a sample
    unread = resting(time) | {"temperature_degC": np.full_like(time, np.nan)}
    plain = run(config, resting(time), ("pretension_relaxation", {**law, "quickening_per_K": 0.0}))
    assert run(config, unread, ("pretension_relaxation", law))["tension_h_N"] == pytest.approx(
        plain["tension_h_N"], rel=1e-12
    )
    hot = resting(time) | {"temperature_degC": np.full_like(time, 1e5)}
    assert np.all(np.isfinite(run(config, hot, ("pretension_relaxation", law))["tension_h_N"]))


def test_creep_that_began_before_the_recording_goes_on() -> None:
    """A recording that begins 20 s into the creep: the joint's tensions are those of one long recording there."""
    config = joint(free_length_m=LONG)
    time = np.linspace(100.0, 140.0, 401)
    law = {"fraction": 0.04, "time_constant_s": 3.0}
    whole = run(config, resting(time), ("pretension_relaxation", law))
    later = run(config, resting(time[200:]), ("pretension_relaxation", {**law, "began_s": 100.0}))
    # what lies on the drums follows with the next sample
    assert later["tension_h_N"][1:] == pytest.approx(whole["tension_h_N"][201:], rel=1e-9)
    assert later["tension_h_N"][0] < 0.95 * whole["tension_h_N"][0]


def test_what_expands_late_follows_a_step_of_temperature_exponentially() -> None:
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 10.0, 401)
    columns = resting(time) | {"temperature_degC": np.where(time >= 2.0, 30.0, 20.0)}
    values = {"coefficient_per_K": 0.01, "reference_degC": 20.0, "lag_s": 1.5}
    found = run(config, columns, ("thermal_pretension", values))["tension_h_N"]
    warm = 10.0 * (1.0 - np.exp(-np.maximum(time - 1.975, 0.0) / 1.5))
    stage = config.drive.stage[0]
    assert found == pytest.approx(stage.pretension_N * (1.0 + 0.01 * warm), rel=3e-3)


def test_what_expands_late_lags_a_ramp_of_temperature_however_seldom_it_is_read() -> None:
    """y = r (t - t_l (1 - e^(-t/t_l))) behind a ramp r t, read every second and the half."""
    config = joint(free_length_m=LONG)
    values = {"coefficient_per_K": 0.01, "reference_degC": 20.0, "lag_s": 1.5}
    for every in (0.5, 1.0):
        time = np.arange(0.0, 8.0, every)
        columns = resting(time) | {"temperature_degC": 20.0 + 2.0 * time}
        found = run(config, columns, ("thermal_pretension", values))["tension_h_N"]
        warm = 2.0 * (time + 1.5 * np.expm1(-time / 1.5))
        expected = config.drive.stage[0].pretension_N * (1.0 + 0.01 * warm)
        assert found == pytest.approx(late_by_one(expected), rel=1e-9)


def test_a_frame_that_sticks_follows_the_temperature_once_that_has_turned_by_enough() -> None:
    """From 20 to 26 degC and back, 2 K of it taken up by joints that stick, from their middle on."""
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 12.0, 481)
    warm = 26.0 - np.abs(time - 6.0)
    values = {"coefficient_per_K": 0.01, "reference_degC": 21.0, "stick_K": 2.0}
    found = run(config, resting(time) | {"temperature_degC": warm}, ("thermal_pretension", values))
    slid = np.where(time < 6.0, np.maximum(warm - 2.0, 20.0), np.minimum(warm + 2.0, 24.0))
    expected = config.drive.stage[0].pretension_N * (1.0 + 0.01 * (slid - 21.0))
    assert found["tension_h_N"] == pytest.approx(late_by_one(expected), rel=1e-9)


@pytest.mark.parametrize("law", [{"lag_s": 1.5}, {"stick_K": 2.0}])
def test_what_expands_begins_with_the_first_reading_of_the_temperature(law: dict[str, float]) -> None:
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 10.0, 401)
    warm = 24.0 + 3.0 * np.sin(time)
    values = {"coefficient_per_K": 0.01, "reference_degC": 24.0, **law}

    def tension(begin: int) -> Floats:
        columns = resting(time[begin:]) | {"temperature_degC": warm[begin:].copy()}
        columns["temperature_degC"][: 40 - begin] = np.nan
        return run(config, columns, ("thermal_pretension", values))["tension_h_N"]

    assert tension(0)[41:] == pytest.approx(tension(40)[1:], rel=1e-9)


def test_relaxation_stops_before_the_cable_is_slack() -> None:
    time = np.linspace(0.0, 1e6, 50)
    found = run(joint(), resting(time), ("pretension_relaxation", {"fraction": 0.3, "time_constant_s": 1e-3}))
    assert found["tension_h_N"][-1] == pytest.approx(0.05 * 33.54, rel=1e-9)


def test_pretension_follows_the_temperature() -> None:
    config = joint()
    time = np.linspace(0.0, 10.0, 80)
    warm = 25.0 + 8.0 * np.sin(time)
    warm[:3] = np.nan
    columns = resting(time, temperature_degC=warm)
    found = run(
        config, columns, ("thermal_pretension", {"coefficient_per_K": -0.015, "reference_degC": 23.0})
    )
    expected = np.where(np.isnan(warm), 1.0, 1.0 - 0.015 * (warm - 23.0)) * config.drive.stage[0].pretension_N
    assert found["tension_h_N"] == pytest.approx(late_by_one(expected), rel=1e-9)


def test_loops_grow_as_the_pretension_falls() -> None:
    config = joint()
    columns = excitation(config, moving=False)
    loose = run(config, columns, ("pretension_relaxation", {"fraction": 0.1, "time_constant_s": 0.1}))
    firm = run(config, columns)
    assert np.ptp(loose["deflection_rad"]) > 1.02 * np.ptp(firm["deflection_rad"])


def loaded_then(factor: float, samples: int = 400) -> tuple[float, float, float]:
    """Deflection and tensions of the locked rig, loaded to 0.6 R T0, then brought to that share of T0."""
    time = np.linspace(0.0, 4.0, samples)
    load = 1.2 * np.clip(time, 0.0, 1.0)
    warm = 20.0 + np.clip(time - 2.0, 0.0, 1.0)
    values = {"coefficient_per_K": factor - 1.0, "reference_degC": 20.0}
    found = run(joint(), still(time, load, temperature_degC=warm), ("thermal_pretension", values))
    return found["deflection_rad"][-1], found["tension_h_N"][-1], found["tension_l_N"][-1]


def test_tightening_a_loaded_drive_adds_the_same_tension_everywhere() -> None:
    """Slopes stay within friction, so nothing slips: the joint stays, both tensions rise alike."""
    before, after = loaded_then(1.0), loaded_then(1.1)
    assert after[0] == pytest.approx(before[0], rel=2e-4)
    assert after[1] - before[1] == pytest.approx(3.354, rel=0.01)
    assert after[2] - before[2] == pytest.approx(3.354, rel=0.01)


def test_loosening_a_loaded_drive_ends_where_a_loose_one_is_loaded() -> None:
    """The slip zones grow in the direction in which they slid: no memory of the order of events."""
    fresh = run(joint(pretension_N=0.9 * 33.54), still(np.arange(50.0), 1.2 * np.linspace(0.0, 1.0, 50)))
    after = loaded_then(0.9)
    assert after[0] == pytest.approx(fresh["deflection_rad"][-1], rel=1e-4)
    assert after[1] == pytest.approx(fresh["tension_h_N"][-1], rel=1e-4)


def test_an_open_circuits_own_weight_relaxes_with_it() -> None:
    """T = T0(t) + M/R: what hangs in an open circuit is its pretension."""
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    time = np.linspace(0.0, 10.0, 30)
    load = 0.2 * np.sin(time)
    found = run(
        config, still(time, load), ("pretension_relaxation", {"fraction": 0.05, "time_constant_s": 1.0})
    )
    expected = stage.pretension_N * (1.0 - 0.05 * np.log1p(time)) + load / stage.output_radius_m
    assert found["tension_h_N"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("power", "left"),
    [
        (0.5, lambda u: 1.0 - 0.04 * 2.0 * (np.sqrt(u) - 1.0)),  # Andrade's kind: by a power of time
        (1.0, lambda u: 1.0 - 0.04 * (u - 1.0)),  # evenly
        (-1.0, lambda u: 1.0 - 0.08 * (1.0 - 2.0 / (1.0 + u))),  # second order: comes to rest at 1 - 2 a
        (1e-9, lambda u: 1.0 - 0.04 * np.log(u)),  # its limit: the logarithm
    ],
)
def test_relaxation_goes_by_a_power_of_time_or_comes_to_rest(
    power: float, left: Callable[[Floats], Floats]
) -> None:
    config, time = joint(free_length_m=LONG), np.linspace(0.0, 12.0, 60)
    law = {"fraction": 0.04, "time_constant_s": 3.0, "power": power}
    found = run(config, resting(time + 17.0), ("pretension_relaxation", law))["tension_h_N"]
    expected = config.drive.stage[-1].pretension_N * left(1.0 + late_by_one(time) / 3.0)
    assert found == pytest.approx(expected, rel=1e-7)


def test_of_the_first_order_it_falls_exponentially() -> None:
    """(1 + t/(21 t_c))^-20 is e^(-20 t/(21 t_c)) within 3 % of the whole fall, which is 21/20 of a."""
    config, time = joint(free_length_m=LONG), np.linspace(0.0, 20.0, 200)
    law = {"fraction": 0.1, "time_constant_s": 4.0, "power": -20.0}
    found = run(config, resting(time), ("pretension_relaxation", law))["tension_h_N"]
    exponential = 1.0 - 0.105 * (1.0 - np.exp(-late_by_one(time) / 4.2))
    assert found / config.drive.stage[-1].pretension_N == pytest.approx(exponential, abs=0.003)


def test_pretension_that_follows_the_temperature_ever_more_steeply() -> None:
    config, time = joint(free_length_m=LONG), np.linspace(0.0, 10.0, 80)
    warm = 25.0 + 6.0 * np.sin(time)
    law = {"coefficient_per_K": -0.015, "bend_per_K": 0.05, "reference_degC": 23.0}
    columns = resting(time, temperature_degC=warm)
    found = run(config, columns, ("thermal_pretension", law))["tension_h_N"]
    over = late_by_one(warm) - 23.0
    expected = 1.0 - 0.015 * over - 0.015 * 0.05 * over**2
    assert found == pytest.approx(config.drive.stage[0].pretension_N * expected, rel=1e-9)


def test_the_same_expansion_told_from_another_reference() -> None:
    law = {"coefficient_per_K": 0.02, "bend_per_K": -0.03, "reference_degC": 22.0}
    effect = catalogue()["thermal_pretension"]
    assert effect.at_reference is not None
    told = effect.at_reference(law, 27.0)
    for warm in (18.0, 22.0, 29.0):
        before, after = warm - 22.0, warm - 27.0
        whole = 1.0 + 0.02 * before * (1.0 - 0.03 * before)
        same = 1.0 + told.values["coefficient_per_K"] * after * (1.0 + told.values["bend_per_K"] * after)
        assert told.pretension * same == pytest.approx(whole, rel=1e-12)
