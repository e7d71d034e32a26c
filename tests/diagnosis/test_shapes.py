"""Each effect by laws of other forms than its plainest: a short recording of the plant, in which that effect alone is
asked for, and the shape that the search comes to.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_drive import TOLERANT, Case, calibrated, recording

from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.search import search
from cablecomp.diagnosis.pace import Pace
from cablecomp.signal.smoothing import FloatArray


def alone(effect: str, columns: dict[str, FloatArray]) -> dict[str, Any]:
    """The effect's parameters that the search comes to where no other effect is asked for."""
    _, drive = calibrated(columns)
    pool = [h for h in hypotheses(TOLERANT, drive.fit.problem.evidence) if h.effect.id == effect]
    found = search(drive, pool, np.random.default_rng(0), Pace(lambda what, share: None)).final
    (term,) = found.terms
    assert term.name.split(":")[0] == effect
    problem = found.fit.problem
    (entry,) = problem.joint(found.fit.x, problem.evidence[0]).effect
    return entry.parameters


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
            "clamp_slip",
            Case({"slip_m": 2e-4, "time_s": 7.0, "duration_s": 6.0, "steps": 4.0}, form=":in_steps"),
            ("second_after_s", 1.9, 2.1),
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
        "slips in steps",
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
def test_what_goes_by_another_law_is_told_in_its_shape(
    effect: str, case: Case, told: tuple[str, float, float]
) -> None:
    """The coupling of rubber has 0.6 of 4e-3 late; gaps open at 0 and 0.15 N m; arsinh(M/0.15) has no slope by a power,
    and so only the order of its knee; half as soft as it gets, the S is from 0.65 to 1.15 T0; six seconds in four steps
    are two from one to the next."""
    name, low, high = told
    assert low < alone(effect, recording(effect, case))[name] < high


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_link_that_slips_on_its_shaft_is_a_slip_that_leaves_the_pretension(way: float) -> None:
    columns = recording("clamp_slip", Case({"slip_m": 0.0, "time_s": 11.0}))
    columns["joint_position_rad"] = columns["joint_position_rad"] + way * 2e-3 * (columns["time_s"] >= 11.0)
    slip = alone("clamp_slip", columns)
    assert slip["taken_up"] > 0.8
    assert abs(slip["time_s"] - 11.0) < 0.2
