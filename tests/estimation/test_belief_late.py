"""The check before belief: what is late, beside lost motion that looks alike."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from turning import JOINT

from cablecomp import library
from cablecomp.cli.beliefs import believe_all
from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.estimation.belief import suspicions
from cablecomp.estimation.view import Suspicion
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, StageConfig, simulate

TIME = np.arange(0.0, 20.0, 0.02)
ONE_SPEED = 0.3 * TIME  # turns
TWO_SPEEDS = np.where(TIME < 10.0, 0.2 * TIME, 2.0 + 0.6 * (TIME - 10.0))
BACKLASH = EffectSpec("termination_backlash", {"gap_rad": 0.003})
FRICTION = EffectSpec("bearing_friction", {"torque_Nm": 0.2, "presliding_rad": 1e-4, "load_coefficient": 0.0})


def plant(motor_rad: FloatArray, load_Nm: FloatArray, *effects: EffectSpec) -> dict[str, FloatArray]:
    """The joint as the independent plant has it, with its encoder's noise."""
    stage = StageConfig(**{f.name: getattr(JOINT.drive.stage[0], f.name) for f in fields(StageConfig)})
    seen = simulate(PlantConfig("bench", "closed", (stage,), effects=effects), TIME, motor_rad, load_Nm)
    noise = 2e-5 * np.random.default_rng(1).standard_normal(len(TIME))
    angle = seen.joint_position_rad + noise
    return {
        "time_s": TIME,
        "motor_position_rad": motor_rad,
        "joint_torque_Nm": load_Nm,
        "joint_position_rad": angle,
    }


def swung(turns: FloatArray, later_rad: float = 0.0) -> FloatArray:
    return np.sin(2.0 * np.pi * turns + later_rad) * (1.0 - np.exp(-TIME))


def delays_of(
    columns: dict[str, FloatArray], late: str = "", late_s: float = 0.0, joint: JointConfig = JOINT
) -> list[Suspicion]:
    if late:
        columns = {**columns, late: np.interp(TIME - late_s, TIME, columns[late])}
    return [s for s in suspicions(joint, columns) if s.kind == "delay"]


@pytest.mark.parametrize("lost", [BACKLASH, FRICTION])
def test_lost_motion_that_the_joint_is_known_to_have_is_said_to_be_no_delay(lost: EffectSpec) -> None:
    columns = plant(1.8 * swung(ONE_SPEED), 1.2 * swung(ONE_SPEED, 1.0), lost)
    assert delays_of(columns)
    known = with_effects(JOINT, [(lost.id, dict(lost.parameters))])
    assert delays_of(columns, joint=known) == []
    (said,) = delays_of(columns, "joint_position_rad", 0.1, known)
    assert said.numbers["late_s"] > 0.05


def test_lost_motion_that_a_diagnosis_has_found_is_said_to_be_no_delay_beside_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command (standard error has it, for then it was open) and by the library."""
    columns = plant(1.8 * swung(ONE_SPEED), 1.2 * swung(ONE_SPEED, 1.0), FRICTION)
    known = with_effects(JOINT, [(FRICTION.id, dict(FRICTION.parameters))])
    doubts = believe_all(JOINT, {"bench": columns})
    assert "lost motion" in capsys.readouterr().err
    (line,) = doubts.lines
    assert doubts.beside(JOINT, {"bench": columns}).lines == (line,)
    assert doubts.beside(known, {"bench": columns}).lines == ()
    for found, said in ((JOINT, 1), (known, 0)):
        answer = SimpleNamespace(in_time=found)
        monkeypatch.setattr(library, "_diagnose", lambda *given, answer=answer: answer)
        assert len(library.diagnose(columns, JOINT).doubts) == said


def test_what_is_said_of_signs_is_to_be_mended_first() -> None:
    """A motor's angle that is turned; a late joint is a warning as others are."""
    columns = plant(1.8 * swung(TWO_SPEEDS), 1.2 * swung(TWO_SPEEDS, 1.0))
    turned = {**columns, "motor_position_rad": -columns["motor_position_rad"]}
    (line,) = believe_all(JOINT, {"a": columns, "b": turned}).mend_first
    assert line.startswith("b: motor_position_rad and joint_position_rad seem to turn against each other")
    late = np.interp(TIME, TIME + 0.05, columns["joint_position_rad"])
    doubts = believe_all(JOINT, {"late": {**columns, "joint_position_rad": late}})
    assert doubts.lines
    assert not doubts.mend_first


@pytest.mark.parametrize("lost", [BACKLASH, FRICTION])
def test_where_all_moves_at_one_speed_a_delay_is_not_said_without_lost_motion(lost: EffectSpec) -> None:
    found = delays_of(plant(1.8 * swung(ONE_SPEED), 1.2 * swung(ONE_SPEED, 1.0), lost))
    assert [s for s in found if "lost motion" not in s.text] == []


@pytest.mark.parametrize("lost", [BACKLASH, FRICTION])
def test_two_speeds_tell_a_delay_from_lost_motion(lost: EffectSpec) -> None:
    columns = plant(1.8 * swung(TWO_SPEEDS), np.full_like(TIME, 0.8), lost)
    assert delays_of(columns) == []
    (said,) = delays_of(columns, "joint_position_rad", 0.05)
    assert said.numbers["late_s"] == pytest.approx(0.05, abs=0.01)
    assert "lost motion" not in said.text


def test_of_a_late_load_and_an_early_joint_that_look_alike_the_late_one_is_said() -> None:
    (said,) = delays_of(plant(np.zeros_like(TIME), 1.6 * swung(TWO_SPEEDS)), "joint_torque_Nm", 0.05)
    assert said.channel == "joint_torque_Nm"
    assert said.numbers["late_s"] == pytest.approx(0.05, abs=0.01)


def late_by(columns: dict[str, FloatArray], name: str, by_s: float) -> dict[str, FloatArray]:
    return {**columns, name: np.interp(TIME - by_s, TIME, columns[name])}


@pytest.fixture(scope="module")
def at_one_speed() -> dict[str, FloatArray]:
    """Load and motor a fixed phase apart: as a straight line a late joint is then a load of either sign and a ratio."""
    return plant(1.8 * swung(ONE_SPEED), 1.2 * swung(ONE_SPEED, 1.0))


@pytest.mark.parametrize("by_s", [0.02, 0.05, -0.05])
def test_a_late_joint_at_one_speed_is_no_ratio_and_no_turned_load(
    at_one_speed: dict[str, FloatArray], by_s: float
) -> None:
    (said,) = suspicions(JOINT, late_by(at_one_speed, "joint_position_rad", by_s))
    assert (said.kind, said.channel) == ("delay", "joint_position_rad")
    assert said.numbers["late_s"] == pytest.approx(by_s, abs=1e-3)
    assert "lost motion" in said.text


def test_a_late_motor_angle_is_no_joint_that_trails(at_one_speed: dict[str, FloatArray]) -> None:
    (said,) = suspicions(JOINT, late_by(at_one_speed, "motor_position_rad", 0.05))
    assert said.numbers["late_s"] == pytest.approx(-0.05, abs=1e-3)
    assert "early, or motor_position_rad as late or trailing it by lost motion" in said.text


@pytest.mark.parametrize(
    ("changed", "factor", "told"),
    [
        ("joint_torque_Nm", -1.0, ("sign", "joint_torque_Nm")),
        ("joint_torque_Nm", 6.0, ("scale", "joint_torque_Nm")),
        ("motor_position_rad", 1.1, ("ratio", "joint_position_rad")),
    ],
)
def test_at_one_speed_a_turned_load_a_scale_and_a_ratio_are_no_delay(
    at_one_speed: dict[str, FloatArray], changed: str, factor: float, told: tuple[str, str]
) -> None:
    found = suspicions(JOINT, {**at_one_speed, changed: factor * at_one_speed[changed]})
    assert [(s.kind, s.channel) for s in found] == [told]
