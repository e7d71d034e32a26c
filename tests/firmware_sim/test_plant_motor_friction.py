"""Friction of the motor's shaft, of every form, against laws worked out apart: it shows in the motor's torque alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plant_joints import clock, course, joint

from firmware_sim.plant import EffectSpec, LinkSpec, MotorSpec, Plant, PlantRun, simulate

BACK_AND_FORTH = course(0.0, 1.0, -1.0, 0.0, points=200)
SLIDING = (slice(40, 200), slice(280, 600), slice(680, 798))  # away from the start and from reversals


def _run(law: str, motor: np.ndarray, dt: float = 0.01, **parameters: float) -> PlantRun:
    spec = EffectSpec(law, parameters)
    return simulate(joint(), clock(motor, dt), motor, _load(motor), effects=(spec,))


def _load(motor: np.ndarray) -> np.ndarray:
    return np.asarray(0.3 + 0.8 * motor)


def _added(law: str, motor: np.ndarray, dt: float = 0.01, **parameters: float) -> np.ndarray:
    """Motor torque beside that of the drive alone; the joint does not feel it."""
    run = _run(law, motor, dt, **parameters)
    alone = simulate(joint(), clock(motor, dt), motor, _load(motor))
    np.testing.assert_array_equal(run.joint_position_rad, alone.joint_position_rad)
    return np.asarray(run.motor_torque_Nm - alone.motor_torque_Nm)


def test_it_builds_up_over_its_presliding_and_turns_over_twice_that() -> None:
    there, back = np.linspace(0.0, 1.0, 101), np.linspace(1.0, 0.0, 101)[1:]
    added = _added("motor_friction", np.concatenate([there, back]), torque_Nm=0.05, presliding_rad=0.08)
    np.testing.assert_allclose(added[:101], 0.05 * np.minimum(there / 0.08, 1.0), atol=1e-12)
    np.testing.assert_allclose(added[101:], 0.05 * np.maximum(1.0 - (1.0 - back) / 0.08, -1.0), atol=1e-12)


@pytest.mark.parametrize("speed", [0.02, 0.3, 3.0])
def test_lugre_gives_exponentially_and_slides_at_stribecks_curve_with_a_viscous_part(speed: float) -> None:
    law = {
        "torque_Nm": 0.05,
        "presliding_rad": 0.05,
        "stribeck_gain": 0.5,
        "stribeck_rad_s": 0.3,
        "viscous_Nms_per_rad": 0.01,
    }
    motor = np.linspace(0.0, 1.0, 401)
    added = _added("motor_friction:lugre", motor, 1.0 / 400 / speed, **law)
    limit = 0.05 * (1.0 + 0.5 * math.exp(-((speed / 0.3) ** 2)))
    slope = 0.05 / 0.05  # of the bristles, N·m/rad: they let go where that has grown to the limit
    expected = limit * (1.0 - np.exp(-slope * motor / limit)) + 0.01 * speed
    np.testing.assert_allclose(added[1:], expected[1:], rtol=1e-6)


def test_a_gear_rubs_by_the_torque_that_it_passes_on() -> None:
    motor = BACK_AND_FORTH
    added = _added("motor_friction:gear", motor, torque_Nm=0.01, share=0.2, presliding_rad=1e-3)
    passed = np.abs(simulate(joint(), clock(motor, 0.01), motor, _load(motor)).motor_torque_Nm)
    turning = np.sign(np.gradient(motor))
    assert np.ptp(passed) > 0.2
    for part in SLIDING:
        np.testing.assert_allclose(added[part], (turning * (0.01 + 0.2 * passed))[part], atol=1e-12)


def test_a_bent_shaft_rubs_harder_in_places() -> None:
    law = {"torque_Nm": 0.02, "unevenness": 0.6, "order": 3.0, "phase_rad": 0.7, "presliding_rad": 1e-3}
    added = _added("motor_friction:uneven", BACK_AND_FORTH, **law)
    expected = 0.02 * (1.0 + 0.6 * np.cos(3.0 * BACK_AND_FORTH - 0.7)) * np.sign(np.gradient(BACK_AND_FORTH))
    for part in SLIDING:
        np.testing.assert_allclose(added[part], expected[part], atol=1e-12)


def test_on_a_plant_that_runs_live_it_is_the_motors_own_friction() -> None:
    """Under less torque than it holds the motor turns within the presliding alone; one whose own friction it is moves
    alike."""
    link = LinkSpec(0.01)
    law = EffectSpec("motor_friction", {"torque_Nm": 0.1, "presliding_rad": 1e-4})
    bare = MotorSpec(2e-3, 4.0, presliding_rad=1e-5)
    as_effect = Plant(joint(), bare, link, effects=(law,))
    as_motor = Plant(joint(), MotorSpec(2e-3, 4.0, coulomb_Nm=0.1, presliding_rad=1e-4), link)
    for torque in np.linspace(0.0, 0.09, 1000):
        turned = [p.step(1e-3, float(torque)).truth.motor_position_rad for p in (as_effect, as_motor)]
        assert turned[0] == turned[1]
    assert turned[0] == pytest.approx(0.9e-4, rel=0.05)
