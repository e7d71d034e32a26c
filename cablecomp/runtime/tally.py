"""What a joint's cycles add up to, and what the live view shows of the last one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from cablecomp.control.command import Command, Reference
from cablecomp.control.degrade import Phase
from cablecomp.signals import Estimate, Sample


class View(NamedTuple):
    """What the live view shows of a joint."""

    name: str
    time_s: float
    phase: Phase
    sample: Sample
    estimate: Estimate
    command: Command
    reference: Reference
    flags: int


@dataclass
class JointTally:
    """Sums over the run, of cycles under control: position error (measured and predicted) and torque error,
    squared."""

    cycles: int = 0
    position_square: float = 0.0
    position_count: int = 0
    torque_square: float = 0.0
    torque_count: int = 0
    residual_square: float = 0.0
    deflection_square: float = 0.0
    phases: list[int] = field(default_factory=lambda: [0] * len(Phase))

    def add(self, wanted: Reference, measured_rad: float, torque_Nm: float, estimate: Estimate) -> None:
        """One cycle under control: what was wanted of this instant, the joint's angle and torque, sensors' errors taken
        off (NaN = none)."""
        self.cycles += 1
        if measured_rad == measured_rad:
            error = measured_rad - wanted.joint_position_rad
            residual = measured_rad - estimate.joint_position_rad
            self.position_square += error * error
            self.position_count += 1
            self.residual_square += residual * residual
        self.deflection_square += estimate.deflection_rad * estimate.deflection_rad
        torque_error = torque_Nm - wanted.joint_torque_Nm
        if torque_error == torque_error:
            self.torque_square += torque_error * torque_error
            self.torque_count += 1

    def phases_by_name(self) -> dict[str, int]:
        """Cycles spent in each phase that came up."""
        return {phase.name.lower(): self.phases[phase] for phase in Phase if self.phases[phase]}
