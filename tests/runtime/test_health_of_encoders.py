"""Two encoders that disagree, a motor that lags or stands: what the health watch says, in numbers by hand."""

from __future__ import annotations

from math import nan

import pytest
from fed_health import ALL, Fed, N, T, options

from cablecomp.runtime import health as h


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_joint_encoder_is_distrusted_once_it_has_been_off_for_so_long(sign: float) -> None:
    """More than 1/64 rad for eight periods; as much as that is allowed."""
    fed, near = (
        Fed(options(joint_residual_rad=1 / 64), needs_joint=True),
        Fed(options(joint_residual_rad=1 / 64)),
    )
    for k in range(20):
        assert near.cycle(predicted=sign / (63 if k == 0 else 64), **ALL).flags == 0
        checked = fed.cycle(predicted=sign / 63, **ALL)
        assert checked.flags == (h.JOINT_RESIDUAL if k >= 8 else 0)
        assert checked.joint_ok == (k < 8)
        assert checked.load_age_s == max(k - 8, 0) * T
    assert fed.cycle(predicted=0.0, **ALL).flags == 0


@pytest.mark.parametrize(
    ("motor", "joint", "flag"),
    [(0.0, 0.01, h.MOTOR_STUCK), (0.01, 0.0, h.JOINT_STUCK), (0.01, 0.01, h.ENCODERS_DISAGREE),
     (0.0, 0.0, h.ENCODERS_DISAGREE)],
)  # fmt: skip
def test_of_two_encoders_far_apart_the_one_that_rests_lies(motor: float, joint: float, flag: int) -> None:
    """More than five times the limit for 3 ms; at rest = no change for 8 ms."""
    fed = Fed(options(joint_residual_rad=1 / 64))
    for k in range(12):
        fed.cycle(motor=motor * k, torque=0.0, joint=joint * k, predicted=joint * k)
    seen = [
        fed.cycle(motor=motor * k, torque=0.0, joint=joint * k, predicted=joint * k + 5.1 / 64)
        for k in range(12, 17)
    ]
    assert [checked.flags for checked in seen] == [0, 0, 0, 0, flag]  # 4 T = 3.9 ms
    assert [checked.joint_ok for checked in seen] == [True] * 4 + [flag != h.JOINT_STUCK]
    allowed = Fed(options(joint_residual_rad=1 / 64))
    for k in range(8):
        checked = allowed.cycle(motor=motor * k, torque=0.0, joint=joint * k, predicted=joint * k + 5 / 64)
        assert not checked.flags & flag


@pytest.mark.parametrize(("rested", "flag"), [(7, h.ENCODERS_DISAGREE), (8, h.JOINT_STUCK)])
def test_a_slow_loop_waits_for_as_many_samples(rested: int, flag: int) -> None:
    """Far apart in four samples, at rest for eight periods, where these are longer than 3 and 8 ms."""
    fed, joint = Fed(options(joint_residual_rad=1 / 64), period_s=1 / 64), 0.1

    def cycle(joint: float, off: float) -> int:
        return fed.cycle(motor=0.01 * fed.k, torque=0.0, joint=joint, predicted=joint + off).flags & (
            h.JOINT_STUCK | h.FATAL
        )

    for k in range(12):
        assert cycle(joint - 0.01 * (11 - k), 0.0) == 0  # the last of these changes it for the last time
    for _ in range(rested - 4):
        assert cycle(joint, 0.0) == 0
    assert [cycle(joint, 5.1 / 64) for _ in range(4)] == [0, 0, 0, flag]


def test_a_joint_encoder_that_is_known_to_be_stuck_stays_so_while_the_motor_rests() -> None:
    """As it does where it turns back; not once the joint's reading changes."""
    fed = Fed(options(joint_residual_rad=1 / 64))

    def cycle(motor: float, joint: float = 0.0) -> int:
        return fed.cycle(motor=motor, torque=0.0, joint=joint, predicted=0.2).flags & (
            h.JOINT_STUCK | h.MOTOR_STUCK | h.ENCODERS_DISAGREE
        )

    moving = [cycle(0.01 * k) for k in range(20)]
    assert moving[-8:] == [h.JOINT_STUCK] * 8
    assert [cycle(0.19) for _ in range(20)] == [h.JOINT_STUCK] * 20
    assert cycle(0.20, 0.01) == h.ENCODERS_DISAGREE
    assert [cycle(0.20, 0.01) for _ in range(20)] == [h.ENCODERS_DISAGREE] * 20


def test_a_motor_that_lags_for_long_is_fatal() -> None:
    fed, near = Fed(options(lead_rad=0.25)), Fed(options(lead_rad=0.25))
    for k in range(12):
        assert near.cycle(target=-0.25, **ALL).flags == 0
        checked = fed.cycle(target=-0.26, **ALL)
        assert checked.flags == (h.MOTOR_LAGS if k >= 8 else 0)
        assert checked.fatal == (k >= 8)


def test_a_motor_is_stuck_once_it_is_heard_to_stand_while_its_target_went_far() -> None:
    """Further than 1/64 rad from where the target was when it last changed."""
    fed = Fed(options(stuck_rad=1 / 64))
    fed.cycle(target=0.5, **ALL)
    for target, flags in ((0.5, 0), (0.5 + 1 / 64, 0), (0.5 - 1 / 64, 0), (0.5 + 1.1 / 64, h.MOTOR_STUCK)):
        assert fed.cycle(target=target, **ALL).flags == flags
    assert fed.cycle(target=0.5 - 1.1 / 64, torque=0.0, joint=0.0).flags == 0  # not heard
    moved = {**ALL, "motor": 0.001}
    assert fed.cycle(target=0.9, **moved).flags == 0
    assert [fed.cycle(target=0.9 + 1.1 / 64, **moved).fatal for _ in range(3)] == [False, False, True]


def test_a_motor_that_was_held_up_and_says_the_same_again_is_not_stuck() -> None:
    """Silent while its target went far, it repeats itself twice and follows; the third time it is stuck."""
    fed, moved = Fed(options(stuck_rad=1 / 64)), {**ALL, "motor": 0.001}
    fed.cycle(target=0.5, **ALL)
    for _ in range(10):
        assert not fed.cycle(target=0.5 + 4 / 64, torque=0.0, joint=0.0).flags & h.MOTOR_STUCK
    for told in (ALL, ALL, moved, moved, moved):
        assert fed.cycle(target=0.5 + 4 / 64, **told).flags == 0
    assert [fed.cycle(target=0.5 + 6 / 64, **moved).flags for _ in range(2)] == [h.MOTOR_STUCK] * 2


def test_a_motor_that_follows_is_neither_stuck_nor_jumping_however_coarsely_its_drive_tells() -> None:
    """It trails its target by 1/64 rad, and is told in steps of 1/32 rad."""
    step, wanted = 1 / 32, options(stuck_rad=1 / 64, motor_rate_rad_s=1.0)
    coarse, unknown = Fed(wanted, motor_step_rad=step), Fed(wanted)
    flags, mistaken = set(), set()
    for k in range(200):
        target = 0.001 * k
        told = {**ALL, "motor": step * round((target - 1 / 64) / step)}
        flags.add(coarse.cycle(target=target, **told).flags)
        mistaken.add(unknown.cycle(target=target, **told).flags)
    assert flags == {0}
    assert max(mistaken) & (h.MOTOR_STUCK | h.MOTOR_JUMP)


@pytest.mark.parametrize("asked", [0.5, nan])
def test_a_target_that_is_none_yet_says_nothing_about_the_motor(asked: float) -> None:
    """Stuck counts from the first target on, be there cycles without one before it or not."""
    fed = Fed(options(stuck_rad=1 / 64))
    for target in (nan, nan, asked, 0.5, 0.5, 0.5):
        assert fed.cycle(target=target, **ALL).flags == 0
    assert fed.cycle(target=0.5 + 1.1 / 64, **ALL).flags == h.MOTOR_STUCK


def test_a_motor_may_trail_by_two_steps_of_its_drive_more_than_stated() -> None:
    fed = Fed(options(stuck_rad=1 / 64), motor_step_rad=1 / 64)
    for target, flags in (*[(0.5, 0)] * 3, (0.5 + 3.0 / 64, 0), (0.5 + 3.1 / 64, h.MOTOR_STUCK)):
        assert fed.cycle(target=target, **ALL).flags == flags


def test_a_motor_that_says_nothing_is_not_called_stuck_by_the_joint_that_moves() -> None:
    """Silent for as long as a value is fresh, that included, it is taken at its last word."""
    fed = Fed(options(joint_residual_rad=1 / 64))
    fed.health = h.Health(options(joint_residual_rad=1 / 64), N, 16.0 * T, T)
    for k in range(30):
        moving = {"torque": 0.0, "joint": 0.01 * k}
        flags = fed.cycle(predicted=0.01 * k + 0.2, **({**moving, "motor": 0.0} if k == 0 else moving)).flags
        far = flags & (h.MOTOR_STUCK | h.ENCODERS_DISAGREE)
        assert far == (h.MOTOR_STUCK if 9 <= k <= 16 else h.ENCODERS_DISAGREE if k > 3 else 0)
