"""What may stand behind the thesis's open questions: every effect of the catalogue, sized for its bench.

Effects are named one by one, as how much of each there may have been is a fact of that bench, not of the effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.effects.base import drum_radius, pretension, pretension_moment

Entry = tuple[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Course:
    """Instants of one bench cycle, s: ramp up from `up`, hold from `held`, ramp back from `down`, rest from
    `back` to `end`.
    """

    up: float
    held: float
    down: float
    back: float
    end: float


@dataclass(frozen=True)
class Case:
    """One size of a suspect on one bench cycle: effects to switch on, and what is not as the evaluation has it.

    `EA`, `mu`: factors on the true drive. `reading_Nm`: load shown too high in the direction in which it last
    moved (below 0: shown lagging, as behind a bearing that holds some of it back).
    """

    effects: tuple[Entry, ...] = ()
    EA: float = 1.0
    mu: float = 1.0
    reading_Nm: float = 0.0

    def with_case(self, other: Case) -> Case:
        """Both together."""
        return Case(
            self.effects + other.effects,
            self.EA * other.EA,
            self.mu * other.mu,
            self.reading_Nm + other.reading_Nm,
        )


Build = Callable[[float, JointConfig, Course], Case]
"""Size, the bench's joint at this cycle's pretension, the cycle -> what to simulate."""


@dataclass(frozen=True)
class Suspect:
    """A possible cause. `sizes` are tried; `plausible` says, with its source, what is likely on that bench."""

    id: str
    label: str
    unit: str
    sizes: tuple[float, ...]
    build: Build
    plausible: str


REFERENCE_N = 24.154
"""Pretension at which sizes are stated (5.43 lbf, trials 141 to 145); laws of the cable follow from there."""


def suspects() -> tuple[Suspect, ...]:
    """All of them: the catalogue's effects, and the bearing that holds the shaft of the torque sensor."""
    return (*_friction(), *_cable(), *_load_path(), *_rest())


def _sizes(low: float, high: float, count: int = 6, both: bool = False) -> tuple[float, ...]:
    positive = tuple(low * (high / low) ** (k / (count - 1)) for k in range(count))
    return positive + tuple(-value for value in positive) if both else positive


def _friction() -> tuple[Suspect, ...]:
    return (
        Suspect(
            "viscous_slip", "friction in the wraps grows with slip speed", "EA/R s/rad", _sizes(0.03, 3.0, 9),
            lambda x, joint, course: _one("viscous_slip", coefficient_Ns_per_m_rad=x * _diffusion(joint)),
            "no independent value; the thesis suspects it (3.3.2)",
        ),
        Suspect(
            "pressure_dependent_friction", "mu falls with the cable's pressure, mu = mu0 (T/T0)^-n", "n",
            _sizes(0.03, 0.5, 6, both=True), _pressure,
            "1/3 for elastic contact of a soft coat (Bowden and Tabor 1950)",
        ),
        Suspect(
            "position_dependent_friction", "the groove is rougher on one side", "mu",
            _sizes(0.05, 0.5, 4, both=True),
            lambda x, joint, course: _one("position_dependent_friction", amplitude=x, phase_rad=0.5 * math.pi),
            "mu varied by 30 % from trial to trial (6.4)",
        ),
        Suspect(
            "routing_friction", "the cable rubs on something between the pulleys", "mu Theta",
            _sizes(0.003, 0.1, 5),
            lambda x, joint, course: _one("routing_friction", mu_angle=x, arc_length_m=0.01),
            "none: the span is free",
        ),
    )  # fmt: skip


def _cable() -> tuple[Suspect, ...]:
    return (
        Suspect(
            "nonlinear_cable", "the strand stiffens as it is pulled, EA(T) = EA (1 + b (T/T0 - 1))", "b",
            _sizes(0.02, 0.3, 9, both=True), _stiffening,
            "EA stated to 4 % (A.1) over a range not stated",
        ),
        Suspect(
            "strand_friction", "wires rub inside the cable", "span stretch",
            _sizes(0.01, 0.5, 5),
            lambda x, joint, course: _one("strand_friction", fraction=x, yield_N=0.1 * REFERENCE_N),
            "a few % in spiral strands",
        ),
        Suspect(
            "pretension_relaxation", "the pretension fades with the logarithm of time", "T0 per factor e",
            _sizes(5e-4, 1e-2, 4),
            lambda x, joint, course: _one("pretension_relaxation", fraction=x, time_constant_s=10.0),
            "open circuit: none, the pretension is a hanging weight",
        ),
        Suspect(
            "thermal_pretension", "cable and frame expand differently; 1 K in a cycle", "1/K",
            _sizes(1e-3, 2e-2, 4, both=True),
            lambda x, joint, course: _one("thermal_pretension", coefficient_per_K=x, reference_degC=20.0),
            "open circuit: none, the pretension is a hanging weight",
        ),
        Suspect(
            "clamp_slip", "a crimp slips in the hold", "m", _sizes(1e-6, 1e-4, 4),
            lambda x, joint, course: _one("clamp_slip", slip_m=x, time_s=0.5 * (course.held + course.down)),
            "not in every trial",
        ),
        Suspect(
            "strand_break", "wires break in the hold", "EA", _sizes(1e-3, 3e-2, 4),
            lambda x, joint, course: _one("strand_break", fraction=x, time_s=0.5 * (course.held + course.down)),
            "not in every trial",
        ),
    )  # fmt: skip


def _load_path() -> tuple[Suspect, ...]:
    bearing = "0.05 % by M = 0.0015 F d/2 (bearing makers' estimate; d 10 mm), the thesis's guess (3.3.4)"
    return (
        Suspect(
            "bearing_friction", "the output bearing holds back", "R T0", _sizes(5e-4, 4e-2, 7),
            lambda x, joint, course: _one(
                "bearing_friction", torque_Nm=x * _moment(joint), load_coefficient=0.0, presliding_rad=1e-4
            ),
            bearing,
        ),
        Suspect(
            "sensor bearing", "the bearing beside the torque sensor, corrected by a constant: too much, or (below 0) "
            "too little", "R T0", _sizes(5e-4, 4e-2, 7, both=True),
            lambda x, joint, course: Case(reading_Nm=x * _moment(joint)),
            bearing,
        ),
        Suspect(
            "series_compliance", "what is left after the sensor's twist is taken out", "rad/(N m)",
            _sizes(1e-4, 2e-3, 4),
            lambda x, joint, course: _one("series_compliance", compliance_rad_per_Nm=x),
            "a few % of 0.02 rad/(N m), the sensor's own (A.3)",
        ),
        Suspect(
            "termination_backlash", "clearance in a hub or crimp", "rad", _sizes(1e-4, 3e-3, 4),
            lambda x, joint, course: _one("termination_backlash", gap_rad=x),
            "none: the cable stays taut",
        ),
        Suspect(
            "crosstalk", "a torque that the sensor does not see drifts up over the cycle", "R T0",
            _sizes(2e-3, 2e-2, 4, both=True),
            lambda x, joint, course: _one(
                "crosstalk", channel="other_1", load_coefficient=x * pretension_moment(joint)
            ),
            "0.5 %, the sensor's resolution",
        ),
    )  # fmt: skip


def _rest() -> tuple[Suspect, ...]:
    return (
        Suspect(
            "pulley_runout", "the pulley sits off centre", "R", _sizes(2e-4, 5e-3, 4, both=True),
            lambda x, joint, course: _one(
                "pulley_runout", eccentricity_m=x * drum_radius(joint), phase_rad=0.0
            ),
            "0.1 %, a good lathe",
        ),
        Suspect(
            "gravity_load", "the pulley is out of balance", "R T0", _sizes(2e-3, 5e-2, 4, both=True),
            lambda x, joint, course: _one(
                "gravity_load", moment_Nm=x * pretension_moment(joint), phase_rad=0.0
            ),
            "small: a turned disc",
        ),
        Suspect(
            "inertial_load", "the water's and the pulley's inertia", "kg m2", (1e-3, 1e-2),
            lambda x, joint, course: _one("inertial_load", inertia_kgm2=x),
            "1e-2 at most",
        ),
        Suspect(
            "clock_skew", "the encoder is read late", "s", (0.09, -0.09),
            lambda x, joint, course: _one("clock_skew", delay_s=x),
            "one sample of 11 Hz",
        ),
    )  # fmt: skip


def _one(name: str, **parameters: Any) -> Case:
    return Case(((name, parameters),))


def _diffusion(joint: JointConfig) -> float:
    """EA/R: the coefficient at which stretch diffuses over one radian in one second; N/m."""
    return joint.drive.stage[-1].EA_N / drum_radius(joint)


def _moment(joint: JointConfig) -> float:
    """R T0 at the reference pretension, N m: a bearing does not know what cable was put on."""
    return drum_radius(joint) * REFERENCE_N


def _stiffening(b: float, joint: JointConfig, course: Course) -> Case:
    """One cable for all pretensions: EA(T) = EA (1 + b (T/T_ref - 1))."""
    over = pretension(joint) / REFERENCE_N
    factor = 1.0 + b * (over - 1.0)
    return Case((("nonlinear_cable", {"stiffening": b * over / factor}),), EA=factor)


def _pressure(n: float, joint: JointConfig, course: Course) -> Case:
    """One cable for all pretensions: mu(T) = mu (T/T_ref)^-n."""
    return Case(
        (("pressure_dependent_friction", {"exponent": n}),), mu=(pretension(joint) / REFERENCE_N) ** -n
    )
