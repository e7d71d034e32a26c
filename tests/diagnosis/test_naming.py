"""Every effect of the catalogue is named when the simulated plant has it: a short recording through the whole
diagnosis."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed
from small_drive import STEP_S, TOLERANT, course

from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Value
from cablecomp.effects import catalogue
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

EVENT_S = 11.0


class Case(NamedTuple):
    """An effect's values in the plant, and what its recording needs beyond the common one; `form`: the law that the
    plant has it with, where that is not the usual one."""

    values: dict[str, float]
    channels: tuple[str, ...] = ()
    seconds: float = 20.0
    loads: float = 1.0
    form: str = ""
    plant: str = ""  # what the plant calls it, if not the effect's name and form


CASES = {
    "bearing_friction": Case({"torque_Nm": 0.03, "load_coefficient": 0.0, "presliding_rad": 2e-4}),
    "clamp_slip": Case(
        {"slip_m": 2e-4, "time_s": EVENT_S - 4.0, "duration_s": 6.0, "steps": 4.0}, form=":in_steps"
    ),
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


def recording(effect: str, case: Case) -> dict[str, FloatArray]:
    """25 Hz of the plant with the effect: both pulleys turning, load of two frequencies, noise on all channels."""
    rng = np.random.default_rng(3)
    time, motor, load = course(case.seconds, case.loads)
    given: dict[str, Any] = {
        "temperature_degC": 20.0 + 4.0 * np.sin(0.9 * time),
        "other_1": np.sin(1.3 * time),
    }
    specs = [EffectSpec(case.plant or effect + case.form, case.values)]
    found = simulate(
        PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=specs, **given
    ).channels()
    noise = {**SMALL_NOISE, "motor_torque_Nm": 1e-3, "temperature_degC": 0.02, "other_1": 1e-3}
    columns = {"time_s": time}
    for name in (*SMALL_NOISE, *case.channels):
        columns[name] = found[name] + noise[name] * rng.standard_normal(len(time))
    return columns


def test_every_effect_of_the_catalogue_has_its_case() -> None:
    built_in = {
        name for name, effect in catalogue().items() if effect.change.__module__.startswith("cablecomp.")
    }
    assert set(CASES) == built_in


@pytest.mark.parametrize("effect", CASES)
def test_an_effect_that_the_plant_has_is_named(effect: str) -> None:
    found = diagnose(TOLERANT, {"small/1": recording(effect, CASES[effect])})
    assert [named.effect for named in found.named] == [effect]
    lasts = found.named[0].parameters.get("duration_s")
    # the last step lies between two of the recording's samples, and no closer
    assert not isinstance(lasts, Value) or lasts.sd >= STEP_S / 12.0**0.5
    for value in found.named[0].parameters.values():
        if isinstance(value, Value) and value.sd > 0.0:  # the number of steps is chosen, not fitted
            assert value.interval_95 is not None
            low, high = value.interval_95
            assert low <= value.value <= high
            assert low < high


@pytest.mark.parametrize(
    ("effect", "case", "told"),
    [
        (
            "series_compliance",
            Case({"compliance_rad_per_Nm": 8e-3, "knee_Nm": 0.15}, form=":stiffening"),
            ("stiffening_per_Nm", 0.3, 7.0),
        ),
        (
            "series_compliance",
            Case({"compliance_rad_per_Nm": 4e-3, "share": 0.6, "lag_s": 0.4}, form=":rubber"),
            ("late_rad_per_Nm", 2.3e-3, 2.5e-3),
        ),
        (
            "termination_backlash",
            Case({"gap_rad": 2e-3, "share": 0.4, "preload_Nm": 0.15}, form=":two_clearances"),
            ("preload_Nm", 0.145, 0.155),
        ),
        (
            "termination_backlash",
            Case({"gap_rad": 2e-3, "holds_Nm": 0.2}, form=":wedged"),
            ("wedges_Nm", 0.17, 0.23),
        ),
        (
            "inertial_load",
            Case({"inertia_kgm2": 0.2, "swing": 0.5, "phase_rad": 1.5708}, form=":folding_arm"),
            ("by_sine", 0.45, 0.55),
        ),
        (
            "strand_friction",
            Case({"fraction": 2.0, "yield_N": 30.0}, form=":graded"),
            ("grading", 3.0, 6.0),
        ),
        (
            "series_compliance",
            Case({"compliance_rad_per_Nm": 6e-3, "share": 0.7, "lag_s": 0.05}, form=":bushing"),
            ("decades", 0.8, 3.0),
        ),
        (
            "pressure_dependent_friction",
            Case({"place": 0.1, "floor": 0.3}, loads=1.7, form=":worn_through"),
            ("lost", 0.6, 0.8),
        ),
        (
            "position_dependent_friction",
            Case({"height": 3.0, "place_rad": 0.3, "width_rad": 0.3}, form=":patch"),
            ("place_rad", 0.2, 0.4),
        ),
        (
            "strand_break",
            Case(
                {"fraction": 0.2, "time_s": 9.0, "duration_s": 6.0, "steps": 3.0, "growth": 1.5},
                form=":unequal_steps",
            ),
            ("fraction", 0.16, 0.24),
        ),
        (
            "nonlinear_cable",
            Case({"softness": 0.9, "reach": 0.7}, loads=1.7, form=":saturating"),
            ("steady", 0.5, 0.9),
        ),
        (
            "nonlinear_cable",
            Case({"dip": 0.6, "place": 0.9, "width": 0.3}, loads=1.7, form=":s_shaped"),
            ("again", 1.2, 2.0),
        ),
        (
            "crosstalk",
            Case({"load_coefficient": 0.1, "bend_per_unit": 0.6}, ("other_1",), form=":quadratic"),
            ("bend_per_unit", 0.5, 0.7),
        ),
        (
            "crosstalk",
            Case({"torque_Nm": 0.1, "reach_units": 0.3}, ("other_1",), form=":rubbing"),
            ("rubs", 0.8, 1.0),
        ),
        (
            "crosstalk",
            Case({"load_coefficient": 0.1, "friction_units": 0.3}, ("other_1",), form=":dragged"),
            ("play_units", 0.2, 0.4),
        ),
        (
            "crosstalk",
            Case({"compliance_rad_per_unit": -2e-4}, ("other_1",), plant="frame_flex"),
            ("turn_rad_per_unit", -2.1e-4, -1.9e-4),
        ),
        (
            "viscous_slip",
            Case({"coefficient_Ns_per_m_rad": 4e5, "on_input": 1.0}, form=":one_drum"),
            ("drum", -1.0, -0.7),
        ),
        (
            "routing_friction",
            Case({"mu_angle": 0.4, "arc_length_m": 0.02, "count": 3.0, "first": 0.1}, form=":several_guides"),
            ("spread", 0.6, 1.0),
        ),
        (
            "bearing_friction",
            Case({"torque_Nm": 0.01, "moment_coefficient": 0.08, "presliding_rad": 2e-4}, form=":by_moment"),
            ("growth_per_Nm", 6.0, 10.0),
        ),
        (
            "series_compliance",
            Case({"compliance_rad_per_Nm": 3e-3, "swing": 0.7, "phase_rad": 0.5}, form=":anisotropic"),
            ("swing", 0.6, 0.8),
        ),
        (
            "termination_backlash",
            Case({"gap_rad": 3e-3, "share": 0.8, "place_rad": 0.2, "width_rad": 0.3}, form=":worn"),
            ("swing", 0.4, 1.0),
        ),
        (
            "thermal_pretension",
            Case(
                {"coefficient_per_K": 0.03, "reference_degC": 20.0, "stick_K": 1.5},
                ("temperature_degC",),
                form=":sticking",
            ),
            ("stick_K", 1.3, 1.7),
        ),
    ],
    ids=[
        "stiffens",
        "rubber",
        "two gaps",
        "wedges",
        "folds",
        "graded",
        "creeps",
        "pressed through",
        "patch",
        "unequal steps",
        "saturates",
        "an S",
        "more one way",
        "rubs",
        "drags along",
        "turns the joint",
        "grease on one drum",
        "guides in a row",
        "tilts its bearing",
        "softer across",
        "worn",
        "sticks",
    ],
)
def test_what_goes_by_another_law_is_named_for_what_it_is(
    effect: str, case: Case, told: tuple[str, float, float]
) -> None:
    """The coupling of rubber has 0.6 of 4e-3 late; gaps open at 0 and 0.15 N m; arsinh(M/0.15) has no slope by a power,
    and so only the order of its knee; half as soft as it gets, the S is from 0.65 to 1.15 T0."""
    found = diagnose(TOLERANT, {"small/1": recording(effect, case)})
    assert [named.effect for named in found.named] == [effect]
    name, low, high = told
    shape = found.named[0].parameters[name]
    assert isinstance(shape, Value)
    assert low < shape.value < high


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


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_link_that_slips_on_its_shaft_is_a_slip_that_leaves_the_pretension(way: float) -> None:
    columns = recording("clamp_slip", Case({"slip_m": 0.0, "time_s": EVENT_S}))
    columns["joint_position_rad"] = columns["joint_position_rad"] + way * 2e-3 * (
        columns["time_s"] >= EVENT_S
    )
    found = diagnose(TOLERANT, {"small/1": columns})
    assert [named.effect for named in found.named] == ["clamp_slip"]
    taken_up, instant = (found.named[0].parameters[k] for k in ("taken_up", "time_s"))
    assert isinstance(taken_up, Value)
    assert isinstance(instant, Value)
    assert taken_up.value > 0.8
    assert abs(instant.value - EVENT_S) < 0.2
    # between two rows nothing tells the instant
    assert instant.sd >= STEP_S / 12.0**0.5
