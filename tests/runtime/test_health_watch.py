"""What is plausible passes, what is not is held and named, and what disagrees is found out."""

from __future__ import annotations

from math import inf, nan

import pytest

from cablecomp.control.options import HealthOptions
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import JOINT_POSITION, JOINT_TORQUE, MOTOR_POSITION, MOTOR_TORQUE
from cablecomp.runtime.channel import Channel, Latency, Shaking, Sustained
from cablecomp.runtime.health import (
    ENCODERS_DISAGREE,
    FATAL,
    JOINT_JUMP,
    JOINT_RESIDUAL,
    JOINT_STUCK,
    MOTOR_LAGS,
    MOTOR_STALE,
    MOTOR_STUCK,
    SHAKES,
    TORQUE_MISMATCH,
    TORQUE_STALE,
    UNANSWERED,
    Checked,
    Health,
    health_names,
)

T = 1e-3
N = 1.0 / 3.0
OPTIONS = HealthOptions(
    motor_rate_rad_s=40.0,
    joint_rate_rad_s=20.0,
    torque_rate_Nm_s=1000.0,
    torque_max_Nm=4.0,
    joint_residual_rad=0.02,
    torque_mismatch_Nm=0.5,
    lead_rad=0.2,
    stuck_rad=0.005,
    shake_Nm=0.3,
)


class Wire:
    """Readings fed by hand, one cycle at a time."""

    def __init__(self, period_s: float = T, **needs: bool) -> None:
        self.readings = JointReadings("joint", ())
        self.health = Health(OPTIONS, N, 2.5 * period_s, period_s, **needs)
        self.period_s = period_s
        self.k = 0

    def cycle(
        self,
        motor: float | None = 0.0,
        torque: float | None = 0.0,
        joint: float | None = 0.0,
        motor_torque: float = nan,
        predicted: float = nan,
        target: float = nan,
    ) -> Checked:
        """One period: what is None does not come."""
        self.k += 1
        now, r = self.k * self.period_s, self.readings
        for place, value in ((MOTOR_POSITION, motor), (JOINT_TORQUE, torque), (JOINT_POSITION, joint)):
            if value is not None:
                r.values[place] = value
                r.arrived_s[place] = now
                r.updates[place] += 1
        r.values[MOTOR_TORQUE] = motor_torque
        return self.health.check(r, now, predicted, target)


def test_not_ready_before_every_needed_channel_has_come() -> None:
    wire = Wire()
    assert not wire.cycle(None, None, None).ready
    assert not wire.cycle(0.1, None, 0.0).ready
    assert wire.cycle(0.1, 0.2, None).ready
    assert not Wire(needs_joint=True).cycle(0.1, 0.2, None).ready
    assert Wire(needs_torque=False).cycle(0.1, None, None).ready


def test_ages_count_from_the_last_plausible_value() -> None:
    wire = Wire()
    wire.cycle(0.1, 0.2, 0.0)
    for _ in range(10):
        checked = wire.cycle(0.1, None, None)
    assert checked.motor_age_s == 0.0
    assert checked.load_age_s == pytest.approx(10 * T)
    assert checked.flags & TORQUE_STALE
    assert not checked.flags & MOTOR_STALE
    assert checked.sample.joint_torque_Nm == 0.2


def test_a_jump_is_held_until_the_value_comes_back() -> None:
    wire = Wire()
    for k in range(20):
        wire.cycle(0.0, 0.0, 1e-3 * k)
    for k in range(5):
        checked = wire.cycle(0.0, 0.0, 0.5 + 0.02 + 1e-3 * k)
        assert checked.flags & JOINT_JUMP
        assert checked.sample.joint_position_rad == pytest.approx(0.019)
    checked = wire.cycle(0.0, 0.0, 0.025)
    assert not checked.flags & JOINT_JUMP
    assert checked.sample.joint_position_rad == 0.025


@pytest.mark.parametrize("bad", [nan, inf, -inf, 5.0])
def test_what_cannot_be_is_turned_down(bad: float) -> None:
    wire = Wire()
    wire.cycle(0.0, 1.0, 0.0)
    checked = wire.cycle(0.0, bad, 0.0)
    assert checked.sample.joint_torque_Nm == 1.0
    assert checked.load_age_s == pytest.approx(T)


def test_motion_after_a_real_gap_is_believed() -> None:
    """0.3 rad within 50 ms of silence is 6 rad/s, less than the motor can do."""
    channel = Channel(40.0, 0.002, 0.0025)
    channel.take(0.0, 0.0)
    assert channel.take(0.3, 0.05)


def test_a_joint_encoder_that_disagrees_is_not_used_after_a_while() -> None:
    wire = Wire()
    first = None
    for k in range(200):
        checked = wire.cycle(1e-3 * k, 0.0, 0.05 + 1e-5 * k, predicted=0.0)
        if first is None and checked.flags & JOINT_RESIDUAL:
            first = k * T
    assert first == pytest.approx(OPTIONS.confirm_s, abs=2 * T)
    assert not checked.joint_ok
    assert not checked.fatal


def test_the_encoder_that_does_not_change_is_the_one_that_is_stuck() -> None:
    stuck_motor, stuck_joint = Wire(), Wire()
    flags = [0, 0]
    for k in range(40):
        flags[0] |= stuck_motor.cycle(0.0, 0.0, 0.01 * k, predicted=0.0).flags
        flags[1] |= stuck_joint.cycle(0.03 * k, 0.0, 0.0, predicted=0.01 * k).flags
    assert flags[0] & MOTOR_STUCK
    assert not flags[0] & JOINT_STUCK
    assert flags[1] & JOINT_STUCK
    assert not flags[1] & MOTOR_STUCK


@pytest.mark.parametrize("period_s", [T, 10.0 * T])
def test_two_wrong_samples_are_not_enough_for_encoders_to_disagree(period_s: float) -> None:
    """Nor are a few that are the same those of a stuck encoder, however slow the loop."""
    wire = Wire(period_s)
    for k in range(40):
        assert not wire.cycle(1e-3 * k, 0.0, 1e-4 * k, predicted=1e-4 * k).fatal
    seen = [wire.cycle(1e-3 * k, 0.0, 4e-3, predicted=0.15).flags for k in range(40, 45)]
    disagree = [flags & (FATAL | JOINT_STUCK) for flags in seen]
    assert disagree[:3] == [0, 0, 0]
    assert disagree[4] == ENCODERS_DISAGREE


def test_a_motor_encoder_that_stands_while_its_target_moves_is_fatal_at_once() -> None:
    wire = Wire()
    for k in range(20):
        wire.cycle(1e-3 * k, 0.0, 0.0, target=1e-3 * k)
    seen = None
    for k in range(10):
        checked = wire.cycle(0.019, 0.0, 0.0, target=0.019 + 1e-3 * (k + 1))
        if checked.fatal and seen is None:
            seen = k + 1
    assert seen is not None
    assert seen <= 7


def test_a_motor_at_rest_is_not_stuck() -> None:
    wire = Wire()
    assert not any(wire.cycle(0.1, 0.0, 0.0, target=0.1001).fatal for _ in range(500))


def test_a_motor_that_does_not_follow_stops_the_joint() -> None:
    wire = Wire()
    found = [wire.cycle(1e-6 * k, 0.0, 0.0, target=0.5) for k in range(150)]
    assert not found[50].flags & MOTOR_LAGS
    assert found[-1].flags & MOTOR_LAGS
    assert found[-1].fatal


def test_an_offset_of_the_torque_sensor_shows_against_the_motor_torque() -> None:
    good, bad = Wire(), Wire()
    for k in range(600):
        load = 0.5 + 1e-3 * k / 10
        a = good.cycle(0.0, load, 0.0, motor_torque=-N * load)
        b = bad.cycle(0.0, load + 0.8, 0.0, motor_torque=-N * load)
    assert not a.flags
    assert b.flags & TORQUE_MISMATCH
    assert b.load_age_s > 0.1


def test_a_link_that_shakes_makes_the_load_old_but_slow_loads_do_not() -> None:
    from math import sin

    shaken, loaded = Wire(), Wire()
    for k in range(400):
        a = shaken.cycle(0.0, 0.8 * sin(2.0 * 3.1416 * 60.0 * k * T), 0.0)
        b = loaded.cycle(0.0, 2.0 * sin(2.0 * 3.1416 * 1.0 * k * T), 0.0)
    assert a.flags & SHAKES
    assert a.load_age_s > 0.1
    assert not b.flags & SHAKES


def test_a_drive_that_does_not_answer_is_named() -> None:
    wire = Wire()
    wire.readings.unanswered = 51
    checked = wire.cycle()
    assert checked.flags & UNANSWERED
    assert health_names(checked.flags) == ("drive does not answer",)


def test_lateness_is_told_from_the_device_s_own_stamps() -> None:
    latency = Latency()
    for k in range(100):
        assert latency.take(5.0 + 0.01 * k + 1e-3, 0.01 * k) == pytest.approx(0.0, abs=1e-5)
    assert latency.take(6.0 + 0.006 + 1e-3, 1.0) == pytest.approx(0.006, abs=1e-4)
    # a device that starts afresh counts from zero again: no lateness
    assert latency.take(6.02, 0.0) == 0.0


def test_a_condition_counts_once_it_has_lasted() -> None:
    held = Sustained(0.1)
    assert not held.step(True, 1.0)
    assert not held.step(True, 1.05)
    assert held.step(True, 1.1)
    held.step(True, 1.3)
    assert held.age_s == pytest.approx(0.2)
    assert not held.step(False, 1.31)
    assert held.age_s == 0.0


def test_shaking_is_the_mean_square_of_what_is_quick() -> None:
    from math import sin

    shaking = Shaking(T)
    for k in range(3000):
        shaking.step(3.0 + sin(2.0 * 3.14159265 * 100.0 * k * T))
    assert shaking.square == pytest.approx(0.5, rel=0.08)


def test_a_motor_that_says_nothing_is_stale_and_not_stuck() -> None:
    wire, flags = Wire(), 0
    for k in range(40):
        wire.cycle(0.002 * k, 0.0, 0.002 * k * N, predicted=0.002 * k * N)
    for k in range(60):
        flags |= wire.cycle(None, 0.0, 0.0266 + 0.005 * k, predicted=0.0266).flags
    assert flags & MOTOR_STALE
    assert flags & ENCODERS_DISAGREE
    assert not flags & MOTOR_STUCK


def test_a_motor_whose_frames_are_lost_while_its_target_moves_is_not_stuck() -> None:
    """It said the same twice, then nothing for some cycles, then where it had gone meanwhile."""
    wire = Wire()
    for k in range(20):
        wire.cycle(1e-3 * k, 0.0, 0.0, target=1e-3 * k)
    wire.cycle(0.019, 0.0, 0.0, target=0.020)
    for k in range(8):
        checked = wire.cycle(None, 0.0, 0.0, target=0.021 + 1e-3 * k)
        assert not checked.fatal
    assert checked.flags & MOTOR_STALE
    assert not wire.cycle(0.028, 0.0, 0.0, target=0.029).fatal
    seen = [wire.cycle(0.028, 0.0, 0.0, target=0.035).flags & MOTOR_STUCK for _ in range(3)]
    assert seen == [0, 0, MOTOR_STUCK]
