"""The joints that several folders of tests use, as the stage of their drive."""

from __future__ import annotations

from typing import Any

SMALL: dict[str, Any] = {
    "output_radius_m": 0.03, "input_radius_m": 0.015, "free_length_m": 0.08, "EA_N": 20000.0, "pretension_N": 60.0,
    "mu_output": 0.12, "mu_input": 0.14, "wrap_output_rad": 9.0, "wrap_input_rad": 12.0,
}  # fmt: skip
"""What diagnoses begin from: wraps that never slip through, two ratios of friction."""
SMALL_TRUE = {**SMALL, "EA_N": 20500.0, "pretension_N": 57.5, "mu_output": 0.135, "mu_input": 0.125}
"""The same joint as it is, within the tolerances below."""
SMALL_TOLERANCE = {"EA_N": 0.04, "pretension_N": 0.06, "mu_output": 0.25, "mu_input": 0.25}
SMALL_NOISE = {"joint_position_rad": 1e-5, "joint_torque_Nm": 3e-3, "motor_position_rad": 2e-5}
"""1-sigma of white noise on its channels."""

WIDE: dict[str, Any] = {
    "output_radius_m": 0.04, "input_radius_m": 0.015, "free_length_m": 0.08, "EA_N": 25000.0, "pretension_N": 60.0,
    "mu_output": 0.12, "mu_input": 0.18, "wrap_output_rad": 10.0, "wrap_input_rad": 12.0,
}  # fmt: skip
"""What the observer's laws are tested on: no two values of its pulleys alike."""

EQUAL: dict[str, Any] = {
    "output_radius_m": 0.06, "input_radius_m": 0.06, "free_length_m": 0.01, "EA_N": 16000.0, "pretension_N": 33.0,
    "mu_output": 0.1, "mu_input": 0.1, "wrap_output_rad": 6.0, "wrap_input_rad": 6.0,
}  # fmt: skip
"""What replays run: equal pulleys close to each other."""

WRIST_GAINS = {
    "load_filter_Hz": 18.6, "load_lead_s": 0.0, "follow_filter_Hz": 18.6, "follow_lead_s": 0.0171,
    "joint_feedback_per_s": 0.0, "force_feedback_per_s": 16.0, "motor_integral_per_s": 65.0,
}  # fmt: skip
"""What `cablecomp design` gives for `configs/joints/wrist-capstan.toml`; stated, so that no test need design anew."""


def closed(stage: dict[str, Any], name: str = "test joint") -> dict[str, Any]:
    """A configuration, ours and the plant's, of one closed stage."""
    return {"schema": 1, "name": name, "drive": {"circuit": "closed", "stage": [stage]}}


LONG = {
    "output_radius_m": 0.0365, "input_radius_m": 0.062, "free_length_m": 0.14, "EA_N": 16000.0, "pretension_N": 25.0,
    "mu_output": 0.13, "mu_input": 0.15, "wrap_output_rad": 14.0, "wrap_input_rad": 11.0,
}  # fmt: skip
"""A drive of low pretension and much wrap: loads reach far into the drums, and what they left there lasts."""
