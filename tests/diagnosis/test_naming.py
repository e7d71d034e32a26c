"""Every effect of the catalogue is named when the simulated plant has it: a short recording through the whole
diagnosis."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, Case, recording

from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Value
from cablecomp.effects import catalogue

EVENT_S = 11.0
COARSE_S = 0.08
"""Half as many samples as elsewhere are enough to name an effect."""

CASES = {
    "bearing_friction": Case({"torque_Nm": 0.03, "load_coefficient": 0.0, "presliding_rad": 2e-4}),
    "clamp_slip": Case({"slip_m": 2e-4, "time_s": EVENT_S - 4.0, "duration_s": 6.0}, form=":gradual"),
    "clock_skew": Case({"delay_s": 0.02}),
    "crosstalk": Case({"load_coefficient": 0.1}, ("other_1",)),
    "gravity_load": Case({"moment_Nm": 0.15, "phase_rad": 0.4}),
    "inertial_load": Case({"inertia_kgm2": 0.05}),
    "motor_friction": Case({"torque_Nm": 0.03, "presliding_rad": 0.01}, ("motor_torque_Nm",)),
    "nonlinear_cable": Case({"stiffening": 0.6}),
    "position_dependent_friction": Case({"amplitude": 0.6, "phase_rad": 0.5}, form=":input_drum"),
    "pressure_dependent_friction": Case({"exponent": 0.6}, loads=1.7),
    "pretension_relaxation": Case({"fraction": 0.05, "time_constant_s": 2.0}),
    "pulley_runout": Case({"eccentricity_m": 3e-4, "phase_rad": 0.7}),
    "routing_friction": Case({"mu_angle": 0.3, "arc_length_m": 0.01, "skew": 0.7}, form=":unlike_paths"),
    "series_compliance": Case({"compliance_rad_per_Nm": 5e-3, "skew": 0.9}, form=":one_way"),
    "strand_break": Case({"fraction": 0.15, "time_s": EVENT_S}),
    "strand_friction": Case({"fraction": 0.5, "yield_N": 8.0}),
    "termination_backlash": Case({"gap_rad": 1e-3, "drag_Nm": 0.15}, form=":dragging_link"),
    "thermal_pretension": Case(
        {"coefficient_per_K": 0.03, "reference_degC": 20.0, "lag_s": 2.0},
        ("temperature_degC",),
        form=":lagged",
    ),
    "viscous_slip": Case({"coefficient_Ns_per_m_rad": 2e5}),
}


def test_every_effect_of_the_catalogue_has_its_case() -> None:
    built_in = {
        name for name, effect in catalogue().items() if effect.change.__module__.startswith("cablecomp.")
    }
    assert set(CASES) == built_in


@pytest.mark.parametrize("effect", CASES)
def test_an_effect_that_the_plant_has_is_named(effect: str) -> None:
    case = CASES[effect]._replace(step_s=COARSE_S)
    found = diagnose(TOLERANT, {"small/1": recording(effect, case)})
    assert [named.effect for named in found.named] == [effect]
    lasts = found.named[0].parameters.get("duration_s")
    # the last step lies between two of the recording's samples, and no closer
    assert not isinstance(lasts, Value) or lasts.sd >= case.step_s / 12.0**0.5
    for value in found.named[0].parameters.values():
        if isinstance(value, Value) and value.sd > 0.0:  # the number of steps is chosen, not fitted
            assert value.interval_95 is not None
            low, high = value.interval_95
            assert low <= value.value <= high
            assert low < high


def test_a_payload_that_is_picked_up_and_put_down_is_told_by_its_cycle() -> None:
    """Within four of its standard deviations, which are no wider than that; the written joint says on which clock."""
    cycle = {"start_s": 2.0, "period_s": 5.0, "held": 0.6, "lift_s": 0.3}
    law = {"moment_Nm": 0.15, "phase_rad": 0.4, "share": 0.2, **cycle}
    found = diagnose(TOLERANT, {"small/1": recording("gravity_load", Case(law, form=":picked_up"))})
    assert [named.effect for named in found.named] == ["gravity_load"]
    told = found.named[0].parameters
    true = {
        "moment_Nm": (0.15, 0.015),
        "phase_rad": (0.4, 0.1),
        "always": (0.2, 0.1),
        "period_s": (5.0, 0.1),
        "held": (0.6, 0.05),
    }
    for name, (expected, widest) in true.items():
        value = told[name]
        assert isinstance(value, Value)
        assert value.value == pytest.approx(expected, abs=4.0 * value.sd + 1e-3), name
        assert value.sd < widest, name
    begun = told["picked_up_s"]
    assert isinstance(begun, Value)
    assert (begun.value - 2.0 + 2.5) % 5.0 - 2.5 == pytest.approx(0.0, abs=0.2)
    period = told["period_s"]
    assert isinstance(period, Value)
    said = f"every {period.value:.4g} s from {begun.value:.4g} s on by these recordings' clock"
    assert any(said in note for note in found.notes)


def test_a_payload_that_is_picked_up_once_is_told_by_when() -> None:
    """From 15 s of 40 on; how long it stays is not told, and the page says so."""
    law = {"moment_Nm": 0.15, "phase_rad": 0.4, "share": 0.2, "start_s": 15.0, "period_s": 200.0, "held": 0.5}
    found = diagnose(
        TOLERANT, {"small/1": recording("gravity_load", Case(law, seconds=40.0, form=":picked_up"))}
    )
    assert [named.effect for named in found.named] == ["gravity_load"]
    begun, moment = (found.named[0].parameters[k] for k in ("picked_up_s", "moment_Nm"))
    assert isinstance(begun, Value)
    assert isinstance(moment, Value)
    assert begun.value == pytest.approx(15.0, abs=0.3)
    assert moment.value == pytest.approx(0.15, abs=0.02)
    assert any("seen once" in note for note in found.notes)


def test_a_weight_turns_with_the_joint_that_carries_the_base_where_that_is_an_angle() -> None:
    law = {"moment_Nm": 0.15, "phase_rad": 0.4, "tilt_rad_per_unit": 0.7}
    columns = recording("gravity_load", Case(law, ("other_1",), form=":tilting_base"))
    rolled = {"other_roll_rad" if k == "other_1" else k: v for k, v in columns.items()}
    (weight,) = diagnose(TOLERANT, {"small/1": rolled}).named
    tilt = weight.parameters["tilt_rad_per_unit"]
    assert (weight.effect, weight.parameters["channel"]) == ("gravity_load", "other_roll_rad")
    assert isinstance(tilt, Value)
    assert tilt.value == pytest.approx(0.7, abs=0.1)


def test_a_torque_that_comes_late_is_a_clock_and_no_coupling_that_yields() -> None:
    """The torque sensor's filter lags by 60 ms; the encoders are on time."""
    columns = recording("clock_skew", Case({"delay_s": 0.0}, seconds=30.0))
    columns["joint_torque_Nm"] = np.interp(
        columns["time_s"] - 0.06, columns["time_s"], columns["joint_torque_Nm"]
    )
    found = diagnose(TOLERANT, {"small/1": columns})
    assert [named.effect for named in found.named] == ["clock_skew"]
    delay, of_load = (found.named[0].parameters[k] for k in ("delay_s", "load_delay_s"))
    assert isinstance(delay, Value)
    assert isinstance(of_load, Value)
    assert abs(of_load.value - 0.06) < 0.012
    assert abs(delay.value) < 0.004
