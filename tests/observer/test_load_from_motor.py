"""The load told by the motor's torque, where no sensor sits at the joint: held against the simulated plant."""

from __future__ import annotations

import numpy as np
import pytest
from joints import WIDE

from cablecomp.config import JointConfig, parse_joint
from cablecomp.effects import with_effects
from cablecomp.estimation.simulate import load_of
from cablecomp.observer import Observer
from cablecomp.signals import Sample
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

TIME = np.arange(0.0, 4.0, 0.01)
MOTOR = 0.6 * np.sin(1.3 * TIME)
LOAD = 0.8 * np.sin(2.9 * TIME) * (1.0 - np.exp(-TIME))


def drive(circuit: str) -> dict[str, object]:
    return {"schema": 1, "name": circuit, "drive": {"circuit": circuit, "stage": [WIDE]}}


def joint(circuit: str, offset_Nm: float) -> JointConfig:
    more = {"observer": {"load": "motor_torque"}, "sensors": {"motor_torque_offset_Nm": offset_Nm}}
    return parse_joint({**drive(circuit), **more}, circuit)


@pytest.mark.parametrize("offset_Nm", [0.0, 0.02])
@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_the_motors_torque_tells_the_load_beside_what_holds_the_pretension(
    circuit: str, offset_Nm: float
) -> None:
    """At rest the motor of an open circuit holds r T0: that is no load."""
    true = simulate(PlantConfig.from_dict(drive(circuit)), TIME, MOTOR, LOAD)
    columns = {
        "time_s": TIME,
        "motor_position_rad": MOTOR,
        "motor_torque_Nm": true.channels()["motor_torque_Nm"] + offset_Nm,
    }
    config = joint(circuit, offset_Nm)
    angle = true.channels()["joint_position_rad"]
    deflection = np.ptp(angle - config.drive.ratio * MOTOR)
    assert Observer(config).run(columns)["joint_position_rad"] == pytest.approx(angle, abs=0.01 * deflection)
    one = Observer(config)
    for k in range(3):
        step = one.step(Sample(TIME[k], MOTOR[k], 0.0, motor_torque_Nm=columns["motor_torque_Nm"][k]))
    assert step.joint_position_rad == pytest.approx(angle[2], abs=0.01 * deflection)
    assert load_of(config, columns) == pytest.approx(LOAD, abs=0.01)


def test_the_load_told_by_both_encoders_is_not_what_the_joints_reads_too_much() -> None:
    more = {"observer": {"load": "both_encoders"}, "sensors": {"joint_position_offset_rad": 0.01}}
    config = parse_joint({**drive("closed"), **more}, "both")
    time, motor, load = TIME[:60], MOTOR[:60], LOAD[:60]
    plant = simulate(PlantConfig.from_dict(drive("closed")), time, motor, load)
    true = plant.channels()["joint_position_rad"]
    columns = {"time_s": time, "motor_position_rad": motor, "joint_position_rad": true + 0.01}
    found = Observer(config).run(columns)
    assert found["joint_torque_Nm"] == pytest.approx(load, abs=0.01)
    assert found["joint_position_rad"] == pytest.approx(true, abs=1e-9)
    one = Observer(config)
    steps = [one.step(Sample(TIME[k], MOTOR[k], joint_position_rad=true[k] + 0.01)) for k in range(3)]
    assert steps[2].joint_torque_Nm == pytest.approx(found["joint_torque_Nm"][2], abs=1e-9)


@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_an_observer_of_the_motors_torque_is_made_ready_for_a_loop(circuit: str) -> None:
    """A motor without torque would let an open circuit's cable hang; what is compiled with is a joint at rest."""
    observer = Observer(joint(circuit, 0.02))
    before = observer.snapshot()
    observer.compile()
    assert observer.snapshot() == before


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("bearing_friction", {"torque_Nm": 0.1, "load_coefficient": 0.0, "presliding_rad": 1e-3}),
        ("gravity_load", {"moment_Nm": 0.3, "phase_rad": 0.2}),
        ("inertial_load", {"inertia_kgm2": 0.02}),
        ("motor_friction", {"torque_Nm": 0.05, "presliding_rad": 1e-3}),
    ],
)
def test_the_motor_feels_what_turns_or_holds_the_joint_and_its_own_friction(
    effect: str, values: dict[str, float]
) -> None:
    """What the joint is held or turned by is in the motor's torque already; what holds the motor is taken off it."""
    true = simulate(
        PlantConfig.from_dict(drive("closed")), TIME, MOTOR, LOAD, effects=[EffectSpec(effect, values)]
    ).channels()
    plain = joint("closed", 0.0)
    columns = {"time_s": TIME, "motor_position_rad": MOTOR, "motor_torque_Nm": true["motor_torque_Nm"]}
    known = with_effects(plain, [(effect, values)])
    angle = true["joint_position_rad"]
    off = Observer(known).run(columns)["joint_position_rad"] - angle
    deflection = np.ptp(angle - plain.drive.ratio * MOTOR)
    assert np.max(np.abs(off)) < 0.01 * deflection
    unknown = Observer(plain).run(columns)["joint_position_rad"] - angle
    assert (np.max(np.abs(unknown)) > 0.05 * deflection) == (effect == "motor_friction")


def test_a_motors_drag_in_grease_is_taken_off_its_torque() -> None:
    """LuGre without Stribeck's fall, with a viscous part as large as the dry one at 2.5 rad/s."""
    law = {"torque_Nm": 0.05, "presliding_rad": 1e-3, "stribeck_gain": 0.0, "viscous_Nms_per_rad": 0.02}
    spec = EffectSpec("motor_friction:lugre", law)
    true = simulate(PlantConfig.from_dict(drive("closed")), TIME, MOTOR, LOAD, effects=[spec]).channels()
    columns = {"time_s": TIME, "motor_position_rad": MOTOR, "motor_torque_Nm": true["motor_torque_Nm"]}
    angle = true["joint_position_rad"]
    off = []
    for viscous in (0.4, 0.0):
        known = {"torque_Nm": 0.05, "presliding_rad": 1e-3, "viscous_s_per_rad": viscous}
        config = with_effects(joint("closed", 0.0), [("motor_friction", known)])
        off.append(np.std(Observer(config).run(columns)["joint_position_rad"] - angle))
    deflection = np.ptp(angle - joint("closed", 0.0).drive.ratio * MOTOR)
    assert off[0] < 0.005 * deflection
    assert off[1] > 5.0 * off[0]
