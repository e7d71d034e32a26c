"""The compensator on a drive whose deflection is known in closed form: exact feed-forward, no steps,
feedback that settles.
"""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest
from spring_drive import CONFIGS, GAINS, JOINT, K, N, Spring, T, controller, sample

from cablecomp.config import JointConfig, Limits, load_joint
from cablecomp.control.command import FULL, Feed, Reference
from cablecomp.control.compensator import Compensator, gains_of, given_gains
from cablecomp.control.options import CompensatorOptions, ControlMode, FeedForward, MotorModel
from cablecomp.control.shaping import BumplessTransfer, LeadFilter, Slope
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signals import NAN, Estimate, Sample


def test_a_steady_load_is_made_up_for_exactly() -> None:
    c = controller()
    for k in range(400):
        command = c.step(sample(k, load=1.5), Reference(0.3))
    assert command.motor_position_rad == pytest.approx((0.3 - 1.5 / K) / N, abs=1e-12)
    assert command.motor_torque_Nm == pytest.approx(-N * 1.5, abs=1e-9)


def test_without_a_torque_sensor_the_load_is_the_one_that_the_observer_found() -> None:
    """An observer that reads the load off the motor's torque, tau = -N M."""

    class MotorSide(Spring):
        def step(self, sample: Sample) -> Estimate:
            return self._at(sample, -sample.motor_torque_Nm / N)

    chosen = CompensatorOptions.model_validate({"blend_s": 0.05})
    c = Compensator(JOINT, chosen, T, MotorSide(), gains=GAINS, motor=MotorModel(coulomb_Nm=0.0))
    for k in range(400):
        command = c.step(sample(k, load=1.5)._replace(joint_torque_Nm=nan), Reference(0.3))
    assert command.motor_position_rad == pytest.approx((0.3 - 1.5 / K) / N, abs=1e-12)
    assert command.motor_torque_Nm == pytest.approx(-N * 1.5, abs=1e-9)


def test_with_the_motor_there_the_joint_stands_where_it_is_wanted() -> None:
    c = controller()
    for k in range(400):
        command = c.step(sample(k, load=-0.8), Reference(0.2))
    assert N * command.motor_position_rad + (-0.8) / K == pytest.approx(0.2, abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "expected"), [("none", 0.0), ("linear", 1.0 / 150.0), ("observer", 1.0 / K)]
)
def test_what_is_made_up_for_depends_on_the_kind(kind: str, expected: float) -> None:
    c = controller(feed_forward=kind, linear_stiffness_Nm_per_rad=150.0)
    for k in range(400):
        command = c.step(sample(k, load=1.0), Reference(0.0))
    assert command.deflection_ahead_rad == pytest.approx(expected, abs=1e-9)


def test_enabling_and_disabling_costs_no_step() -> None:
    c = controller()
    targets = []
    for k in range(600):
        if k == 200:
            c.disable()
        if k == 400:
            c.enable()
        targets.append(c.step(sample(k, load=1.5), Reference(0.1)).motor_position_rad)
    steps = np.abs(np.diff(targets))[150:]
    whole = 1.5 / K / N
    assert steps.max() < 1.6 * whole * T / 0.05  # 1.5 / blend time is the steepest of the blend
    assert targets[-1] == pytest.approx((0.1 - 1.5 / K) / N, abs=1e-9)
    assert targets[390] == pytest.approx(0.1 / N, abs=1e-9)


def test_control_begins_where_the_motor_stands() -> None:
    c = controller()
    first = c.step(sample(0, motor=0.7), Reference(-0.4))
    assert first.motor_position_rad == pytest.approx(0.7)


def test_held_feed_forward_stays_and_a_weight_scales_it() -> None:
    c = controller()
    for k in range(300):
        c.step(sample(k, load=1.0), Reference(0.0))
    held = c.step(sample(300, load=-2.0), Reference(0.0), Feed(1.0, True))
    assert held.deflection_ahead_rad == pytest.approx(1.0 / K, rel=1e-6)
    faded = c.step(sample(301, load=-2.0), Reference(0.0), Feed(0.25, True))
    assert faded.deflection_ahead_rad == pytest.approx(0.25 / K, rel=1e-6)


def test_feedback_on_the_joint_encoder_takes_off_what_the_model_misses() -> None:
    """An encoder error of 1 mrad that no model knows of is integrated away with the gain as the rate."""
    c = controller(joint_feedback_per_s=20.0)
    motor = 0.0
    errors = []
    for k in range(1000):
        joint = N * motor + 1e-3
        errors.append(0.1 - joint)
        motor = c.step(sample(k, motor, 0.0, joint), Reference(0.1)).motor_position_rad
    assert abs(errors[-1]) < 1e-8
    assert errors[300] / errors[200] == pytest.approx(np.exp(-20.0 * 0.1), rel=0.05)


def test_an_encoder_that_is_not_to_be_trusted_moves_nothing() -> None:
    c = controller(joint_feedback_per_s=20.0)
    for k in range(100):
        c.step(sample(k, 0.0, 0.0, 0.5), Reference(0.0), FULL, joint_ok=False)
        c.step(sample(k, 0.0, 0.0, nan), Reference(0.0))
    assert c.joint_trim_rad == 0.0


def test_force_mode_makes_the_torque_that_is_wanted_against_a_held_output() -> None:
    c = controller(mode="force")
    motor = 0.0
    for k in range(3000):
        motor = c.step(sample(k, motor, nan, 0.2), Reference(joint_torque_Nm=-0.9)).motor_position_rad
    assert K * (0.2 - N * motor) == pytest.approx(-0.9, abs=1e-5)


@pytest.mark.parametrize(
    ("joint", "given", "limit"),
    [
        (JOINT, {}, 2.0),  # joint_torque_max_Nm of the joint
        (JOINT, {"force_feedback_limit_Nm": 0.75}, 0.75),
        (JOINT.model_copy(update={"limits": Limits()}), {}, JOINT.drive.stage[-1].pretension_moment_Nm),
    ],
)
def test_force_mode_without_contact_does_not_wind_up(
    joint: JointConfig, given: dict[str, float], limit: float
) -> None:
    """Nothing is touched for 10 s; then twice what is wanted: the trim is gone at 5 per s of the 0.5 Nm too much."""
    options = CompensatorOptions.model_validate({"mode": "force", "torque_from": "sensor", **given})
    c = Compensator(joint, options, T, Spring(), gains=GAINS, motor=MotorModel())
    for k in range(10_000):
        c.step(sample(k, 0.0, 0.0, 0.0), Reference(joint_torque_Nm=0.5))
        assert c.force_trim_Nm == pytest.approx(min(5.0 * 0.5 * (k + 1) * T, limit))
    assert c.force_trim_Nm == limit
    back = round(limit / (5.0 * 0.5) / T)
    for k in range(back):
        c.step(sample(10_000 + k, 0.0, 1.0, 0.0), Reference(joint_torque_Nm=0.5))
    assert c.force_trim_Nm == pytest.approx(0.0, abs=5.0 * 0.5 * T)


def test_torque_feedback_rests_while_nothing_of_it_reaches_the_motor() -> None:
    c = controller(mode="force", torque_from="sensor")
    c.step(sample(0, 0.0, 0.0, 0.0), Reference(joint_torque_Nm=0.5))
    found = c.force_trim_Nm
    for k in range(1, 100):
        c.step(sample(k, 0.0, 0.0, 0.0), Reference(joint_torque_Nm=0.5), Feed(1.0, held=True))
    c.disable()
    for k in range(100, 200):
        c.step(sample(k, 0.0, 0.0, 0.0), Reference(joint_torque_Nm=0.5))
    assert c.force_trim_Nm == found


def test_impedance_wants_a_load_in_proportion_to_the_position_error() -> None:
    c = controller(mode="impedance", impedance_stiffness_Nm_per_rad=5.0, impedance_damping_Nms_per_rad=0.0)
    motor = 0.1 / N
    for k in range(3000):
        motor = c.step(sample(k, motor, nan, 0.1), Reference(0.3)).motor_position_rad
    assert K * (0.1 - N * motor) == pytest.approx(-5.0 * (0.3 - 0.1), abs=1e-5)


def test_on_the_observer_peek_and_step_agree() -> None:
    """The deflection foreseen for a load is the one found when that load comes."""
    observer = Observer(JOINT)
    loads = 1.2 * np.sin(np.linspace(0.0, 7.0, 200))
    for k, load in enumerate(loads[:-1]):
        observer.step(sample(k, 0.01 * k, float(load)))
        foreseen = observer.peek_deflection((k + 1) * T, 0.01 * (k + 1), float(loads[k + 1]))
        before = observer.snapshot()
        found = observer.copy().step(sample(k + 1, 0.01 * (k + 1), float(loads[k + 1])))
        assert found.deflection_rad == foreseen
        assert observer.snapshot() == before


def test_a_ramp_is_foreseen_over_the_lead() -> None:
    lead = 0.012
    ahead = LeadFilter(30.0, lead, T)
    out = [ahead.step(3.0 * k * T) for k in range(2000)]
    assert out[-1] - 3.0 * 1999 * T == pytest.approx(3.0 * (lead - 2.0 * ahead.stage_lag_s), abs=1e-9)
    assert ahead.rate == pytest.approx(3.0, rel=1e-9)
    assert ahead.stage_lag_s == pytest.approx(1.0 / (2.0 * np.pi * 30.0), abs=0.6 * T)


def test_bump_and_slope() -> None:
    bump = BumplessTransfer(0.1, T)
    bump.start(2.0)
    values = [bump.step() for _ in range(120)]
    assert values[0] == 2.0
    assert values[50] == pytest.approx(1.0)
    assert values[100:] == [0.0] * 20
    slope = Slope(100.0, T)
    for k in range(100):
        rate = slope.step(5.0 * k * T)
    assert rate == pytest.approx(5.0, rel=1e-6)


def test_a_joint_that_stands_far_off_is_led_to_its_reference_slowly() -> None:
    """3 rad of the motor at a tenth of its 30 rad/s: in a second, where the blend alone would take 50 ms."""
    c = controller()
    targets, motor = [], 3.0
    for k in range(1200):
        motor = c.step(sample(k, motor), Reference(0.0)).motor_position_rad
        targets.append(motor)
    rates = np.abs(np.diff(targets)) / T
    assert rates.max() == pytest.approx(1.5 * 3.0, rel=1e-2)
    assert abs(targets[990]) > 1e-6 > abs(targets[1010])


def test_gains_are_the_options_own_where_stated() -> None:
    assert gains_of(CompensatorOptions(load_filter_Hz=7.0), GAINS) == GAINS._replace(load_filter_Hz=7.0)
    assert given_gains(CompensatorOptions()) is None
    assert given_gains(CompensatorOptions.model_validate(GAINS._asdict())) == GAINS


def test_nonsense_is_refused() -> None:
    with pytest.raises(InputError, match="period_s"):
        Compensator(JOINT, CompensatorOptions(), 0.0, Spring())
    with pytest.raises(ValueError, match="linear_stiffness_Nm_per_rad"):
        CompensatorOptions(mode=ControlMode.POSITION, feed_forward=FeedForward.LINEAR)


def test_an_open_circuit_is_held_against_its_pretension_and_a_closed_one_against_nothing() -> None:
    """r T0 of the input pulley: the plant's own balance at rest is the check in the system's tests."""
    one_sided, balanced = (load_joint(CONFIGS / f"snow-{kind}-rig.toml") for kind in ("open", "closed"))
    stage = one_sided.drive.stage[0]
    assert one_sided.drive.preload_Nm == stage.input_radius_m * stage.pretension_N
    assert balanced.drive.preload_Nm == 0.0


class StepByStep:
    """An observer that can be asked for one thing at a time."""

    def __init__(self, observer: Observer) -> None:
        self.step, self.peek_deflection = observer.step, observer.peek_deflection
        self.step_inverse = observer.step_inverse

    def step_ahead(
        self, sample: Sample, time_s: float, motor_position_rad: float, joint_torque_Nm: float
    ) -> tuple[Estimate, float]:
        return self.step(sample), NAN


@pytest.mark.parametrize("load", ["sensor", "reference", "both"])
def test_what_is_asked_of_the_observer_at_once_is_what_is_asked_one_by_one(load: str) -> None:
    """Bit for bit; a sample that is refused leaves no trace in either."""
    one, other = Observer(JOINT), Observer(JOINT)
    chosen = CompensatorOptions.model_validate({"load": load})
    pair = [Compensator(JOINT, chosen, T, o, gains=GAINS) for o in (one, StepByStep(other))]
    rng = np.random.default_rng(5)
    for k in range(300):
        now = sample(k, 0.02 * np.sin(0.02 * k), float(np.sin(0.07 * k)), 0.01)
        if k % 50 == 30:
            for c in pair:
                with pytest.raises(InputError):
                    c.step(now._replace(joint_torque_Nm=1e4), Reference())
        feed = Feed(0.5, True) if k % 70 > 60 else FULL
        wanted = Reference(0.1 * rng.standard_normal(), 0.0, 0.5)
        found, expected = (c.step(now, wanted, feed) for c in pair)
        assert np.array_equal(found, expected, equal_nan=True)
    assert one.snapshot() == other.snapshot()


@pytest.mark.parametrize(
    "wrong", [Reference(nan), Reference(0.0, nan), Reference(inf), Reference(0.0, 0.0, 0.0, nan)]
)
@pytest.mark.parametrize("mode", ["position", "impedance"])
def test_a_reference_that_is_no_motion_is_refused_and_leaves_no_trace(wrong: Reference, mode: str) -> None:
    asked, spared = controller(mode=mode, torque_from="sensor"), controller(mode=mode, torque_from="sensor")
    for k in range(3):
        found = [c.step(sample(k, 0.0, 0.1, 0.0), Reference(0.1)) for c in (asked, spared)]
        assert np.array_equal(*found, equal_nan=True)
        with pytest.raises(InputError, match=r"^reference: finite"):
            asked.step(sample(k, 0.0, 0.1, 0.0), wrong)


@pytest.mark.parametrize("period_s", [0.0, nan, inf])
def test_a_period_is_a_time(period_s: float) -> None:
    with pytest.raises(InputError, match="period_s is"):
        Compensator(JOINT, CompensatorOptions(), period_s, Spring())


@pytest.mark.parametrize("options", [{}, {"mode": "force"}])
def test_an_encoder_that_grew_old_is_not_taken_for_a_load(options: dict[str, object]) -> None:
    """The motor turns on while the joint's last reading is held."""
    sees = JOINT.observer.model_copy(update={"load": "both_encoders"})
    config = JOINT.model_copy(update={"observer": sees})
    chosen, observer = CompensatorOptions.model_validate(options), Observer(config)
    c = Compensator(config, chosen, T, observer)
    c.step(sample(0, 0.0, nan, 0.0), Reference())
    load = c.step(sample(1, 0.0, nan, 0.0), Reference()).joint_torque_Nm
    before = observer.snapshot()
    for k in range(2, 20):
        command = c.step(sample(k, 1e-3 * k, nan, 0.0), Reference(), Feed(1.0, held=True))
        assert command.joint_torque_Nm == load
    assert observer.snapshot() == before
    assert not c.observed
    c.step(sample(20, 0.02, nan, 0.02 * N), Reference())
    assert c.observed
