"""The health watch in numbers worked out by hand; the period is a power of two, so that ages are exact."""

from __future__ import annotations

from math import exp, expm1

import pytest
from fed_health import ALL, FURTHER, Fed, N, T, options

from cablecomp.links.records import JOINT_TORQUE, TEMPERATURE
from cablecomp.runtime import health as h
from cablecomp.runtime.channel import Shaking


def test_every_flag_has_its_bit_and_its_words() -> None:
    flags = (
        *(h.MOTOR_STALE, h.TORQUE_STALE, h.JOINT_STALE, h.MOTOR_JUMP, h.TORQUE_JUMP, h.JOINT_JUMP),
        *(h.TORQUE_SATURATED, h.JOINT_RESIDUAL, h.TORQUE_MISMATCH, h.MOTOR_LAGS, h.UNANSWERED, h.LATE),
        *(h.SHAKES, h.MOTOR_STUCK, h.JOINT_STUCK, h.ENCODERS_DISAGREE),
        *(h.TEMPERATURE_UNTRUE, h.OTHER_UNTRUE, h.TEMPERATURE_STALE, h.OTHER_STALE),
        h.MOTOR_TORQUE_STALE,
    )
    assert flags == tuple(1 << k for k in range(21))
    words = [word for flag in flags for word in h.health_names(flag)]
    assert len(words) == len(set(words)) == 21
    assert h.health_names(sum(flags)) == tuple(words)
    symptoms = {
        "stale": (
            *(h.MOTOR_STALE, h.TORQUE_STALE, h.JOINT_STALE, h.TEMPERATURE_STALE, h.OTHER_STALE),
            h.MOTOR_TORQUE_STALE,
        ),
        "jumped": (h.MOTOR_JUMP, h.TORQUE_JUMP, h.JOINT_JUMP),
        "stuck": (h.MOTOR_STUCK, h.JOINT_STUCK),
        "disagree": (h.JOINT_RESIDUAL, h.TORQUE_MISMATCH, h.ENCODERS_DISAGREE),
    }
    for symptom, those in symptoms.items():
        assert tuple(flag for flag in flags if symptom in h.health_names(flag)[0]) == those
    assert h.FATAL == h.MOTOR_LAGS | h.MOTOR_STUCK | h.ENCODERS_DISAGREE


@pytest.mark.parametrize(
    ("silent", "flag"), [("motor", h.MOTOR_STALE), ("torque", h.TORQUE_STALE), ("joint", h.JOINT_STALE)]
)
def test_a_channel_is_stale_after_two_periods_and_a_half(silent: str, flag: int) -> None:
    fed = Fed(needs_joint=True)
    fed.cycle(**ALL)
    came = {name: value for name, value in ALL.items() if name != silent}
    for k in range(1, 6):
        checked = fed.cycle(**came)
        assert checked.flags == (flag if k >= 3 else 0)
        assert checked.motor_age_s == (k * T if silent == "motor" else 0.0)
        assert checked.load_age_s == (0.0 if silent == "motor" else k * T)
        assert checked.joint_ok == (silent != "joint" or k < 3)
        assert checked.ready
        assert not checked.fatal


@pytest.mark.parametrize(
    ("channel", "floor", "flag"),
    [("motor", 0.002, h.MOTOR_JUMP), ("torque", 0.05, h.TORQUE_JUMP), ("joint", 0.002, h.JOINT_JUMP)],
)
def test_however_slow_a_channel_may_be_its_floor_passes_and_no_more(
    channel: str, floor: float, flag: int
) -> None:
    rates = dict.fromkeys(("motor_rate_rad_s", "torque_rate_Nm_s", "joint_rate_rad_s"), 1e-06)
    for share, expected in ((0.98, 0), (1.02, flag)):
        fed = Fed(options(**rates))
        fed.cycle(**ALL)
        assert fed.cycle(**{**ALL, channel: share * floor}).flags == expected


def test_a_channel_is_fresh_up_to_its_time_and_that_included() -> None:
    fed = Fed()
    fed.health = h.Health(options(), N, 2.0 * T, T)
    fed.cycle(**ALL)
    fed.cycle()
    fed.readings.unanswered = 1000
    at = fed.cycle()
    assert (at.flags, at.joint_ok) == (h.UNANSWERED, True)
    fed.readings.unanswered = 0
    over = fed.cycle()
    assert over.flags == h.MOTOR_STALE | h.TORQUE_STALE | h.JOINT_STALE
    assert not over.joint_ok


def test_what_control_does_not_live_on_makes_nothing_old() -> None:
    fed = Fed(needs_torque=False)
    fed.cycle(**ALL)
    for _ in range(5):
        checked = fed.cycle(motor=0.0)
    assert checked.load_age_s == 0.0
    assert checked.flags == h.TORQUE_STALE | h.JOINT_STALE


def test_a_sample_holds_what_came_and_the_other_channels_in_the_observer_s_order() -> None:
    fed = Fed(count=3, others=(FURTHER + 2, FURTHER))
    fed.readings.values[FURTHER:] = [7.0, 8.0, 9.0]
    fed.readings.values[TEMPERATURE] = 31.0
    s = fed.cycle(motor=0.5, torque=1.5, joint=0.25, motor_torque=0.75).sample
    assert s == (T, 0.5, 1.5, 0.25, 0.75, 31.0, (9.0, 7.0))


def test_a_drive_may_leave_as_many_commands_unanswered_as_stated() -> None:
    fed = Fed(options(unanswered=3))
    for count, flags in ((0, 0), (3, 0), (4, h.UNANSWERED)):
        fed.readings.unanswered = count
        assert fed.cycle(**ALL).flags == flags


@pytest.mark.parametrize(("torque", "flags"), [(3.9, 0), (4.0, 64), (-3.9, 0), (-4.0, 64), (5.0, 64)])
def test_a_torque_sensor_at_its_limit_is_named(torque: float, flags: int) -> None:
    assert Fed().cycle(motor=0.0, torque=torque, joint=0.0).flags == flags


def test_what_came_once_is_judged_once() -> None:
    fed = Fed()
    fed.cycle(**ALL)
    fed.cycle(**{**ALL, "motor": 9.0})
    for _ in range(3):
        fed.cycle()
    assert (fed.health.motor.refused, fed.health.joint.refused) == (1, 0)


@pytest.mark.parametrize("missing", ["motor", "torque", "joint"])
def test_control_waits_for_every_channel_that_it_lives_on(missing: str) -> None:
    fed, came = Fed(needs_joint=True), {name: 0.0 for name in ALL if name != missing}
    assert not fed.cycle(**came).ready
    assert fed.cycle(**ALL).ready


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_mean_mismatch_on_its_very_limit_is_allowed(sign: float) -> None:
    """After one cycle it is the share of one period; without the motor's torque it stays there."""
    fed = Fed(options(torque_mismatch_Nm=-expm1(-1.0 / 8.0)))
    assert fed.cycle(motor=0.0, torque=sign, joint=0.0, motor_torque=0.0).flags == 0
    for _ in range(20):
        assert fed.cycle(motor=0.0, torque=sign, joint=0.0).flags == 0


@pytest.mark.parametrize("preload_Nm", [0.0, 0.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_joint_torque_and_motor_torque_have_to_balance(sign: float, preload_Nm: float) -> None:
    """M + (tau + preload)/N = 0; its mean over `confirm_s` beyond the limit for as long again."""
    good, bad = (Fed(options(torque_mismatch_Nm=0.5), preload_Nm=preload_Nm) for _ in range(2))
    count, mean, began = 0, 0.0, None
    for k in range(60):
        assert good.cycle(motor=0.0, torque=0.8, joint=0.0, motor_torque=-N * 0.8 - preload_Nm).flags == 0
        checked = bad.cycle(motor=0.0, torque=sign, joint=0.0, motor_torque=-preload_Nm)
        mean += (1.0 - exp(-1.0 / 8.0)) * (1.0 - mean)
        began = k if began is None and mean > 0.5 else began
        over = began is not None and k - began >= 8
        assert checked.flags == (h.TORQUE_MISMATCH if over else 0)
        assert checked.load_age_s == pytest.approx(max(k - began - 8, 0) * T if began is not None else 0.0)
        count += over
    assert count > 20


def test_a_load_that_shakes_is_old_a_fifth_of_the_confirmation_later() -> None:
    """Alternating +-1 Nm about nothing: the mean square of the quick part goes to nearly 1."""
    fed, shaking, begun = (
        Fed(options(shake_Nm=0.6, confirm_s=40.0 * T, torque_rate_Nm_s=1e5)),
        Shaking(T),
        None,
    )
    for k in range(100):
        value = 1.0 if k % 2 else -1.0
        checked = fed.cycle(motor=0.0, torque=value, joint=0.0)
        begun = k if shaking.step(value) > 0.36 and begun is None else begun
        over = begun is not None and k - begun >= 8
        assert checked.flags == (h.SHAKES if over else 0)
        assert checked.load_age_s == pytest.approx(max(k - begun - 8, 0) * T if begun is not None else 0.0)
    assert begun is not None
    assert begun < 60


def test_data_that_a_device_stamped_long_ago_are_late_and_not_stale() -> None:
    fed = Fed()
    r = fed.readings
    for k in range(1, 12):
        r.device_s[JOINT_TORQUE] = min(k, 5 + 0.125 * (k - 5)) * T  # from the sixth on ever later
        checked = fed.cycle(**ALL)
        late = max(0.875 * (k - 5), 0.0)
        assert checked.load_age_s == pytest.approx(late * T, abs=1e-6)
        assert checked.flags == (h.LATE if late > 2.5 else 0)
        assert checked.joint_ok == (late <= 2.5)
