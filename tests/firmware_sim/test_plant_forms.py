"""Further forms of the plant's laws: each is there, can be switched off, and shows without breaking the solution."""

from __future__ import annotations

import numpy as np
import pytest
from plant_effect_course import LOAD, MOTOR, OTHER, WARM, T, play
from plant_joints import joint

from firmware_sim.plant import FORMS, LISTED, EffectSpec, Plant, PlantError, PlantRun, simulate

SIZES = {
    "routing_friction:several_guides": {"mu_angle": 0.2, "arc_length_m": 0.01, "count": 3, "first": 0.25},
    "routing_friction:unlike_paths": {"mu_angle": 0.2, "arc_length_m": 0.01, "skew": 0.6, "first": 0.2},
    "routing_friction:greased": {"mu_angle": 0.1, "arc_length_m": 0.01, "viscous_Ns_per_m": 100.0},
    "routing_friction:bending": {"mu_angle": 0.1, "arc_length_m": 0.01, "mu_angle_per_unit": 0.1},
    "routing_friction:wiper": {"hold_N": 8.0, "mu_angle": 0.05, "arc_length_m": 0.01},
    "viscous_slip:power_law": {"coefficient_Ns_per_m_rad": 2e4, "exponent": 0.5, "speed_m_s": 1e-4},
    "viscous_slip:strengthening": {"gain": 0.2, "speed_m_s": 1e-5},
    "viscous_slip:one_drum": {"coefficient_Ns_per_m_rad": 2e4},
    "viscous_slip:eyring": {"coefficient_Ns_per_m_rad": 2e5, "speed_m_s": 1e-5},
    "pretension_relaxation:power_law": {"fraction": 0.05, "scale_s": 1.0},
    "pretension_relaxation:exponential": {"fraction": 0.05, "time_constant_s": 2.0},
    "pretension_relaxation:warm_creep": {"fraction": 0.05, "time_constant_s": 0.5},
    "pretension_relaxation:in_two": {"fraction": 0.05, "time_constant_s": 0.5, "lasts_s": 5.0},
    "pretension_relaxation:by_travel": {"fraction": 0.05, "travel_rad": 2.0},
    "pretension_relaxation:under_load": {"fraction": 0.05, "time_constant_s": 2.0},
    "pretension_relaxation:stretched": {"fraction": 0.05, "time_constant_s": 2.0},
    "thermal_pretension:lagged": {"coefficient_per_K": 0.02, "lag_s": 1.0},
    "thermal_pretension:quadratic": {"coefficient_per_K": 0.02, "bend_per_K": 0.1},
    "thermal_pretension:transient": {"coefficient_per_K": 0.02, "quick_s": 0.1, "slow_s": 2.0},
    "thermal_pretension:from_contact": {"coefficient_per_K": 0.02, "contact_degC": 21.0},
    "thermal_pretension:sticking": {"coefficient_per_K": 0.02, "stick_K": 1.5},
    "bearing_friction:dahl": {"torque_Nm": 0.1, "presliding_rad": 1e-4},
    "bearing_friction:lugre": {"torque_Nm": 0.1, "presliding_rad": 1e-4, "viscous_Nms_per_rad": 0.02},
    "bearing_friction:unlike_ways": {"torque_Nm": 0.1, "presliding_rad": 1e-4},
    "bearing_friction:by_moment": {"torque_Nm": 0.05, "presliding_rad": 1e-4, "moment_coefficient": 0.1},
    "series_compliance:stiffening": {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.5},
    "series_compliance:softening": {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.4},
    "series_compliance:staged": {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.2},
    "series_compliance:diaphragm": {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.2},
    "series_compliance:one_way": {"compliance_rad_per_Nm": 1e-3},
    "series_compliance:rubber": {"compliance_rad_per_Nm": 1e-3},
    "series_compliance:bushing": {"compliance_rad_per_Nm": 1e-3},
    "series_compliance:anisotropic": {"compliance_rad_per_Nm": 1e-3},
    "termination_backlash:sprung": {"gap_rad": 1e-3, "closes_Nm": 0.3},
    "termination_backlash:wedged": {"gap_rad": 1e-3, "holds_Nm": 0.1},
    "termination_backlash:worn": {"gap_rad": 1e-3, "share": 0.7, "place_rad": 0.1, "width_rad": 0.5},
    "termination_backlash:loosening": {"gap_rad": 1e-3, "time_s": 1.0, "duration_s": 2.0},
    "termination_backlash:greased": {"gap_rad": 1e-3, "damping_Nms_per_rad": 100.0},
    "termination_backlash:dragging_link": {"gap_rad": 1e-3, "drag_Nm": 0.1},
    "termination_backlash:two_clearances": {"gap_rad": 1e-3, "preload_Nm": 0.3},
    "termination_backlash:both_ways": {"gap_rad": 1e-3, "up_Nm": 0.3, "down_Nm": 0.2},
    "nonlinear_cable:saturating": {"softness": 0.6},
    "nonlinear_cable:power_law": {"exponent": 0.3},
    "nonlinear_cable:knee": {"rise": 0.5},
    "nonlinear_cable:s_shaped": {"dip": 0.5},
    "strand_friction:masing": {"fraction": 0.3, "yield_N": 10.0},
    "strand_friction:graded": {"fraction": 0.3, "yield_N": 10.0},
    "strand_friction:rate_dependent": {"fraction": 0.3, "yield_N": 5.0},
    "strand_friction:proportional": {"fraction": 0.3},
    "strand_friction:mixed_lay": {"fraction": 0.3, "yield_N": 5.0},
    "strand_friction:seating": {"fraction": 0.3, "yield_N": 5.0, "seats_N": 8.0},
    "strand_friction:bouc_wen": {"fraction": 0.3, "yield_N": 10.0},
    "pressure_dependent_friction:floor": {"floor": 0.4},
    "pressure_dependent_friction:exponential": {"rate": 0.6},
    "pressure_dependent_friction:worn_through": {"floor": 0.5},
    "pressure_dependent_friction:pressed_flat": {"rate": 2.0},
    "pressure_dependent_friction:ploughed": {"adhesion": 0.8},
    "position_dependent_friction:patch": {"height": 1.0},
    "position_dependent_friction:input_drum": {"amplitude": 0.5},
    "position_dependent_friction:threaded": {"amplitude": 0.5},
    "position_dependent_friction:burr": {"height": 1.0},
    "position_dependent_friction:polished": {"height": 1.0},
    "position_dependent_friction:fleet_angle": {"growth_per_rad": 1.0},
    "pulley_runout:oval": {"eccentricity_m": 5e-5, "phase_rad": 1.0},
    "pulley_runout:input_pulley": {"eccentricity_m": 5e-5, "phase_rad": 1.0},
    "pulley_runout:encoder_disc": {"amplitude_rad": 1e-3},
    "pulley_runout:idler": {"eccentricity_m": 5e-5, "phase_rad": 1.0},
    "clock_skew:drift": {"delay_s": 0.02, "span_s": 4.0},
    "clock_skew:jitter": {"delay_s": 0.02},
    "clock_skew:torque_late": {"delay_s": 0.02},
    "clock_skew:motor_late": {"delay_s": 0.02},
    "clock_skew:stale": {"delay_s": 0.02},
    "clock_skew:resynchronised": {"delay_s": 0.02, "period_s": 1.5},
    "inertial_load:flexible_link": {
        "inertia_kgm2": 0.02,
        "stiffness_Nm_per_rad": 20.0,
        "damping_Nms_per_rad": 0.2,
    },
    "inertial_load:folding_arm": {"inertia_kgm2": 0.05},
    "inertial_load:half_filled": {"inertia_kgm2": 0.05},
    "inertial_load:two_modes": {"inertia_kgm2": 0.05},
    "inertial_load:dragged_along": {"inertia_kgm2": 0.05},
    "inertial_load:turning_base": {"inertia_kgm2": 0.05},
    "gravity_load:sprung": {"moment_Nm": 0.3, "phase_rad": 0.2},
    "gravity_load:linkage": {"moment_Nm": 0.3, "phase_rad": 0.2},
    "gravity_load:tilting_base": {"moment_Nm": 0.3, "phase_rad": 0.2, "tilt_rad_per_unit": 0.4},
    "gravity_load:leaning_base": {"moment_Nm": 0.3, "phase_rad": 0.2, "lean_rad_per_unit": 0.4},
    "gravity_load:picked_up": {"moment_Nm": 0.3, "phase_rad": 0.2, "period_s": 1.5},
    "gravity_load:sorted": {"moment_Nm": 0.3, "phase_rad": 0.2, "period_s": 1.5},
    "clamp_slip:gradual": {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 2.0},
    "clamp_slip:in_steps": {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 2.0, "cable_l": 1.0},
    "clamp_slip:unequal_steps": {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 2.0, "growth": 2.0},
    "clamp_slip:worked_loose": {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 2.0},
    "clamp_slip:settling": {"slip_m": 2e-4, "time_s": 1.0, "lag_s": 0.5},
    "clamp_slip:other_cable": {"slip_m": 2e-4, "time_s": 1.0},
    "clamp_slip:overload": {"rate_m_per_Ns": 1e-5, "holds_N": 60.0},
    "clamp_slip:ratcheting": {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 2.0, "holds_Nm": 0.5},
    "strand_break:in_steps": {"fraction": 0.3, "time_s": 1.0, "duration_s": 2.0},
    "strand_break:unequal_steps": {"fraction": 0.3, "time_s": 1.0, "duration_s": 2.0, "wait": 2.0},
    "strand_break:fatigued": {"fraction": 0.3, "time_s": 1.0, "duration_s": 2.0},
    "strand_break:fraying": {"fraction": 0.3, "time_s": 1.0, "duration_s": 2.0, "cable_l": 1.0},
    "strand_break:accelerating": {"fraction": 0.3, "time_s": 1.0, "duration_s": 2.0},
    "strand_break:settling": {"fraction": 0.3, "time_s": 1.0, "lag_s": 0.5},
    "strand_break:other_cable": {"fraction": 0.3, "time_s": 1.0},
    "strand_break:bent_over_drums": {"fraction": 0.3, "time_s": 1.0, "travel_rad": 2.0},
    "crosstalk:lagged": {"load_coefficient": 0.3},
    "crosstalk:let_go": {"load_coefficient": 0.3},
    "crosstalk:quadratic": {"load_coefficient": 0.3, "bend_per_unit": 0.5},
    "crosstalk:touching": {"load_coefficient": 0.3, "slack_units": 0.2},
    "crosstalk:posed": {"load_coefficient": 0.3},
    "crosstalk:dragged": {"load_coefficient": 0.3, "friction_units": 0.3},
    "crosstalk:stopped": {"load_coefficient": 0.3, "stop_units": 0.4},
    "crosstalk:rubbing": {"torque_Nm": 0.3},
    "motor_friction:lugre": {"torque_Nm": 0.02, "viscous_Nms_per_rad": 0.01},
    "motor_friction:gear": {"torque_Nm": 0.02, "share": 0.1},
    "motor_friction:uneven": {"torque_Nm": 0.02, "order": 2.0},
}


def test_every_effect_of_the_catalogue_has_two_further_forms_at_least() -> None:
    assert set(SIZES) == set(FORMS)
    for effect in LISTED:
        forms = [kind for kind in FORMS.values() if kind.effect == effect]
        assert len(forms) >= 2, effect
        assert all(kind.nearest == (effect,) and kind.form and not kind.listed for kind in forms)


@pytest.mark.parametrize("name", sorted(SIZES))
def test_a_form_shows_without_breaking_the_solution_and_can_be_switched_off(
    name: str, plain: PlantRun
) -> None:
    run = play(name, **SIZES[name])
    assert run.failures == 0
    change = np.concatenate(
        [
            run.deflection_rad - plain.deflection_rad,
            run.joint_torque_Nm - LOAD,
            run.motor_position_rad - MOTOR,
        ]
    )
    if name.startswith("motor_friction"):  # beside the path: the joint does not feel it
        assert np.max(np.abs(change)) < 1e-12
        change = run.motor_torque_Nm - plain.motor_torque_Nm
    assert np.all(np.isfinite(change))
    assert np.max(np.abs(change)) > 1e-3 * np.ptp(plain.deflection_rad)
    neutral = {p.name: p.neutral for p in FORMS[name].parameters if p.neutral is not None}
    assert neutral, "says which values switch it off"
    if name == "routing_friction:bending":
        neutral["mu_angle_per_unit"] = 0.0
    off = play(name, **{**SIZES[name], **neutral, **_vanishing(name)})
    # a guide of vanishing length changes the mesh, a table the law's arithmetic
    limit = 3e-4 if name.startswith(("routing", "nonlinear")) else 1e-9
    assert np.max(np.abs(off.deflection_rad - plain.deflection_rad)) < limit * np.ptp(plain.deflection_rad)
    assert np.max(np.abs(off.joint_torque_Nm - plain.joint_torque_Nm)) < 1e-9
    if name.startswith("motor_friction"):
        assert np.max(np.abs(off.motor_torque_Nm - plain.motor_torque_Nm)) < 1e-12


def _vanishing(name: str) -> dict[str, float]:
    return {"arc_length_m": 1e-6} if name.startswith("routing") else {}


def test_a_form_is_the_effect_and_cannot_act_twice() -> None:
    twice = (
        EffectSpec("series_compliance", {"compliance_rad_per_Nm": 1e-3}),
        EffectSpec("series_compliance:one_way", {"compliance_rad_per_Nm": 1e-3}),
    )
    with pytest.raises(PlantError, match="`series_compliance` is given twice"):
        simulate(joint(), T, MOTOR, LOAD, effects=twice)


def test_what_acts_between_joint_and_file_is_for_the_bench() -> None:
    late = EffectSpec("clock_skew:torque_late", {"delay_s": 0.01})
    with pytest.raises(PlantError, match="on the bench only"):
        Plant(joint(), effects=(late,))


def test_a_history_is_played_and_cut_off() -> None:
    """What lies before the recording leaves its bumps in the cable; laws that count from the first sample count from
    the recording's."""
    relaxing = EffectSpec("pretension_relaxation", {"fraction": 0.05, "time_constant_s": 0.5})
    whole = simulate(joint(), T, MOTOR, LOAD, temperature_degC=WARM, other_1=OTHER)
    part = simulate(joint(), T, MOTOR, LOAD, temperature_degC=WARM, other_1=OTHER, history=150)
    np.testing.assert_array_equal(part.joint_position_rad, whole.joint_position_rad[150:])
    np.testing.assert_array_equal(part.time_s, T[150:])
    still = 0.0 * T
    run = simulate(joint(), T, still, still, effects=(relaxing,), history=150)
    expected = joint().stages[0].pretension_N * (1 - 0.05 * np.log1p((T[150:] - T[150]) / 0.5))
    np.testing.assert_allclose(run.tension_h_N, expected, rtol=1e-6)
    with pytest.raises(PlantError, match="history is 400"):
        simulate(joint(), T, MOTOR, LOAD, history=len(T))
