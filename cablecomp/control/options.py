"""How a joint is to be controlled: frozen options, read from TOML; an unknown key fails."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from cablecomp.config import NonNegative, Positive, read_toml, validated
from cablecomp.examples import resolve


class ControlMode(StrEnum):
    """What is controlled: joint position, joint torque, or the relation between the two."""

    POSITION = "position"
    FORCE = "force"
    IMPEDANCE = "impedance"


class FeedForward(StrEnum):
    """Where the deflection that the motor makes up for comes from: the observer, a constant stiffness,
    nowhere."""

    OBSERVER = "observer"
    LINEAR = "linear"
    NONE = "none"


class _Frozen(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MotorModel(_Frozen):
    """Motor and drive as seen at the input pulley, for torque feed-forward and for the design of gains.

    Drive: motor torque = `stiffness (target - q_in) + damping (target velocity - dq_in/dt) +
    feed-forward`, within `delay_s` of the command; `output_inertia_kgm2` is all that turns with the
    output pulley. For the design alone: `structural_damping`, the ratio that the link's swing on the
    cable has by itself (hysteresis left out), and `contact_damping_s`, damping over stiffness of what
    the joint touches.
    """

    inertia_kgm2: Positive = 2e-4
    viscous_Nms_per_rad: NonNegative = 1e-3
    coulomb_Nm: NonNegative = 0.0
    stiffness_Nm_per_rad: Positive = 60.0
    damping_Nms_per_rad: Positive = 0.16
    torque_bandwidth_Hz: Positive = 1000.0
    velocity_bandwidth_Hz: Positive = 150.0
    delay_s: NonNegative = 1e-3
    output_inertia_kgm2: Positive = 6e-4
    output_viscous_Nms_per_rad: NonNegative = 0.0
    structural_damping: NonNegative = 0.01
    contact_damping_s: NonNegative = 1e-3


class CompensatorOptions(_Frozen):
    """What the compensator does; gains of None are designed from the drive's stiffness range.

    `load`: "sensor" = the torque sensor's reading, filtered and extrapolated; "reference" = the load that the
    reference states; "both" = the reference's, corrected by the filtered difference to the sensor's.
    `load_filter_Hz`, `load_lead_s`: expected load = `(1 + s lead) / (1 + s / (2 pi f))^2` of the reading.
    `follow_*`: the same filter on the joint position that force and impedance mode follow.
    `joint_feedback_per_s`: integral gain on the joint encoder's error, 0 = no feedback.
    `force_feedback_per_s`: the same on the torque error, within `force_feedback_limit_Nm` (None = the joint's
    greatest torque as its limits state it, else R T0 of the output stage). `motor_integral_per_s`: the same on the
    motor encoder's own error (all contestants alike). `torque_from`: where force and impedance mode know the joint
    torque from.
    """

    mode: ControlMode = ControlMode.POSITION
    feed_forward: FeedForward = FeedForward.OBSERVER
    load: Literal["sensor", "reference", "both"] = "sensor"
    torque_from: Literal["encoders", "motor_torque", "sensor"] = "encoders"
    load_filter_Hz: Positive | None = None
    load_lead_s: NonNegative | None = None
    follow_filter_Hz: Positive | None = None
    follow_lead_s: NonNegative | None = None
    joint_feedback_per_s: NonNegative | None = 0.0
    joint_feedback_limit_rad: Positive = 0.05
    force_feedback_per_s: NonNegative | None = None
    force_feedback_limit_Nm: Positive | None = None
    motor_integral_per_s: NonNegative | None = None
    motor_integral_limit_rad: Positive = 0.1
    linear_stiffness_Nm_per_rad: Positive | None = None
    impedance_stiffness_Nm_per_rad: NonNegative = 20.0
    impedance_damping_Nms_per_rad: NonNegative = 0.2
    velocity_filter_Hz: Positive = 60.0
    coulomb_velocity_rad_s: Positive = 0.05
    blend_s: Positive = 0.3

    @model_validator(mode="after")
    def _linear_needs_a_number(self) -> CompensatorOptions:
        if self.feed_forward is FeedForward.LINEAR and self.linear_stiffness_Nm_per_rad is None:
            raise ValueError('feed_forward = "linear" needs linear_stiffness_Nm_per_rad')
        return self


class HealthOptions(_Frozen):
    """What is plausible: greatest rates of change, greatest difference between what agrees in a healthy
    joint.

    `joint_residual_rad`: measured less predicted joint position; `torque_mismatch_Nm`: torque sensor
    against motor torque over the drive's ratio; `lead_rad`: motor target against motor position; each
    must last `confirm_s`. `stuck_rad`: how far the motor target may move while the motor encoder shows
    no change. `shake_Nm`: RMS of the load's quick part (above 10 Hz), for a fifth of `confirm_s`:
    feed-forward that has come to shake the link is let go of. None = not watched. Temperatures, those of
    further channels too, are plausible from -60 to 200 degC and change by at most `temperature_rate_K_s`.
    """

    motor_rate_rad_s: Positive = 60.0
    joint_rate_rad_s: Positive = 40.0
    torque_rate_Nm_s: Positive = 2000.0
    torque_max_Nm: Positive | None = None
    temperature_rate_K_s: Positive = 50.0
    joint_residual_rad: Positive | None = None
    torque_mismatch_Nm: Positive | None = None
    lead_rad: Positive | None = 0.3
    stuck_rad: Positive | None = None
    shake_Nm: Positive | None = None
    confirm_s: Positive = 0.1
    unanswered: Annotated[int, Field(ge=1)] = 50


class ControlConfig(_Frozen):
    """A control file: motor model, compensator, health, and what the gains are designed for.

    Both margins are kept as one distance from -1, which is 1 where a loop does nothing: `phase_margin_deg` below 60.
    """

    schema_: Literal[1] = Field(alias="schema", default=1)
    motor: MotorModel = MotorModel()
    compensator: CompensatorOptions = CompensatorOptions()
    health: HealthOptions = HealthOptions()
    gain_margin: Annotated[float, Field(gt=1, allow_inf_nan=False)] = 2.0
    phase_margin_deg: Annotated[float, Field(gt=0, lt=60)] = 35.0
    load_max_Nm: Positive | None = None


def load_control(path: Path | str) -> ControlConfig:
    """Read a control file; a bare name such as `wrist-capstan` stands for an example that comes with the project.

    Raises InputError with one line that names file, key, what was found, what is accepted."""
    path = resolve(path, "control")
    return parse_control(read_toml(path), str(path))


def parse_control(data: dict[str, Any], where: str) -> ControlConfig:
    """Validate a control file already read; `where` names it in errors."""
    return validated(ControlConfig, data, where)
