"""Each effect of the plant: off at its neutral value, and true to its law where the law can be read off a
channel."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from plant_effect_course import LOAD, play

from firmware_sim.plant import EFFECTS, LISTED, UNLISTED, PlantRun

CATALOGUE = {
    "routing_friction",
    "viscous_slip",
    "pretension_relaxation",
    "thermal_pretension",
    "bearing_friction",
    "series_compliance",
    "termination_backlash",
    "nonlinear_cable",
    "strand_friction",
    "pressure_dependent_friction",
    "position_dependent_friction",
    "pulley_runout",
    "clock_skew",
    "inertial_load",
    "gravity_load",
    "clamp_slip",
    "strand_break",
    "crosstalk",
    "motor_friction",
}

# Values that switch an effect off, and values that switch it on; both for the joint and motion below.
NEUTRAL: dict[str, Mapping[str, float]] = {
    "routing_friction": {"mu_angle": 0.0, "arc_length_m": 1e-6},
    "viscous_slip": {"coefficient_Ns_per_m_rad": 0.0},
    "pretension_relaxation": {"fraction": 0.0},
    "thermal_pretension": {"coefficient_per_K": 0.0},
    "bearing_friction": {"torque_Nm": 0.0},
    "series_compliance": {"compliance_rad_per_Nm": 0.0},
    "termination_backlash": {"gap_rad": 0.0},
    "nonlinear_cable": {"stiffening": 0.0},
    "strand_friction": {"fraction": 0.0, "yield_N": 5.0},
    "pressure_dependent_friction": {"exponent": 0.0},
    "position_dependent_friction": {"amplitude": 0.0},
    "pulley_runout": {"eccentricity_m": 0.0},
    "clock_skew": {"delay_s": 0.0},
    "inertial_load": {"inertia_kgm2": 0.0},
    "gravity_load": {"moment_Nm": 0.0},
    "clamp_slip": {"slip_m": 0.0, "time_s": 1.0},
    "strand_break": {"fraction": 0.0, "time_s": 1.0},
    "crosstalk": {"load_coefficient": 0.0},
    "friction_ageing": {"gain": 0.0},
    "friction_temperature": {"coefficient_per_K": 0.0},
    "input_pulley_runout": {"eccentricity_m": 0.0},
    "groove_climb": {"radius_m_per_rad": 0.0},
    "joint_viscous_friction": {"coefficient_Nms_per_rad": 0.0},
    "parallel_spring": {"stiffness_Nm_per_rad": 0.0, "saturation_Nm": 1.0},
    "tip_link": {"inertia_kgm2": 0.0, "stiffness_Nm_per_rad": 1e9},
    "creeping_mount": {"compliance_rad_per_Nm": 0.0},
    "stiffening_mount": {"compliance_rad_per_Nm": 0.0, "saturation_Nm": 1.0},
    "frame_flex": {"compliance_rad_per_unit": 0.0},
    "joint_encoder_ripple": {"amplitude_rad": 0.0},
    "motor_encoder_ripple": {"amplitude_rad": 0.0},
    "torque_sensor_quadratic": {"coefficient_per_Nm": 0.0},
    "torque_sensor_hysteresis": {"fraction": 0.0, "width_Nm": 0.1},
    "torque_sensor_drift": {"coefficient_Nm_per_K": 0.0},
    "motor_torque_cogging": {"amplitude_Nm": 0.0},
    "motor_friction": {"torque_Nm": 0.0},
    "flange_climb": {"radius_m_per_rad": 0.0},
    "input_play": {"gap_rad": 0.0},
    "self_heating": {"fraction": 0.0},
    "neighbour_tightens": {"coefficient_per_unit": 0.0},
    "encoder_hub_slip": {"slip_rad": 0.0, "time_s": 1.0},
    "torque_sensor_lag": {"lag_s": 0.0},
    "joint_encoder_drift": {"coefficient_rad_per_K": 0.0},
}
SIZES = {
    "routing_friction": {"mu_angle": 0.2, "arc_length_m": 0.01},
    "viscous_slip": {"coefficient_Ns_per_m_rad": 2e4},
    "nonlinear_cable": {"stiffening": 0.3},
    "strand_friction": {"fraction": 0.3, "yield_N": 5.0},
    "pressure_dependent_friction": {"exponent": 0.3},
    "position_dependent_friction": {"amplitude": 0.4},
    "pulley_runout": {"eccentricity_m": 5e-5, "phase_rad": 1.0},
    "input_pulley_runout": {"eccentricity_m": 5e-5},
    "groove_climb": {"radius_m_per_rad": 1e-4},
    "bearing_friction": {"torque_Nm": 0.1, "load_coefficient": 0.01, "presliding_rad": 1e-4},
    "gravity_load": {"moment_Nm": 0.3, "phase_rad": 0.2},
    "clamp_slip": {"slip_m": 2e-4, "time_s": 1.0},
    "strand_break": {"fraction": 0.3, "time_s": 1.0},
    "tip_link": {"inertia_kgm2": 0.005, "stiffness_Nm_per_rad": 900.0, "damping_Nms_per_rad": 1.0},
    "clock_skew": {"delay_s": 0.02},
    "parallel_spring": {"stiffness_Nm_per_rad": 0.6, "saturation_Nm": 0.2},
    "termination_backlash": {"gap_rad": 1e-3},
    "pretension_relaxation": {"fraction": 0.05, "time_constant_s": 0.5},
    "stiffening_mount": {"compliance_rad_per_Nm": 1e-3, "saturation_Nm": 0.5},
    "torque_sensor_hysteresis": {"fraction": 0.3, "width_Nm": 0.2},
    "flange_climb": {"radius_m_per_rad": 1e-3, "from_rad": 0.2},
    "input_play": {"gap_rad": 1e-3, "drag_Nm": 0.1},
    "self_heating": {"fraction": 0.05, "lag_s": 2.0},
    "neighbour_tightens": {"coefficient_per_unit": 0.05},
    "encoder_hub_slip": {"slip_rad": 1e-3, "time_s": 1.0},
    "torque_sensor_lag": {"lag_s": 0.05},
    "joint_encoder_drift": {"coefficient_rad_per_K": 1e-4},
}


def test_the_whole_catalogue_is_there_and_at_least_eight_effects_that_are_not_in_it() -> None:
    assert set(LISTED) == CATALOGUE
    assert len(UNLISTED) >= 8
    assert set(NEUTRAL) == set(EFFECTS)


@pytest.mark.parametrize("name", sorted(NEUTRAL))
def test_neutral_values_switch_it_off(name: str, plain: PlantRun) -> None:
    run = play(name, **NEUTRAL[name])
    scale = np.ptp(plain.deflection_rad)
    # the guide of vanishing length changes the mesh, and the rigid tip link one equation
    limit = 3e-4 if name in ("routing_friction", "tip_link") else 1e-9
    assert np.max(np.abs(run.deflection_rad - plain.deflection_rad)) < limit * scale
    assert np.max(np.abs(run.motor_torque_Nm - plain.motor_torque_Nm)) < max(limit, 1e-6) * 2.0
    assert np.max(np.abs(run.joint_torque_Nm - plain.joint_torque_Nm)) < 1e-9


@pytest.mark.parametrize("name", sorted(SIZES))
def test_it_shows_without_breaking_the_solution(name: str, plain: PlantRun) -> None:
    run = play(name, **SIZES[name])
    assert run.failures == 0
    change = np.concatenate([run.deflection_rad - plain.deflection_rad, run.joint_torque_Nm - LOAD])
    assert np.all(np.isfinite(change))
    assert np.max(np.abs(change)) > 1e-3 * np.ptp(plain.deflection_rad)
