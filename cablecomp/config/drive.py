"""The cable drive in a joint configuration: circuit and stages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from cablecomp.config.base import Frozen, listed

Length = Annotated[float, Field(gt=0, le=1e4)]
Force = Annotated[float, Field(gt=0, le=1e8)]
Friction = Annotated[float, Field(gt=0, le=1e3)]
Angle = Annotated[float, Field(gt=0, le=1e5)]
Stiffness = Annotated[float, Field(gt=0, le=1e12)]
"""Each up to what the equations can carry: far beyond any drive; further up they lose their digits or overflow."""


class Stage(Frozen):
    """One cable stage.

    Radii are effective: bare pulley radius + half the cable diameter. A wrap is the angle from where the cable
    leaves the pulley at position zero to where it is fixed on it, whole turns included (2.5 turns = 15.708 rad);
    cable that only passes is none. In a closed circuit both cables have the same wraps.
    """

    output_radius_m: Length = Field(description="effective radius of the output pulley, R")
    input_radius_m: Length = Field(description="effective radius of the input pulley, r")
    free_length_m: Length = Field(
        description="cable between the pulleys that touches nothing, tangent to tangent"
    )
    EA_N: Stiffness = Field(description="axial stiffness of the cable: load per strain")
    pretension_N: Force = Field(description="tension T0 of each cable at rest without load")
    mu_output: Friction = Field(description="friction coefficient cable on output pulley")
    mu_input: Friction = Field(description="friction coefficient cable on input pulley")
    wrap_output_rad: Angle = Field(description="wrap on the output pulley at position zero")
    wrap_input_rad: Angle = Field(description="wrap on the input pulley at position zero")
    breaking_force_N: Force | None = Field(
        None, description="where the cable breaks; above it a sample is refused"
    )

    @property
    def ratio(self) -> float:
        """Output angle over input angle, r/R."""
        return self.input_radius_m / self.output_radius_m

    @property
    def pretension_moment_Nm(self) -> float:
        """R T0, the natural unit of load."""
        return self.output_radius_m * self.pretension_N


def ratios_to_last(stages: Sequence[Stage]) -> list[float]:
    """Ratio from every stage's output axis to the last one's, N_ik = product over j = i+1..k of r_j/R_j (thesis
    5-22)."""
    ratios = [1.0]
    for stage in reversed(stages[1:]):
        ratios.insert(0, ratios[0] * stage.input_radius_m / stage.output_radius_m)
    return ratios


class Drive(Frozen):
    """The cable drive, input side first.

    A closed circuit has two cables, h and l, that pull against each other; an open one has a single cable that a
    load or a spring keeps taut. Stages in series follow one another; parallel ones share the load (Snow's kinds
    2 and 1).
    """

    circuit: Literal["open", "closed"] = Field(description="one cable, or two that pull against each other")
    arrangement: Literal["parallel", "series"] = Field("series", description="of several stages")
    stage: Annotated[tuple[Stage, ...], listed(16)] = Field(min_length=1)

    @property
    def ratio(self) -> float:
        """Joint angle over motor angle of the rigid drive: product of r/R over the stages (thesis, 6-2)."""
        return math.prod(stage.ratio for stage in self.stage)

    @property
    def preload_Nm(self) -> float:
        """Torque (at the input pulley) by which an open circuit's pretension pulls at the motor: r T0, for the external
        moment is counted from the pretensioned state; 0 in a closed circuit, whose cables balance."""
        first = self.stage[0]
        return first.input_radius_m * first.pretension_N if self.circuit == "open" else 0.0
