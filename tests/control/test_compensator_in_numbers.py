"""What the compensator asks for, number by number, on a drive that is a plain spring: worked out by hand."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest
from spring_drive import CONFIGS, GAINS, JOINT, K, N, Spring, T, controller, sample

from cablecomp.config import load_joint
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator
from cablecomp.control.options import CompensatorOptions, MotorModel
from cablecomp.signals import Sample


@pytest.mark.parametrize(("source", "load"), [("sensor", 1.7), ("reference", 1.5), ("both", 1.7)])
def test_a_load_is_expected_from_where_the_options_say(source: str, load: float) -> None:
    """1.5 Nm are stated, the sensor reads 1.7."""
    c = controller(load=source)
    for k in range(400):
        command = c.step(sample(k, load=1.7), Reference(0.3, joint_torque_Nm=1.5))
    assert command.deflection_ahead_rad == pytest.approx(load / K, rel=1e-9)


def test_a_switch_in_motion_goes_on_at_the_speed_it_had() -> None:
    """One period after the last target at 0.5 rad/s, and not at that target once more."""
    c = controller()
    for k in range(300):
        before = c.step(sample(k, load=1.5), Reference(0.5 * k * T, 0.5)).motor_position_rad
    c.disable()
    after = c.step(sample(300, load=1.5), Reference(0.5 * 300 * T, 0.5)).motor_position_rad
    assert after - before == pytest.approx(0.5 * T / N, rel=1e-6)


@pytest.mark.parametrize("wanted", [0.9, -0.9])
def test_force_mode_stands_where_the_cable_carries_what_is_wanted_before_any_feedback(wanted: float) -> None:
    """q_in = (q_out - M/K)/n, and the motor holds -n M."""
    c = controller(GAINS._replace(force_feedback_per_s=0.0), mode="force", torque_from="sensor")
    for k in range(400):
        command = c.step(sample(k, 0.0, 0.0, 0.2), Reference(joint_torque_Nm=wanted))
    assert command.motor_position_rad == pytest.approx((0.2 - wanted / K) / N, abs=1e-9)
    assert command.motor_torque_Nm == pytest.approx(-N * wanted, abs=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("options", "trim", "limit"),
    [
        ({"joint_feedback_per_s": 5.0, "joint_feedback_limit_rad": 0.02}, "joint_trim_rad", 0.02),
        ({"motor_integral_per_s": 5.0, "motor_integral_limit_rad": 0.03}, "motor_trim_rad", 0.03),
        ({"mode": "force", "force_feedback_limit_Nm": 0.4}, "force_trim_Nm", 0.4),
    ],
)
def test_no_feedback_goes_beyond_its_limit_either_way(
    options: dict[str, object], trim: str, limit: float, sign: float
) -> None:
    """The motor is stuck at zero, and so is the joint: the error stays, however long it is integrated."""
    c = controller(torque_from="sensor", **options)
    for k in range(2000):
        c.step(sample(k, 0.0, 0.0, 0.0), Reference(sign * 0.3, joint_torque_Nm=sign * 0.3))
    assert getattr(c, trim) == sign * limit


def test_feedback_compares_a_reading_with_what_was_wanted_when_it_was_taken() -> None:
    """A reference is of the next instant: a joint that follows a ramp to the letter leaves no error."""
    c = controller(joint_feedback_per_s=20.0)
    for k in range(200):
        c.step(sample(k, 0.0, 0.0, 2.0 * k * T), Reference(2.0 * (k + 1) * T, 2.0))
    assert c.joint_trim_rad == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("mode", ["position", "force"])
def test_the_motor_is_told_the_rate_of_what_it_makes_up_for(mode: str) -> None:
    """dq_in/dt = (dq_out/dt - (dM/dt)/K)/n, under a load that grows by 3 Nm/s while the joint goes at 0.4 rad/s."""
    gains = GAINS._replace(follow_filter_Hz=100.0, force_feedback_per_s=0.0)
    c = controller(gains, mode=mode, torque_from="sensor")
    for k in range(600):
        load, joint = 3.0 * k * T, 0.4 * k * T
        command = c.step(sample(k, 0.0, load, joint), Reference(joint, 0.4, load if mode == "force" else nan))
    assert command.motor_velocity_rad_s == pytest.approx((0.4 - 3.0 / K) / N, rel=1e-6)


@pytest.mark.parametrize(
    "options",
    [{"joint_feedback_per_s": 5.0, "motor_integral_per_s": 5.0}, {"mode": "force", "torque_from": "sensor"}],
)
def test_after_a_reset_it_goes_on_as_a_new_one(options: dict[str, object]) -> None:
    used, new = controller(**options), controller(**options)
    for k in range(300):
        used.step(sample(k, 0.1, 0.01 * k, 0.03), Reference(0.001 * k, 1.0, 0.5))
    used.reset()
    for k in range(300, 400):
        found, expected = (c.step(sample(k, 0.2, -0.7, 0.1), Reference(0.1, 0.0, -0.5)) for c in (used, new))
        assert np.array_equal(found, expected, equal_nan=True)


def test_the_motor_is_helped_against_its_own_inertia_and_friction() -> None:
    """tau = J d2q/dt2 + b dq/dt + c tanh(dq/dt / v_c), at the input pulley, where a joint's rate is 1/n as large."""
    model = MotorModel(inertia_kgm2=3e-4, viscous_Nms_per_rad=2e-3, coulomb_Nm=0.05)
    c = Compensator(JOINT, CompensatorOptions(), T, Spring(), gains=GAINS, motor=model)
    found = c.step(sample(0), Reference(0.0, -0.4, 0.0, 7.0)).motor_torque_Nm
    expected = 3e-4 * 7.0 / N + 2e-3 * -0.4 / N + 0.05 * np.tanh(-0.4 / N / 0.05)
    assert found == pytest.approx(expected, rel=1e-9)


def test_an_open_circuits_pretension_is_held_and_taken_off_what_the_motor_reads() -> None:
    """tau = -n M - r T0; a sensor that reads 0.05 Nm too much is taken off as well."""
    rig = load_joint(CONFIGS / "snow-open-rig.toml")
    stage, n, load = rig.drive.stage[0], rig.drive.ratio, 0.4
    held = -n * load - stage.input_radius_m * stage.pretension_N
    off = rig.sensors.model_copy(update={"motor_torque_offset_Nm": 0.05})
    rig = rig.model_copy(update={"sensors": off})
    chosen = CompensatorOptions.model_validate({"mode": "force", "torque_from": "motor_torque"})
    c = Compensator(rig, chosen, T, Spring(), gains=GAINS._replace(force_feedback_per_s=0.0))
    for k in range(400):
        reading = Sample(k * T, 0.0, nan, 0.0, held + 0.05)
        command = c.step(reading, Reference(joint_torque_Nm=load))
    assert command.joint_torque_Nm == pytest.approx(load, abs=1e-12)
    assert command.motor_torque_Nm == pytest.approx(held, abs=1e-9)


@pytest.mark.parametrize(("moves", "wanted"), [(0.5, 0.0), (0.0, 0.5), (-0.5, 0.25)])
def test_impedance_damps_the_motion_beside_the_one_that_is_wanted(moves: float, wanted: float) -> None:
    """A joint that is moved on at v where w is wanted carries D (v - w): it holds back."""
    c = controller(
        GAINS._replace(follow_filter_Hz=100.0, force_feedback_per_s=0.0),
        mode="impedance",
        torque_from="sensor",
        impedance_stiffness_Nm_per_rad=0.0,
        impedance_damping_Nms_per_rad=2.0,
    )
    for k in range(400):
        command = c.step(sample(k, 0.0, 0.0, moves * k * T), Reference(0.0, wanted))
    assert command.deflection_ahead_rad == pytest.approx(2.0 * (moves - wanted) / K, rel=1e-6)
