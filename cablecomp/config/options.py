"""Sensors, effects, observer and limits in a joint configuration."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from cablecomp.config.base import Finite, Frozen, Listed, NonNegative, Positive, Text

_NOISE = "white noise, 1 sigma; absent = estimated from the recording"
_STEP = "resolution: one count"
_LEFT = "left of this channel; absent = nothing beyond noise"


class Sensors(Frozen):
    """Noise, resolution and zeros of each channel.

    Reading = truth + offset (joint torque: gain times truth + offset).
    """

    joint_position_noise_rad: NonNegative | None = Field(None, description=_NOISE)
    joint_position_resolution_rad: NonNegative | None = Field(None, description=_STEP)
    joint_position_offset_rad: Finite = Field(0.0, description="what the joint encoder reads too much")
    motor_position_noise_rad: NonNegative | None = Field(None, description=_NOISE)
    motor_position_resolution_rad: NonNegative | None = Field(None, description=_STEP)
    joint_torque_noise_Nm: NonNegative | None = Field(None, description=_NOISE)
    joint_torque_resolution_Nm: NonNegative | None = Field(None, description=_STEP)
    joint_torque_gain: Positive = Field(1.0, description="reading per true torque at the joint")
    joint_torque_offset_Nm: Finite = Field(0.0, description="what the joint torque sensor reads without load")
    motor_torque_noise_Nm: NonNegative | None = Field(None, description=_NOISE)
    motor_torque_resolution_Nm: NonNegative | None = Field(None, description=_STEP)
    motor_torque_offset_Nm: Finite = Field(0.0, description="what the motor torque reads without load")


class Remainder(Frozen):
    """What this joint, as it stands here, is known to leave of what was recorded (RMS on data left out).

    Written by the diagnosis that made the joint, where structure stayed beside what it named. A later diagnosis names
    what stands out of it, and calls a mismatch of that size this joint's usual one; absent = whatever stands out of
    the noise. `follows`: the covariates that what is left of the joint's angle goes by (`mismatch` in
    `diagnosis.json` has their names): what goes by one of these has to stand out of all of it.
    """

    joint_position_rad: NonNegative | None = Field(None, description=_LEFT)
    motor_torque_Nm: NonNegative | None = Field(None, description=_LEFT)
    tension_h_N: NonNegative | None = Field(None, description=_LEFT)
    tension_l_N: NonNegative | None = Field(None, description=_LEFT)
    follows: Annotated[tuple[Text, ...], Listed] = Field(
        (), description="covariates that the rest of the joint's angle goes by"
    )


class EffectEntry(Frozen):
    """One `[[effect]]`: the id of an effect and its parameters (every further key)."""

    model_config = ConfigDict(extra="allow", frozen=True)

    id: Text = Field(description="name of the effect; its parameters are the further keys")

    @property
    def parameters(self) -> dict[str, Any]:
        return dict(self.__pydantic_extra__ or {})


class ObserverOptions(Frozen):
    """How the observer runs.

    `load` says where the load on the joint is known from: "joint_torque" = a torque sensor at the joint (external
    moment, positive along +q_out), "motor_torque" = the motor's torque through the drive's ratio (M = -tau R/r),
    "both_encoders" = the load under which the joint encoder reads what it reads (the joint position is then an
    input, not a test), "none" = the joint moves freely.
    """

    input_filter_Hz: NonNegative = Field(0.0, description="causal low-pass on angle and load; 0 = off")
    max_pieces: Annotated[int, Field(ge=16, le=4096)] = Field(
        192, description="memory of one wrap, in straight pieces"
    )
    merge_tolerance: Positive = Field(
        1e-6, description="relative error of tension allowed when pieces are merged"
    )
    load: Literal["joint_torque", "motor_torque", "both_encoders", "none"] = Field(
        "joint_torque", description="where the load on the joint is known from"
    )
    past_tension_min: Annotated[float, Field(gt=0, le=1)] | None = Field(
        None, description="for bounds: least T/T0 that any cable has borne since it was pretensioned"
    )
    past_tension_max: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = Field(
        None, description="for bounds: greatest T/T0 since then"
    )


class Limits(Frozen):
    """What joint and motor may be asked for; used by the gate, by `plan_erase`, by proposed experiments."""

    joint_torque_max_Nm: Positive | None = Field(None, description="greatest moment on the joint, either way")
    motor_torque_max_Nm: Positive | None = Field(None, description="greatest torque of the motor, either way")
    joint_position_min_rad: Finite | None = Field(None, description="least joint angle")
    joint_position_max_rad: Finite | None = Field(None, description="greatest joint angle")
    motor_velocity_max_rad_s: Positive | None = Field(
        None, description="greatest speed of the motor, either way"
    )
    motor_position_min_rad: Finite | None = Field(None, description="least motor angle")
    motor_position_max_rad: Finite | None = Field(None, description="greatest motor angle")

    @model_validator(mode="after")
    def _least_below_greatest(self) -> Self:
        for what in ("joint_position", "motor_position"):
            low, high = getattr(self, f"{what}_min_rad"), getattr(self, f"{what}_max_rad")
            if low is not None and high is not None and not low < high:
                raise ValueError(f"{what}_min_rad {low:g} < {what}_max_rad {high:g} is accepted")
        return self
