"""Sensors that stand still, are clipped or were never read are said; rests and what was held are left in peace."""

from __future__ import annotations

import numpy as np
import pytest
from turning import JOINT, course, recorded

from cablecomp.estimation.belief import suspicions
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

TRUE = recorded()
TIME = TRUE["time_s"]
RNG = np.random.default_rng(4)
LOAD = TRUE["joint_torque_Nm"] + 0.01 * RNG.standard_normal(len(TIME))
TORQUE = -JOINT.drive.ratio * LOAD + 0.01 * np.sign(np.gradient(TRUE["motor_position_rad"]))


def said(**changed: FloatArray) -> list[tuple[str, str]]:
    found = suspicions(JOINT, {**TRUE, **changed})
    return [(s.kind, s.channel) for s in found if s.kind in ("stuck", "clipped", "unread")]


@pytest.mark.parametrize("name", ["joint_position_rad", "motor_position_rad"])
def test_an_angle_that_begins_anew_at_each_turn_is_said(name: str) -> None:
    """Said alone: what jumps so spoils all that is told of slopes."""
    middle = float(np.mean(TRUE[name]))
    (found,) = suspicions(JOINT, {**TRUE, name: (TRUE[name] - middle) % (2.0 * np.pi)})
    crossings = np.count_nonzero(np.diff(np.sign(TRUE[name] - middle)))
    assert (found.kind, found.channel, found.numbers["jumps"]) == ("wrapped", name, crossings)
    assert "jumps by a whole turn" in found.text


def frozen(name: str, begin_s: float, end_s: float) -> FloatArray:
    values = TRUE[name].copy()
    first, after = np.searchsorted(TIME, (begin_s, end_s))
    values[first:after] = values[first]
    return values


@pytest.mark.parametrize("until_s", [11.0, 30.0])
@pytest.mark.parametrize("name", ["joint_position_rad", "motor_position_rad"])
def test_an_encoder_that_stands_while_the_other_goes_on_is_said_to_be_stuck(
    name: str, until_s: float
) -> None:
    """It comes back with a jump, or not at all."""
    (found,) = suspicions(JOINT, {**TRUE, name: frozen(name, 8.0, until_s)})
    assert (found.kind, found.channel) == ("stuck", name)
    assert found.numbers["rests_s"] == pytest.approx(min(until_s, TIME[-1]) - 8.0, abs=0.05)
    assert "stuck?" in found.text


@pytest.mark.parametrize("name", ["joint_position_rad", "motor_position_rad"])
def test_an_encoder_that_jumps_back_was_stuck_however_soft_the_drive_is_said_to_be(name: str) -> None:
    """Known by order of magnitude, the load would bend it by more than the joint turns at all."""
    (stage,) = JOINT.drive.stage
    drive = JOINT.drive.model_copy(update={"stage": (stage.model_copy(update={"EA_N": stage.EA_N / 100.0}),)})
    soft = JOINT.model_copy(update={"drive": drive})
    gone = TRUE[name][np.searchsorted(TIME, (8.0, 9.5))]
    assert abs(np.diff(gone)[0]) > 0.25 * np.ptp(TRUE[name])
    (found,) = suspicions(soft, {**TRUE, name: frozen(name, 8.0, 9.5)})
    assert (found.kind, found.channel) == ("stuck", name)
    held, after = frozen("joint_position_rad", 8.0, 9.5), int(np.searchsorted(TIME, 9.5))
    held[after:] -= held[after] - held[after - 1]  # it goes on from where it was held
    assert [s for s in suspicions(soft, {**TRUE, "joint_position_rad": held}) if s.kind == "stuck"] == []


def test_a_motor_angle_that_never_changes_is_said_where_the_joint_goes_far() -> None:
    assert said(motor_position_rad=np.full(len(TIME), 0.3)) == [("stuck", "motor_position_rad")]


def test_a_locked_input_and_rests_are_in_order() -> None:
    locked = course()
    locked["motor_position_rad"] = np.zeros_like(TIME)
    bent = Observer(JOINT).run(locked)["joint_position_rad"]
    for grid_rad in (0.0, 1e-4):
        angle = np.round(bent / grid_rad) * grid_rad if grid_rad else bent
        assert said(**locked, joint_position_rad=angle) == []
    rests = (TIME > 8.0) & (TIME < 11.0)  # both stand, and go on from where they stand
    at = np.where(rests, 8.0, np.where(TIME < 8.0, TIME, TIME - 3.0))
    assert said(**{n: np.interp(at, TIME, v) for n, v in TRUE.items() if n != "time_s"}) == []


@pytest.mark.parametrize("lost", [0.4, 0.9])
def test_motion_lost_on_the_way_is_no_stuck_encoder(lost: float) -> None:
    """In a sheath the tip stands for most of the motor's range, and goes on from where it stands."""
    q = JOINT.drive.ratio * TRUE["motor_position_rad"]
    angle, half = np.zeros_like(q), 0.5 * lost * np.ptp(q)
    for k in range(1, len(q)):
        angle[k] = np.clip(angle[k - 1], q[k] - half, q[k] + half)
    assert said(joint_position_rad=np.round(angle / 1e-3) * 1e-3) == []


def test_a_load_that_stops_at_its_greatest_value_is_clipped() -> None:
    assert said(joint_torque_Nm=LOAD) == []
    share = np.mean(np.abs(LOAD) > 0.8)
    found = [
        s
        for s in suspicions(JOINT, {**TRUE, "joint_torque_Nm": np.clip(LOAD, -0.8, 0.8)})
        if s.kind == "clipped"
    ]
    assert [s.channel for s in found] == ["joint_torque_Nm"]
    assert found[0].numbers["share"] == pytest.approx(share, abs=0.1)
    assert "% of the rows" in found[0].text


def test_a_load_that_is_held_or_read_in_coarse_steps_is_not_clipped() -> None:
    held = np.clip(4.0 * np.sin(0.7 * TIME), -1.0, 1.0)  # as commanded, from end to end
    assert said(joint_torque_Nm=held) == []
    assert said(joint_torque_Nm=np.round(TRUE["joint_torque_Nm"] / 0.2) * 0.2) == []
    assert said(joint_torque_Nm=held + 0.003 * RNG.standard_normal(len(TIME))) == []


def test_a_load_of_0_in_every_row_is_said_where_the_motor_carries_one() -> None:
    none = np.zeros_like(TIME)
    assert said(joint_torque_Nm=none, motor_torque_Nm=TORQUE) == [("unread", "joint_torque_Nm")]
    q = TRUE["motor_position_rad"]
    free = 0.05 * np.sign(np.gradient(q)) + 0.02 * q + 0.005 * RNG.standard_normal(len(TIME))
    assert said(joint_torque_Nm=none, motor_torque_Nm=free) == []
    assert said(joint_torque_Nm=none) == []


@pytest.mark.parametrize("decimals", [6, 15])
@pytest.mark.parametrize("every", [3, 5])
def test_a_log_brought_to_a_higher_rate_by_straight_lines_is_said(every: int, decimals: int) -> None:
    time = np.linspace(TIME[0], TIME[-1], (len(TIME) - 1) * every + 1)
    made_up = {n: np.interp(time, TIME, v).round(decimals) for n, v in TRUE.items() if n != "time_s"}
    (found,) = suspicions(JOINT, {"time_s": time, **made_up})
    assert (found.kind, found.numbers["every"]) == ("made up", every)


@pytest.mark.parametrize("noise_rad", [0.0, 2e-5])
@pytest.mark.parametrize("step_rad", [0.0, 1e-3])
def test_rows_that_were_read_are_not_made_up(noise_rad: float, step_rad: float) -> None:
    """Of a smooth course and of ramps, in steps of an encoder or not."""
    time = np.arange(0.0, 60.0, 0.01)
    noise = noise_rad * RNG.standard_normal(len(time))
    for course_rad in (
        np.sin(0.7 * time),
        np.abs((time + 3.3) % 20.0 - 10.0),
        np.interp(time, time[::400], time[::400] % 3),
    ):
        angle = course_rad + noise
        angle = np.round(angle / step_rad) * step_rad if step_rad else angle
        columns = {
            "time_s": time,
            "motor_position_rad": course_rad / JOINT.drive.ratio,
            "joint_position_rad": angle,
        }
        assert [s for s in suspicions(JOINT, columns) if s.kind == "made up"] == []
