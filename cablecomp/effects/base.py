"""The contract of an effect: one file, one physics, one neutral value that switches it off.

An effect says in plain words what it is, names its parameters, and gives a `Change` to the drive. Most are a
compiled *term* (`compiled_term.py`), a small function of three records, all by name: it reads the context of
the solve (angles, load, tensions, time, temperature, other channels) and adds to it (moment taken from the load
path, cable length, pretension and stiffness factors, encoder reading), with parameters and a state of its own.
A few change the law of friction or the cable path itself. The kernel only sums them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig, ratios_to_last
from cablecomp.mechanics.change import Change

__all__ = ["Change", "Effect", "Late", "Parameter", "Role"]

Floats = NDArray[np.float64]
Role = Literal[
    "amount",
    "shape",
    "phase",
    "instant",
    "duration",
    "curve",
    "step",
    "step size",
    "begin",
    "cycle",
    "cycle start",
    "reference",
    "length",
    "presliding",
    "place",
    "tilt",
    "bend",
    "slack",
]
"""An amount; or how: the phase of a wave [rad], which makes a pair with the amount; the instant of an event [s], how
long it takes [s], how curved, when a further step comes [s] and how large it is; when a slow course began [s]; how what
comes again and again does, and when once [s]; the reference of what the law reads; the length of cable in a path [m];
the turn in which friction builds up [rad]; a place on a drum [rad]; by how much another channel turns the joint; how
much what is read grows with itself, up to which reading nothing happens; any other shape."""


def never(_values: Mapping[str, float], _on_high: bool) -> bool:
    """`Parameter.is_another` of a shape that is always the effect's own."""
    return False


def at_most(_values: Mapping[str, float], on_high: bool) -> bool:
    """`Parameter.is_another` where it ends on `high`, whatever the effect's other values are."""
    return on_high


@dataclass(frozen=True)
class Parameter:
    """One parameter: name with unit, the value that switches the effect off, and where it plausibly lies.

    `low`..`high` is the prior range for fitting (log-spaced where `log`), in units of `scale(config)` where a scale is
    given. `role`: whether it says how much (an amount) or how, and then what of (`Role`). `held`: a diagnosis leaves it
    where it starts, because another parameter takes its part. `minimum`..`maximum`, in the parameter's unit, is what
    the law can take; beyond it a configuration is refused. `omitted`: its value where a configuration leaves it out
    (None: it has to be given). `of_load`: it says nothing where no load is recorded. `of`: the amount whose shape it
    is, where an effect has several. `tries`: values at which a diagnosis asks for a shape that it leaves out at first
    (a begin's count from the first of all samples, a bend's are over the channel's largest reading, a slack's shares of
    it, or half of what a channel that it needs covers, others' are in units of `scale(config)`); of an event's course
    it asks by itself. `reach`: times by which a fit of a log-spaced shape may leave low..high. `is_another`: whether,
    by the effect's values and by whether it ended on `high`, another effect is the better word, one that has no name
    here if `another_is_unlisted`; `least_is_another`: whether that is so below `low`, where other shapes are the plain
    law. `of_cable_l`: whether it is cable l's, of which an open circuit has none: never, below zero, or always.
    `of_known_drive`: beside a drive known by order of magnitude it, and what is `of` it, are not asked for.
    `of_motor_load`: it is asked for only where the load is read at the motor, `of_both_ways`: only where it takes both
    signs. `points`: at how many places of a log-spaced range a diagnosis asks. `goes_on`: what it does grows without
    end, so that a diagnosis keeps it only where it is told from none. `by_itself`: an amount that is asked for without
    the effect's others. `per_reading`: low..high are what the largest reading of the channel that the effect reads does
    (of a slack: shares of that reading): what a unit of it means, no configuration tells. `needs`: a channel without
    which it says nothing. `within_recording`: a time that a diagnosis asks up to the longest recording's; from there on
    what follows is a drift, whatever it follows, and another effect the better word. `of_speed`: a shape that goes with
    speed, asked for also where every sample is run.
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    text: str
    log: bool = False
    role: Role = "amount"
    held: bool = False
    scale: Callable[[JointConfig], float] | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    omitted: float | None = None
    of_load: bool = False
    of: str = ""
    tries: tuple[float, ...] = ()
    reach: float = 30.0
    is_another: Callable[[Mapping[str, float], bool], bool] = never
    another_is_unlisted: bool = False
    least_is_another: bool = False
    of_cable_l: Literal["never", "below zero", "always"] = "never"
    of_known_drive: bool = False
    of_motor_load: bool = False
    of_both_ways: bool = False
    points: int = 3
    goes_on: bool = False
    by_itself: bool = False
    per_reading: bool = False
    needs: str = ""
    within_recording: bool = False
    of_speed: bool = False

    @property
    def shape(self) -> bool:
        """Whether it says how, not how much."""
        return self.role != "amount"

    @property
    def is_share(self) -> bool:
        """Whether it is a shape that says what part of something, from none to all."""
        return self.shape and self.unit == "-" and self.minimum >= 0.0 and self.maximum <= 1.0

    def middle(self) -> float:
        """Middle of low..high (geometric where `log`)."""
        return math.sqrt(self.low * self.high) if self.log else 0.5 * (self.low + self.high)

    def bounds(self, config: JointConfig) -> tuple[float, float]:
        """Prior range (low, high) for this joint, in the parameter's unit."""
        unit = 1.0 if self.scale is None else self.scale(config)
        return self.low * unit, self.high * unit


class Late(NamedTuple):
    """By how much [s] channels are stamped late against the motor's (negative: early): the joint encoder's, growing by
    `drift` in a second since `since_s` (NaN: the recording's first sample), and the torque's."""

    joint_s: float
    drift: float
    since_s: float
    load_s: float


LEAST_PRETENSION = 0.05
"""Share of T0 below which no law of the pretension is followed further."""


def pretension_moment(config: JointConfig) -> float:
    """R T0 of the output stage [N m]: the natural unit of load."""
    return config.drive.stage[-1].pretension_moment_Nm


def per_moment(config: JointConfig) -> float:
    """1/(R T0) of the output stage [1/(N m)]."""
    return 1.0 / pretension_moment(config)


def input_moment(config: JointConfig) -> float:
    """r T0 of the input stage [N m]: the natural unit of torque at the motor."""
    return config.drive.stage[0].input_radius_m * config.drive.stage[0].pretension_N


def drum_radius(config: JointConfig) -> float:
    """R of the output stage [m]."""
    return config.drive.stage[-1].output_radius_m


def pretension(config: JointConfig) -> float:
    """T0 of the output stage [N]."""
    return config.drive.stage[-1].pretension_N


def cable_strain(config: JointConfig) -> float:
    """T0/EA of the output stage [-]: the strain under which its cable stands."""
    return config.drive.stage[-1].pretension_N / config.drive.stage[-1].EA_N


def wrap_deflection(config: JointConfig) -> float:
    """T0/(EA mu_eff) over stages, at the output [rad]: the thesis's unit of deflection, (3-17), (4-18)."""
    stages = config.drive.stage
    total = 0.0
    for ratio, stage in reversed(list(zip(ratios_to_last(stages), stages, strict=True))):
        per_mu = 1.0 / stage.mu_output + stage.ratio / stage.mu_input
        total += ratio * stage.pretension_N / stage.EA_N * per_mu
    return total


def wrap_compliance(config: JointConfig) -> float:
    """T0/(EA mu_eff) per R T0 [rad/(N m)]: the thesis's unit of deflection over that of load."""
    return wrap_deflection(config) / pretension_moment(config)


@dataclass(frozen=True)
class Restated:
    """The same cable described from elsewhere: the effect's values there, and factors on the drive's own."""

    values: Mapping[str, float]
    pretension: float = 1.0
    EA: float = 1.0
    mu: float = 1.0


@dataclass(frozen=True)
class Effect:
    """Physics beyond the thesis's drive, as one term of the joint model.

    `id` is its public name; `statement` says in plain words what happens; `equation` and `source` give the
    law; `acts_through` are the covariates in which its mismatch shows, best first (`other` stands for the
    channel it reads); `bounded` is true where it preserves the order of profiles: guaranteed bounds stay
    guaranteed.
    """

    id: str
    statement: str
    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    acts_through: tuple[str, ...]
    bounded: bool
    change: Callable[[Mapping[str, float], JointConfig], Change]
    texts: tuple[str, ...] = field(default=())
    """Names of parameters that are text, such as the channel that loads the cable."""
    unbounded_by: tuple[str, ...] = ()
    """Parameters with which, other than neutral, it does not preserve that order all the same."""
    unbounded_with: tuple[str, ...] = ()
    """Where the load is read from (`[observer] load`), if it does not preserve that order then."""
    texts_optional: bool = False
    """They may be left out, and parameters of the role `tilt` then say nothing."""
    channel_ends: str = ""
    """How names of channels end of which a diagnosis asks it: their unit, where it reads no other."""
    needs: tuple[str, ...] = field(default=())
    """Channels without which no recording tells it: an output that has to be measured, an input that has to change."""
    rates: bool = False
    """Its law knows rates within a stroke: a fit has to run it on every sample, not on rows thinned by travel."""
    felt_by_motor: bool = False
    """It turns the joint or holds it, so that the motor feels it: a load that is read at the motor holds it already,
    and the cables' tensions do not change by it."""
    pliant: bool = False
    """It is a mere curve over the load, or a step: it bends to what other effects' forms leave, too."""
    in_series: bool = False
    """It gives way to the load in series with the joint: of several that do, recordings show one curve."""
    saturates: bool = False
    """Twice the amount does far less than twice as much, over decades of it."""
    posture: bool = False
    """How much of it there is may change with how the cable's path lies (a wrist's turn, a sheath's bend)."""
    at_pretension: Callable[[Mapping[str, float], float], Restated] | None = None
    """Where its law counts from T0: the same law with T0 this many times as high."""
    at_reference: Callable[[Mapping[str, float], float], Restated] | None = None
    """Where it has a reference: the same law with this one."""
    steps: bool = False
    """Among its shapes is a plain step of the joint, which a step of the encoder's zero cannot be told from."""
    late: Callable[[Mapping[str, float]], Late] | None = None
    """By how much channels come late, where it is nothing else: a recording that is whole is read in time instead of
    running its term (`estimation/in_time.py`)."""
    tries: tuple[Mapping[str, float], ...] = ()
    """Shapes that a diagnosis leaves out at first and asks for together, in units of their `scale(config)`; with them
    one that has to be given, which is asked for without them as well."""
    flag: str = ""
    """What a joint does that has it, in a list of many joints, where that changes from night to night."""
    rank: int = 0
    """Terms run in rising rank; a term that sees the sum of the others (a delay) ranks last."""

    @cached_property
    def by_name(self) -> Mapping[str, Parameter]:
        """Its parameters by their names."""
        return {p.name: p for p in self.parameters}

    @cached_property
    def amounts(self) -> tuple[str, ...]:
        """Names of the parameters that say how much of it there is."""
        return tuple(p.name for p in self.parameters if not p.shape)

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return self.by_name[name]

    def covariates(self, channel: str) -> tuple[str, ...]:
        """`acts_through` with the channel that it reads in place of `other`, as `other:<name>`."""
        other = f"other:{channel.removeprefix('other_')}" if channel else ""
        named = (other if name == "other" else name for name in self.acts_through)
        return tuple(name for name in named if name)

    def of_role(self, role: Role) -> Parameter | None:
        """Its first parameter of that role, if any."""
        return next((p for p in self.parameters if p.role == role), None)

    def neutral(self) -> dict[str, float]:
        """The values that switch the effect off (shapes at the middle of their range); what may be left out is."""
        given = [p for p in self.parameters if p.omitted is None]
        return {p.name: (p.middle() if p.shape else p.neutral) for p in given} or {
            p.name: p.neutral for p in self.parameters if not p.shape
        }
