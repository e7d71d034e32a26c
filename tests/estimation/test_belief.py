"""The check before belief: what is turned, scaled, late or missing is named; what is right is left in peace."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits
from turning import JOINT, course, recorded

from cablecomp.config import load_joint
from cablecomp.control.stiffness import stiffness_range
from cablecomp.estimation import belief
from cablecomp.estimation.belief import suspicions
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import PlantConfig, simulate

COLUMNS = recorded()
TIME = np.arange(0.0, 20.0, 0.02)


def kinds(**changed: FloatArray) -> list[tuple[str, str]]:
    return [(s.kind, s.channel) for s in suspicions(JOINT, {**COLUMNS, **changed})]


def moved(name: str, late_s: float) -> FloatArray:
    return np.interp(COLUMNS["time_s"] - late_s, COLUMNS["time_s"], COLUMNS[name])


def test_a_right_recording_raises_no_suspicion() -> None:
    assert kinds() == []


def test_linear_algebra_keeps_to_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many small systems its threads only wait for each other."""
    seen: set[int] = set()

    def threads(*_: object) -> list[belief.Suspicion]:
        seen.update(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        return []

    monkeypatch.setattr(belief, "_delays", threads)
    with threadpool_limits(limits=2, user_api="blas"):
        assert kinds() == []
    assert seen == {1}


def test_what_is_no_more_than_rounding_is_not_said_to_be_late() -> None:
    """A load that moves the joint by 1e-11 of its range, and comes 0.1 s late."""
    slight = course()
    slight["joint_torque_Nm"] = 1e-8 * slight["joint_torque_Nm"]
    angle = Observer(JOINT).run(slight)["joint_position_rad"]
    late = np.interp(slight["time_s"] - 0.1, slight["time_s"], slight["joint_torque_Nm"])
    assert suspicions(JOINT, {**slight, "joint_torque_Nm": late, "joint_position_rad": angle}) == ()


def test_noise_alone_is_not_late() -> None:
    """A joint that rests: between two readings their noise is averaged, whatever the shift."""
    noise = 1e-5 * np.random.default_rng(3).standard_normal(len(TIME))
    still = {"time_s": TIME, "motor_position_rad": noise, "joint_torque_Nm": 0.0 * TIME + 0.4}
    assert suspicions(JOINT, {**still, "joint_position_rad": noise[::-1]}) == ()


def test_signs() -> None:
    assert kinds(joint_torque_Nm=-COLUMNS["joint_torque_Nm"]) == [("sign", "joint_torque_Nm")]
    assert ("sign", "joint_position_rad") in kinds(joint_position_rad=-COLUMNS["joint_position_rad"])


def test_a_load_beside_a_joint_angle_that_is_turned_is_right_once_that_is_turned_back() -> None:
    turned = {**COLUMNS, "joint_position_rad": -COLUMNS["joint_position_rad"]}
    (load,) = (s for s in suspicions(JOINT, turned) if s.channel == "joint_torque_Nm")
    assert "if motor_position_rad is what is turned, and is right if joint_position_rad is" in load.text
    both = {**turned, "motor_position_rad": -COLUMNS["motor_position_rad"]}
    (load,) = suspicions(JOINT, both)
    assert (load.channel, "what is turned" in load.text) == ("joint_torque_Nm", False)


def test_units_and_gears() -> None:
    for name in ("joint_position_rad", "motor_position_rad"):
        (said,) = suspicions(JOINT, {**COLUMNS, name: np.degrees(COLUMNS[name])})
        assert said.text.startswith(f"{name} seems to be in degrees")
    (gear,) = suspicions(JOINT, {**COLUMNS, "motor_position_rad": 8.0 * COLUMNS["motor_position_rad"]})
    assert (gear.kind, gear.numbers["slope_over_ratio"]) == ("ratio", pytest.approx(1.0 / 8.0, rel=1e-2))
    assert ("scale", "joint_torque_Nm") in kinds(joint_torque_Nm=1e3 * COLUMNS["joint_torque_Nm"])


def test_a_ratio_that_is_off_is_held_against_the_one_seen_with_the_load_on_both_sides() -> None:
    """What is left with the ratio seen is of a drive that bears the load, too: here next to nothing."""
    motor, load = np.sin(0.3 * TIME), 1.5 * np.sin(0.7 * TIME)
    softness = 1.0 / stiffness_range(JOINT).secant_Nm_per_rad
    angle = 1.1 * JOINT.drive.ratio * motor + softness * load
    columns = {
        "time_s": TIME,
        "motor_position_rad": motor,
        "joint_position_rad": angle,
        "joint_torque_Nm": load,
    }
    (said,) = suspicions(JOINT, columns)
    as_it_is, seen = (float(v) for v in re.findall(r"(\S+) mrad", said.text))
    assert as_it_is == pytest.approx(1e3 * np.std(0.1 * JOINT.drive.ratio * motor), rel=0.01)
    assert seen < 1e-6 * as_it_is


def test_a_ratio_that_explains_less_than_the_drives_own_is_not_said_to_be_off() -> None:
    """A spring returns the joint, so that load and motor go together; friction at the load's sensor tells its share
    from the motor's, and the slope is half of the ratio where the spring takes half of the motion."""
    motor, friction = np.sin(0.3 * TIME), 0.02 * np.sin(0.7 * TIME)
    softness = 1.0 / stiffness_range(JOINT).secant_Nm_per_rad
    spring = -0.5 * JOINT.drive.ratio / softness * motor
    columns = {
        "time_s": TIME,
        "motor_position_rad": motor,
        "joint_position_rad": JOINT.drive.ratio * motor + softness * spring,
        "joint_torque_Nm": spring + friction,
    }
    assert not [s for s in suspicions(JOINT, columns) if s.kind in ("ratio", "unit")]


def test_both_angles_in_degrees() -> None:
    both = {n: np.degrees(COLUMNS[n]) for n in ("joint_position_rad", "motor_position_rad")}
    assert kinds(**both) == [("unit", "joint_position_rad")]


@pytest.mark.parametrize(
    ("in_degrees", "said"),
    [
        (("joint_position_rad",), "joint_position_rad seems"),
        (("motor_position_rad", "joint_position_rad"), "both"),
    ],
)
def test_of_degrees_read_slowly_steps_of_six_are_no_turns(in_degrees: tuple[str, ...], said: str) -> None:
    """A joint that rests but for twice 0.6 s, and goes by 6.28 degrees from row to row then: a fifth of the motor's
    way, 69 degrees."""
    rough = JOINT.model_copy(update={"tolerance": {"input_radius_m": 1.0}})
    time = 0.05 * np.arange(600.0)
    angle = np.radians(
        np.interp(np.arange(600.0), [0.0, 150.0, 161.0, 400.0, 411.0], [0.0, 0.0, 69.08, 69.08, 0.0])
    )
    right = {
        "time_s": time,
        "motor_position_rad": 5.0 * angle,
        "joint_position_rad": angle,
        "joint_torque_Nm": 0.0 * time,
    }
    found = suspicions(rough, {**right, **{n: np.degrees(right[n]) for n in in_degrees}})
    assert [s.kind for s in found] == ["unit"]
    assert found[0].text.startswith(said)


@pytest.mark.parametrize("kept", [1.0, 0.5])
@pytest.mark.parametrize("name", ["joint_position_rad", "motor_position_rad"])
def test_of_a_drive_known_by_order_of_magnitude_the_one_angle_in_degrees_is_named(
    name: str, kept: float
) -> None:
    """Radii are known within a few times what they are; `kept`: what of the motion is not lost on the way."""
    rough = JOINT.model_copy(update={"tolerance": {"input_radius_m": 1.0}})
    right = {**COLUMNS, "joint_position_rad": kept * COLUMNS["joint_position_rad"]}
    assert not [s for s in suspicions(rough, right) if s.kind in ("unit", "ratio")]
    wide = {n: 3.0 * right[n] for n in ("joint_position_rad", "motor_position_rad")}
    (said,) = suspicions(rough, {**right, **wide, name: np.degrees(wide[name])})
    assert said.text.startswith(f"{name} seems to be in degrees")


@pytest.mark.parametrize("late_s", [0.1, -0.1])
@pytest.mark.parametrize("name", ["joint_torque_Nm", "joint_position_rad"])
def test_delays(name: str, late_s: float) -> None:
    (said,) = suspicions(JOINT, {**COLUMNS, name: moved(name, late_s)})
    assert (said.kind, said.channel) == ("delay", name)
    assert said.numbers["late_s"] == pytest.approx(late_s, abs=0.02)


@pytest.mark.parametrize("gap_share", [0.01, 0.03, 0.08])
def test_lost_motion_is_no_delay(gap_share: float) -> None:
    """A joint that trails its motor by an angle, whatever the speed (a backlash of that share of the way)."""
    joint, gap = COLUMNS["joint_position_rad"], gap_share * np.ptp(COLUMNS["joint_position_rad"])
    behind = joint.copy()
    for k in range(1, len(joint)):
        behind[k] = min(max(behind[k - 1], joint[k] - 0.5 * gap), joint[k] + 0.5 * gap)
    assert not [k for k in kinds(joint_position_rad=behind) if k[0] == "delay"]


def test_a_gap_over_which_nothing_moved_but_noise() -> None:
    """With the motor held its range is its noise, of which any two rows differ by a good part."""
    rng = np.random.default_rng(4)
    held = {**COLUMNS, "motor_position_rad": 0.3 + 1e-5 * rng.standard_normal(len(TIME))}
    held["joint_torque_Nm"] = 0.5 + 1e-3 * rng.standard_normal(len(TIME))
    kept = (TIME < 6.0) | (TIME > 7.0)
    assert not [s for s in suspicions(JOINT, {c: v[kept] for c, v in held.items()}) if s.kind == "gap"]


def test_a_gap_over_which_the_joint_moved() -> None:
    kept = (COLUMNS["time_s"] < 8.0) | (COLUMNS["time_s"] > 10.0)
    (said,) = suspicions(JOINT, {n: v[kept] for n, v in COLUMNS.items()})
    assert said.kind == "gap"
    assert said.numbers["gap_s"] == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("gap", [False, True])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_motor_torque_of_the_other_sign_is_said_across_a_gap_too(gap: bool, sign: float) -> None:
    kept = (COLUMNS["time_s"] < 8.0) | (COLUMNS["time_s"] > (10.0 if gap else 8.0))
    torque = -sign * JOINT.drive.ratio * COLUMNS["joint_torque_Nm"]
    said = suspicions(JOINT, {n: v[kept] for n, v in {**COLUMNS, "motor_torque_Nm": torque}.items()})
    turned = [("sign", "motor_torque_Nm")] if sign < 0.0 else []
    assert [(s.kind, s.channel) for s in said if s.kind != "gap"] == turned


@pytest.mark.parametrize("turned", ["motor_torque_Nm", "joint_torque_Nm"])
@pytest.mark.parametrize("driven", [-1.0, 1.0])
def test_of_two_torques_that_disagree_the_one_is_named_without_which_friction_would_do_work(
    turned: str, driven: float
) -> None:
    """A joint that turns a brake, or is turned by its load: of 1 N m at the joint the motor's side has 1.4 or 0.7."""
    angle = np.sin(0.5 * TIME)
    speed = np.cos(0.5 * TIME)
    load = driven * np.tanh(speed / 0.1)  # < 0 along the motion: a brake
    columns = {"time_s": TIME, "motor_position_rad": angle / JOINT.drive.ratio, "joint_position_rad": angle}
    columns["joint_torque_Nm"] = load
    columns["motor_torque_Nm"] = -(1.4 if driven < 0.0 else 0.7) * JOINT.drive.ratio * load
    assert [s for s in suspicions(JOINT, columns) if s.kind == "sign"] == []
    columns[turned] = -columns[turned]
    (said,) = (s for s in suspicions(JOINT, columns) if s.kind == "sign")
    assert said.channel == turned
    assert "does not tell" not in said.text


def lifted(angle: FloatArray, lost: float) -> dict[str, FloatArray]:
    """A weight of 1 N m at the joint, moved to and fro by a motor that has this share of it to overcome as well."""
    ratio = JOINT.drive.ratio
    return {
        "time_s": TIME,
        "motor_position_rad": angle / ratio,
        "joint_position_rad": angle,
        "joint_torque_Nm": np.full_like(TIME, -1.0) + 1e-3 * np.cos(TIME),
        "motor_torque_Nm": ratio * (1.0 + lost * np.tanh(np.gradient(angle, TIME) / 0.05)),
    }


@pytest.mark.parametrize("lost", [0.6, 3.0])
@pytest.mark.parametrize(
    "turned",
    [("motor_position_rad", "joint_position_rad"), ("motor_torque_Nm", "joint_torque_Nm"), ("time_s",)],
)
def test_where_friction_would_give_work_all_is_the_other_way_round(
    lost: float, turned: tuple[str, ...]
) -> None:
    """The motor overcomes friction both ways: its work over whole cycles is 4 a lost N m each, and none is the load's.
    What trails the motor leads it then, which is no delay."""
    right = lifted(np.sin(2.0 * np.pi * 0.2 * TIME), lost)
    assert [s for s in suspicions(JOINT, right) if s.kind == "sign"] == []
    columns = {n: -v if n in turned else v for n, v in right.items()}
    if turned == ("time_s",):
        columns = {"time_s": TIME, **{n: v[::-1] for n, v in right.items() if n != "time_s"}}
    (said,) = suspicions(JOINT, columns)
    assert (said.kind, said.channel) == ("sign", "time_s")
    assert said.numbers["motor_J"] == pytest.approx(-lost * 4.0 * 0.2 * TIME[-1], rel=0.1)


def test_what_one_stroke_gives_back_was_stored() -> None:
    """A motor that lets a wound-up drive go, its joint locked; a weight that is let down against little friction."""
    ratio, way = JOINT.drive.ratio, 0.01 * (1.0 + np.cos(np.pi * TIME / TIME[-1]))
    wound = {
        "time_s": TIME,
        "motor_position_rad": way,
        "joint_position_rad": np.zeros_like(TIME),
        "joint_torque_Nm": -50.0 * way,
        "motor_torque_Nm": 50.0 * ratio * way,
    }
    assert np.trapezoid(wound["motor_torque_Nm"], way) == pytest.approx(-25.0 * ratio * 0.02**2, rel=1e-3)
    down = lifted(np.cos(np.pi * TIME / TIME[-1]), 0.05)
    for columns in (wound, down):
        assert [s for s in suspicions(JOINT, columns) if s.kind == "sign"] == []


def test_a_load_of_the_other_sign_does_not_bring_the_motor_torque_under_suspicion() -> None:
    torque = -JOINT.drive.ratio * COLUMNS["joint_torque_Nm"]
    said = kinds(joint_torque_Nm=-COLUMNS["joint_torque_Nm"], motor_torque_Nm=torque)
    assert said == [("sign", "joint_torque_Nm")]


@pytest.mark.parametrize("times", [3.0, 100.0, 1000.0])
def test_a_motor_torque_far_beyond_load_and_pretension_is_in_another_unit(times: float) -> None:
    """Three times what the load asks is a drive with much friction."""
    wanted = -JOINT.drive.ratio * COLUMNS["joint_torque_Nm"]
    said = suspicions(JOINT, {**COLUMNS, "motor_torque_Nm": times * wanted})
    assert [(s.kind, s.channel) for s in said] == ([("scale", "motor_torque_Nm")] if times > 3.0 else [])
    stage, rms = JOINT.drive.stage[0], float(np.sqrt(np.mean(wanted**2)))
    for s in said:
        usual = rms + stage.input_radius_m * stage.pretension_N
        assert s.numbers["times_usual"] == pytest.approx(times * rms / usual)
        assert "seems to be in another unit" in s.text


def test_a_motor_torque_that_was_never_read_says_nothing() -> None:
    assert kinds(motor_torque_Nm=np.full(len(COLUMNS["time_s"]), np.nan)) == []


def test_a_joint_held_by_a_spring_is_no_load_of_the_opposite_sign() -> None:
    """Its load follows its angle: beside that, the motor's says little, and the line through both has any slope."""
    q = COLUMNS["motor_position_rad"]
    lost = np.zeros_like(q)  # motion lost in a sheath, from side to side
    for k in range(1, len(q)):
        lost[k] = np.clip(lost[k - 1] + 0.1 * (q[k] - q[k - 1]), -0.01, 0.01)
    angle = 0.5 * (JOINT.drive.ratio * q - lost)
    assert kinds(joint_position_rad=angle, joint_torque_Nm=-3.0 * angle) == []


@pytest.mark.parametrize("seed", [2, 5, 7, 11])
def test_loads_within_the_hysteresis_are_in_no_other_unit(seed: int) -> None:
    """To a straight line the drive is stiff there, far beyond what it is by its greatest load."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 8.0, 0.01)
    slow, quick = rng.uniform(0.2, 0.6), rng.uniform(0.3, 1.2)
    soft = 1.0 - np.exp(-time)
    arm = Path(__file__).parents[2] / "configs/joints/capstan-arm.toml"
    joint = load_joint(arm)
    most = rng.choice([0.03, 0.1, 0.3]) * joint.drive.stage[-1].pretension_moment_Nm
    motor = 0.8 * soft * np.sin(2.0 * np.pi * slow * time)
    load = most * soft * np.sin(2.0 * np.pi * quick * time + rng.uniform(0.0, 6.0))
    columns = dict(simulate(PlantConfig.from_toml(arm), time, motor, load).channels())
    columns["joint_position_rad"] = columns["joint_position_rad"] + 2e-5 * rng.standard_normal(len(time))
    assert suspicions(joint, columns) == ()


def test_a_load_that_lets_an_open_circuit_slacken_is_one_of_the_other_sign() -> None:
    one = JOINT.model_copy(update={"drive": JOINT.drive.model_copy(update={"circuit": "open"})})
    stage = one.drive.stage[-1]
    holds = stage.output_radius_m * stage.pretension_N
    pulls = holds * (2.0 + np.sin(COLUMNS["time_s"]))
    angle = one.drive.ratio * COLUMNS["motor_position_rad"]
    for turn in (1.0, -1.0):
        load = turn * pulls
        said = suspicions(one, {**COLUMNS, "joint_position_rad": angle, "joint_torque_Nm": load})
        slack = [s for s in said if "go slack" in s.text]
        assert [s.kind for s in slack] == ([] if turn > 0.0 else ["sign"])
