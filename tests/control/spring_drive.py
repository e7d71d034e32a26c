"""A drive that is a plain spring, and its compensator."""

from __future__ import annotations

from math import nan
from pathlib import Path

from cablecomp.config import load_joint
from cablecomp.control.compensator import Compensator, Gains
from cablecomp.control.options import CompensatorOptions, MotorModel
from cablecomp.signals import NAN, Estimate, Sample

CONFIGS = Path(__file__).parents[2] / "configs/joints"
JOINT = load_joint(CONFIGS / "wrist-capstan.toml")
N = JOINT.drive.ratio
T = 1e-3
K = 200.0
GAINS = Gains(20.0, 0.0, 20.0, 0.0, 0.0, 5.0, 0.0)


class Spring:
    """A drive that is a plain spring of K Nm/rad: deflection = load/K."""

    def step(self, sample: Sample) -> Estimate:
        return self._at(sample, sample.joint_torque_Nm)

    def peek_deflection(self, time_s: float, motor_position_rad: float, joint_torque_Nm: float) -> float:
        return joint_torque_Nm / K

    def step_ahead(
        self, sample: Sample, time_s: float, motor_position_rad: float, joint_torque_Nm: float
    ) -> tuple[Estimate, float]:
        return self.step(sample), joint_torque_Nm / K

    def step_inverse(self, sample: Sample) -> Estimate:
        return self._at(sample, K * (sample.joint_position_rad - N * sample.motor_position_rad))

    def _at(self, sample: Sample, load: float) -> Estimate:
        d = load / K
        return Estimate(sample.time_s, d, NAN, NAN, N * sample.motor_position_rad + d, load, 60.0, 60.0)


def controller(gains: Gains = GAINS, **options: object) -> Compensator:
    chosen = CompensatorOptions.model_validate({"blend_s": 0.05, **options})
    return Compensator(JOINT, chosen, T, Spring(), gains=gains, motor=MotorModel(coulomb_Nm=0.0))


def sample(k: int, motor: float = 0.0, load: float = 0.0, joint: float = nan) -> Sample:
    return Sample(k * T, motor, load, joint, -N * load)
