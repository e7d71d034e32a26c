"""What a joint is known to leave: a later diagnosis names what stands out of it, and calls the rest consistent."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from joints import SMALL, closed
from small_drive import TOLERANT, course, recorded

from cablecomp.config import JointConfig, Remainder, parse_joint
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.explain.usual import lost_in_usual
from cablecomp.diagnosis.result import Diagnosis, report_json
from cablecomp.errors import InputError
from cablecomp.report.diagnosis_words import in_a_sentence
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

GRAVITY = EffectSpec("gravity_load", {"moment_Nm": 0.15, "phase_rad": 0.4})
HEAVY = EffectSpec("gravity_load", {"moment_Nm": 0.5, "phase_rad": 0.4})
LATE = EffectSpec("clock_skew", {"delay_s": 0.012})
SECONDS = 20.0


def known_to_leave(joint: JointConfig, left_rad: float) -> JointConfig:
    return joint.model_copy(update={"remainder": Remainder(joint_position_rad=left_rad)})


def does_rad(effect: EffectSpec) -> float:
    """What an effect makes of the joint's angle in the plant (RMS about its mean)."""
    time, motor, load = course(SECONDS)
    plant = PlantConfig.from_dict(closed(SMALL))
    angle = [
        simulate(plant, time, motor, load, effects=e).channels()["joint_position_rad"] for e in ([], [effect])
    ]
    return float(np.std(angle[1] - angle[0]))


def named(found: Diagnosis) -> list[str]:
    return [n.effect for n in found.named]


def rippled(columns: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """What no effect of the catalogue does: waves of the encoder, thirteen to the radian."""
    angle = columns["joint_position_rad"]
    return {**columns, "joint_position_rad": angle + 1.5e-4 * np.sin(13.0 * angle)}


def test_of_two_effects_the_one_that_stands_out_of_it_is_named() -> None:
    small, large = does_rad(GRAVITY), does_rad(LATE)
    found = diagnose(known_to_leave(TOLERANT, 3.0 * small), {"small/1": recorded([GRAVITY, LATE], SECONDS)})
    assert large > 3.0 * small
    assert named(found) == ["clock_skew"]
    assert any("known to leave" in note for note in found.notes)


def test_a_mismatch_of_the_usual_size_is_consistent_and_nothing_is_asked() -> None:
    columns = {"small/1": recorded([GRAVITY], SECONDS)}
    found = diagnose(known_to_leave(TOLERANT, 3.0 * does_rad(GRAVITY)), columns)
    assert found.verdict in ("consistent", "recalibrate")
    assert (named(found), found.tested) == ([], ())


def test_a_joint_whose_diagnosis_left_structure_knows_it_and_is_consistent_with_it() -> None:
    columns = {"small/1": rippled(recorded([HEAVY], SECONDS))}
    first = diagnose(TOLERANT, columns)
    assert (first.verdict, named(first)[0]) == ("partly explained", "gravity_load")
    joint = parse_joint(tomllib.loads(joint_text(first.augmented_joint)), "joint")
    left = joint.remainder.joint_position_rad
    assert left == pytest.approx(first.augmented.heldout_own_zero_rmse_rad, rel=0.01)
    assert "joint_angle" in joint.remainder.follows
    again = diagnose(joint, columns)
    assert (again.verdict, named(again)) == ("consistent", [])
    assert "no more than this joint is known to leave" in in_a_sentence(report_json(again))
    assert "known to leave" not in in_a_sentence(report_json(first))


def test_half_of_what_is_left_stands_out_in_its_own_channel() -> None:
    joint = known_to_leave(TOLERANT, 2e-3)
    assert lost_in_usual(joint, "joint_position_rad", (1.01e-3) ** 2) == ""
    assert "takes off 0.0009 of `joint_position_rad`" in lost_in_usual(joint, "joint_position_rad", 0.9e-3**2)
    assert lost_in_usual(joint, "motor_torque_Nm", 0.0) == ""


def test_what_acts_through_what_that_goes_by_has_to_stand_out_of_all_of_it() -> None:
    remainder = Remainder(joint_position_rad=2e-3, motor_torque_Nm=1e-3, follows=("joint_angle", "load"))
    joint = TOLERANT.model_copy(update={"remainder": remainder})
    lost = lost_in_usual(joint, "joint_position_rad", 1.9e-3**2, "joint_angle")
    assert "known to leave 0.002 that goes by joint angle" in lost
    assert lost_in_usual(joint, "joint_position_rad", 2.1e-3**2, "joint_angle") == ""
    assert lost_in_usual(joint, "joint_position_rad", 1.9e-3**2, "time") == ""
    assert lost_in_usual(joint, "motor_torque_Nm", 0.6e-3**2, "joint_angle") == ""
    assert parse_joint(tomllib.loads(joint_text(joint)), "joint").remainder == remainder


def test_a_remainder_that_goes_by_nothing_known_is_refused() -> None:
    joint = TOLERANT.model_copy(update={"remainder": Remainder(follows=("motor_angel",))})
    with pytest.raises(InputError, match=r"\[remainder\] follows 'motor_angel'.*joint_angle.*other:<name>"):
        diagnose(joint, {"small/1": recorded([], SECONDS)})


def test_a_remainder_below_none_is_refused() -> None:
    data = {**closed(SMALL, "small"), "remainder": {"joint_position_rad": -1.0}}
    with pytest.raises(InputError, match="joint_position_rad"):
        parse_joint(data, "small")
