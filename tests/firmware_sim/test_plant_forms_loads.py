"""Forms of loads that no sensor sees, against their equations: inertia, weight, a neighbour."""

from __future__ import annotations

import numpy as np
import pytest
from plant_effect_course import LOAD, MOTOR, OTHER, T, carried, play
from plant_joints import joint

from firmware_sim.plant import EffectSpec, PlantRun, simulate
from firmware_sim.plant.forms.courses import held


def test_a_flexible_link_is_an_inertia_when_stiff_and_rings_by_its_own_frequency() -> None:
    rigid = play("inertial_load", inertia_kgm2=0.02)
    stiff = play(
        "inertial_load:flexible_link", inertia_kgm2=0.02, stiffness_Nm_per_rad=1e5, damping_Nms_per_rad=10.0
    )
    added = rigid.load_path_Nm - LOAD
    assert np.max(np.abs(stiff.load_path_Nm - rigid.load_path_Nm)[20:]) < 0.03 * np.max(np.abs(added))
    # a sine at w meets the inertia J/(1 − (w/w0)²) of an undamped swinger with w0² = k/J; the pulley turns at 1.9 rad/s
    motor = 0.8 * np.sin(1.9 * T)
    swing = {"inertia_kgm2": 0.05, "stiffness_Nm_per_rad": 0.05 * 8.0**2, "damping_Nms_per_rad": 0.02}
    run = simulate(
        joint(),
        T,
        motor * (1 - np.exp(-T)),
        0 * T,
        effects=(EffectSpec("inertial_load:flexible_link", swing),),
    )
    q = run.pulley_position_rad
    reaction, acceleration = -run.load_path_Nm, np.gradient(np.gradient(q, T), T)
    late = T > 1.0
    gain = float(reaction[late] @ acceleration[late] / (acceleration[late] @ acceleration[late]))
    assert gain == pytest.approx(0.05 / (1 - (1.9 / 8.0) ** 2), rel=0.06)


def _swinger(w: float, own: float, ratio: float) -> complex:
    """What an inertia on a spring answers by at w, over the rigid one: (1 + 2 i z u)/(1 - u^2 + 2 i z u), u = w/w_s."""
    u = w / own
    return (1 + 2j * ratio * u) / (1 - u**2 + 2j * ratio * u)


@pytest.mark.parametrize(
    ("form", "law", "expected"),
    [
        (
            "half_filled",
            {"share": 0.4, "sways_rad_s": 2.0, "damping_ratio": 0.5},
            0.6 + 0.4 * _swinger(4.0, 2.0, 0.5),
        ),
        (
            "two_modes",
            {"share": 0.3, "swings_rad_s": 3.0, "apart": 4.0, "damping_ratio": 0.4},
            0.7 * _swinger(4.0, 3.0, 0.4) + 0.3 * _swinger(4.0, 12.0, 0.4),
        ),
        ("dragged_along", {"share": 0.7, "lag_s": 0.3}, 0.3 + 0.7 / (1 + 1.2j)),
    ],
)
def test_what_does_not_keep_up_with_the_joint_pulls_by_its_frequency(
    form: str, law: dict[str, float], expected: complex
) -> None:
    motor = 0.8 * np.sin(4.0 * T) * (1 - np.exp(-2.0 * T))
    hidden = EffectSpec(f"inertial_load:{form}", {"inertia_kgm2": 0.05, **law})
    run = simulate(joint(), T, motor, 0 * T, effects=(hidden,))
    q = run.pulley_position_rad
    late = T > 2.5
    waves = np.column_stack((np.cos(4.0 * T), np.sin(4.0 * T), np.ones_like(T)))[late]
    moved, pulled = (np.linalg.lstsq(waves, v[late])[0] for v in (q, -run.load_path_Nm))
    found = complex(pulled[0], -pulled[1]) / (complex(moved[0], -moved[1]) * -16.0)
    assert abs(found - 0.05 * expected) < 0.04 * abs(0.05 * expected)


def test_a_folding_arm_obeys_lagrange(plain: PlantRun) -> None:
    run = play("inertial_load:folding_arm", inertia_kgm2=0.05, swing=0.6, phase_rad=0.3)
    q = run.pulley_position_rad
    speed = np.gradient(q, T)
    momentum = 0.05 * (1 + 0.6 * np.cos(q - 0.3)) * speed
    expected = -(np.gradient(momentum, T) + 0.5 * 0.05 * 0.6 * np.sin(q - 0.3) * speed**2)
    change = run.load_path_Nm - LOAD
    assert np.max(np.abs(change - expected)[20:-5]) < 0.03 * np.max(np.abs(expected))


def test_an_inertia_on_a_turning_base_resists_what_it_turns_in_all() -> None:
    run = play("inertial_load:turning_base", inertia_kgm2=0.03, coupling=0.8)
    turns = np.gradient(np.gradient(run.pulley_position_rad, T), T) - 0.8 * 3.1**2 * OTHER
    change = run.load_path_Nm - LOAD
    assert np.max(np.abs(change + 0.03 * turns)[20:-10]) < 0.02 * np.max(np.abs(0.03 * turns))


def test_loads_that_no_sensor_sees_are_carried_by_the_cables(plain: PlantRun) -> None:
    q = plain.pulley_position_rad
    pose = 0.5 * MOTOR
    smooth, follower = 0.15, [OTHER[0]]
    fine = np.linspace(0, T[-1], 40 * (len(T) - 1) + 1)
    for x in np.interp(fine, T, OTHER)[1:]:
        follower.append(follower[-1] + (x - follower[-1]) * (fine[1] / smooth))
    late = np.asarray(follower)[::40]
    drawn = [OTHER[0]]  # 0.3 behind the reading where that has come 0.3 or more from it
    for x in OTHER[1:]:
        drawn.append(max(x - 0.3, drawn[-1]) if x > drawn[-1] else min(x + 0.3, drawn[-1]))
    lifts, edges = [0.5, 0.7, 1.3, 1.5, 2.1, 2.3, 2.9, 3.1, 3.7, 3.9], [0, 1, 1, 0, 0, 1, 1, 0, 0, 1]
    lifted = np.interp(T, lifts, edges)
    # the second comes 0.4 · 0.618 of a period later, is 0.2071 lighter and held for 1 - 0.2 · 0.4142 as long
    second_s = 0.5 + 2.0 + 0.8 * 0.618034
    longer_s = 0.8 * (1.0 - 0.2 * 0.414214)
    at = [0.5, 0.6, 1.3, 1.4, second_s, second_s + 0.1, second_s + longer_s, second_s + longer_s + 0.1]
    sorted_out = np.interp(T, at, [0, 1, 1, 0, 0, 0.792893, 0.792893, 0])
    cases = {
        "gravity_load:sprung": (
            {"moment_Nm": 0.3, "phase_rad": 0.2, "spring_share": 0.5},
            -0.3 * np.sin(q + 0.2) - 0.15 * q,
        ),
        "gravity_load:linkage": (
            {"moment_Nm": 0.3, "phase_rad": 0.2, "second": 0.5, "second_phase_rad": 1.0},
            -0.3 * (np.sin(q + 0.2) + 0.5 * np.sin(2 * q + 1.0)),
        ),
        "gravity_load:tilting_base": (
            {"moment_Nm": 0.3, "phase_rad": 0.2, "tilt_rad_per_unit": 0.7},
            -0.3 * np.sin(q + 0.2 + 0.7 * OTHER),
        ),
        "gravity_load:leaning_base": (
            {"moment_Nm": 0.3, "phase_rad": 0.2, "lean_rad_per_unit": 0.7, "upright_rad": 0.3},
            -0.3 * np.cos(0.3 + 0.7 * OTHER) * np.sin(q + 0.2),
        ),
        "gravity_load:picked_up": (
            {
                "moment_Nm": 0.3,
                "phase_rad": 0.2,
                "share": 0.25,
                "start_s": 0.5,
                "period_s": 1.6,
                "held": 0.5,
                "lift_s": 0.2,
            },
            -(0.075 + 0.225 * lifted) * np.sin(q + 0.2),
        ),
        "gravity_load:sorted": (
            {
                "moment_Nm": 0.3,
                "phase_rad": 0.2,
                "start_s": 0.5,
                "period_s": 2.0,
                "held": 0.4,
                "uneven": 0.4,
                "unlike": 0.5,
                "lift_s": 0.1,
            },
            -0.3 * sorted_out * np.sin(q + 0.2),
        ),
        "crosstalk:lagged": ({"load_coefficient": 0.3, "lag_s": smooth}, 0.3 * late),
        "crosstalk:let_go": (
            {"load_coefficient": 0.3, "lag_s": smooth, "share": 0.7},
            0.3 * (OTHER - 0.7 * late),
        ),
        "crosstalk:quadratic": (
            {"load_coefficient": 0.3, "bend_per_unit": -0.5},
            0.3 * OTHER * (1 - 0.5 * OTHER),
        ),
        "crosstalk:touching": (
            {"load_coefficient": 0.3, "slack_units": 0.4},
            0.3 * np.sign(OTHER) * np.maximum(np.abs(OTHER) - 0.4, 0.0),
        ),
        "crosstalk:dragged": (
            {"load_coefficient": 0.3, "friction_units": 0.3},
            0.3 * np.asarray(drawn),
        ),
        "crosstalk:rubbing": (
            {"torque_Nm": 0.2, "reach_units": 0.3},
            0.2 / 0.3 * (OTHER - np.asarray(drawn)),
        ),
        "crosstalk:stopped": ({"load_coefficient": 0.3, "stop_units": 0.4}, 0.12 * np.tanh(OTHER / 0.4)),
        "crosstalk:posed": ({"load_coefficient": 0.3, "phase_rad": 0.4}, 0.3 * OTHER * np.cos(pose + 0.4)),
    }
    for name, (parameters, expected) in cases.items():
        run = play(name, **parameters)
        change = run.load_path_Nm - LOAD
        assert np.max(np.abs(change - expected)[2:]) < 0.01 * np.max(np.abs(expected)), name
        np.testing.assert_allclose(carried(run), run.load_path_Nm, atol=2e-5)


@pytest.mark.parametrize("share", [0.5, 0.9, 1.0])
def test_a_payload_is_lifted_and_set_down_no_faster_than_that_takes(share: float) -> None:
    """Even where it is taken up again before it is down."""
    time = np.linspace(-1.0, 4.0, 5001)
    there = held(time, 0.3, 1.0, share, 0.4)
    assert np.max(np.abs(np.diff(there))) <= 1e-3 / 0.4 + 1e-12
    assert np.max(there) == pytest.approx(1.0)
    assert np.min(there) == pytest.approx(max(1.0 - (1.0 - share) / 0.4, 0.0), abs=0.01)
