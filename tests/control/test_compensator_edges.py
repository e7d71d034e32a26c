"""The compensator where it meets sensors and switches: zeros are taken off, and a switch is no motion."""

from __future__ import annotations

from pathlib import Path

import pytest

from cablecomp.config import JointConfig, load_joint
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator, Gains
from cablecomp.control.options import CompensatorOptions
from cablecomp.observer import Observer
from cablecomp.signals import Sample

JOINT = load_joint(Path(__file__).parents[2] / "configs/joints/wrist-capstan.toml")
N = JOINT.drive.ratio
T = 1e-3
GAINS = Gains(20.0, 0.0, 20.0, 0.0, 5.0, 5.0, 0.0)


def controller(config: JointConfig, **options: object) -> Compensator:
    chosen = CompensatorOptions.model_validate({"blend_s": 0.05, **options})
    return Compensator(config, chosen, T, Observer(config), gains=GAINS)


def reading(**wrong: float) -> JointConfig:
    return JOINT.model_copy(update={"sensors": JOINT.sensors.model_copy(update=wrong)})


@pytest.mark.parametrize("mode", ["position", "force"])
def test_a_switch_asks_for_no_more_velocity_than_its_blend_has(mode: str) -> None:
    c = controller(JOINT, mode=mode, torque_from="sensor")
    for k in range(300):
        if k == 100:
            c.disable()
        if k == 200:
            c.enable()
        command = c.step(Sample(k * T, 0.1 / N, 1.5, 0.1), Reference(0.1, 0.0, 1.5))
        if k > 60:
            assert abs(command.motor_velocity_rad_s) < 1.6 * 0.01 / N / 0.05


@pytest.mark.parametrize(
    "options",
    [
        {"mode": "position", "joint_feedback_per_s": 5.0},
        {"mode": "force", "torque_from": "sensor"},
        {"mode": "force"},
    ],
)
def test_what_the_joint_encoder_reads_too_much_is_taken_off(options: dict[str, object]) -> None:
    asked = []
    for config, joint in ((JOINT, 0.103), (reading(joint_position_offset_rad=0.02), 0.123)):
        c = controller(config, **options)
        for k in range(30):
            command = c.step(Sample(k * T, 0.1 / N, 0.5, joint), Reference(0.1, 0.0, 0.5))
        asked.append(command.motor_position_rad)
    assert asked[1] == pytest.approx(asked[0], abs=1e-9)


@pytest.mark.parametrize(
    "options",
    [
        {"load": "sensor"},
        {"load": "both"},
        {"load": "reference"},
        {"feed_forward": "linear", "linear_stiffness_Nm_per_rad": 150.0},
        {"mode": "force", "torque_from": "sensor"},
        {"mode": "force", "torque_from": "encoders"},
        {"mode": "force", "torque_from": "motor_torque"},
        {"mode": "impedance", "torque_from": "sensor"},
    ],
)
def test_a_load_is_wanted_and_met_as_it_is_and_not_as_a_sensor_reads_it(options: dict[str, object]) -> None:
    asked = []
    for config, load in ((JOINT, 0.5), (reading(joint_torque_gain=1.2, joint_torque_offset_Nm=0.3), 0.9)):
        c = controller(config, **options)
        for k in range(30):
            seen = Sample(k * T, 0.1 / N, load, 0.103, -N * 0.5)
            command = c.step(seen, Reference(0.1, 0.0, 0.8))
        asked.append(command[:3])
    assert asked[1] == pytest.approx(asked[0], abs=1e-9)
