"""Effects on the cable itself: its stiffness, its length, its pretension."""

from __future__ import annotations

import math
from collections.abc import Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter


def _stiffening(build: Build, p: Mapping[str, float]) -> None:
    build.cables["stiffening"] = p["stiffening"]


NONLINEAR_CABLE = EffectKind(
    "nonlinear_cable",
    "Every element stiffens as it is pulled: dT/dε = EA (1 + b (T/T0 − 1)).",
    (Parameter("stiffening", "b", low=-0.6, high=0.95),),
    ("load",),
    _stiffening,
)


def _strand(build: Build, p: Mapping[str, float]) -> None:
    build.cables["plays"] = 1
    build.plays["compliance"][:, 0] = p["fraction"] * build.cables["free_m"] / build.cables["EA"]
    build.plays["radius"][:, 0] = p["yield_N"]


STRAND_FRICTION = EffectKind(
    "strand_friction",
    "The free span holds a lumped extension that follows the tension only outside a play: e = fraction · "
    "L/EA · play(T − T0), radius yield_N.",
    (
        Parameter("fraction", "extra stretch over elastic stretch of the free span", low=0.0, high=10.0),
        Parameter("yield_N", "radius of the play in tension", low=0.0),
    ),
    ("load_direction", "reversal"),
    _strand,
)


def _relaxation(build: Build, p: Mapping[str, float]) -> None:
    build.surround["relax_fraction"] = p["fraction"]
    build.surround["relax_time_s"] = p["time_constant_s"]


PRETENSION_RELAXATION = EffectKind(
    "pretension_relaxation",
    "Every element creeps: its unstressed length grows so that T0(t) = T0 (1 − a ln(1 + t/t_c)), t from "
    "the recording's first sample; in an open circuit the preload falls by that factor.",
    (
        Parameter("fraction", "a", low=-0.5, high=0.5),
        Parameter("time_constant_s", "t_c", 10.0, 1e-3),
    ),
    ("time",),
    _relaxation,
)


def _thermal(build: Build, p: Mapping[str, float]) -> None:
    build.surround["thermal_per_K"] = p["coefficient_per_K"]
    build.surround["thermal_ref"] = p["reference_degC"]


THERMAL_PRETENSION = EffectKind(
    "thermal_pretension",
    "Every element takes the same thermal strain against the frame, so that what sticks gains T0 k (ϑ − "
    "ϑ_ref) everywhere: T0(ϑ) = T0 (1 + k (ϑ − ϑ_ref)); in an open circuit the preload follows that "
    "factor.",
    (
        Parameter("coefficient_per_K", "k", low=-0.2, high=0.2),
        Parameter("reference_degC", "ϑ_ref", 20.0),
    ),
    ("temperature",),
    _thermal,
)


def _slip(build: Build, p: Mapping[str, float]) -> None:
    build.surround["slip_m"], build.surround["slip_time_s"] = p["slip_m"], p["time_s"]
    build.surround["slip_behind_wrap"] = p["behind_wrap"]


CLAMP_SLIP = EffectKind(
    "clamp_slip",
    "Cable h gains length at once. The clamp sits at the tensioner in the free span, so that the step "
    "reaches the joint; with behind_wrap = 1 it is the output termination, whose wrap holds most of the "
    "step back.",
    (
        Parameter("slip_m", "length released", low=0.0, high=0.1),
        Parameter("time_s", "when"),
        Parameter("behind_wrap", "1: at the output termination, behind the wrap", 0.0, 0.0, 1.0),
    ),
    ("time",),
    _slip,
)


def _break(build: Build, p: Mapping[str, float]) -> None:
    build.surround["break_fraction"], build.surround["break_time_s"] = p["fraction"], p["time_s"]


STRAND_BREAK = EffectKind(
    "strand_break",
    "Wires of cable h break along its length: its EA falls by the fraction at that instant, its stretch "
    "stays.",
    (
        Parameter("fraction", "share of EA lost", low=0.0, high=0.95),
        Parameter("time_s", "when"),
    ),
    ("time",),
    _break,
)


def _in_runout(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        if c["shaft_in"] == 0:
            c["in_runout_m"], c["in_runout_phase"] = p["eccentricity_m"], p["phase_rad"]


INPUT_PULLEY_RUNOUT = EffectKind(
    "input_pulley_runout",
    "The input pulley runs out of true: it winds r q + e (sin(q + φ) − sin φ).",
    (
        Parameter("eccentricity_m", "e", low=-0.01, high=0.01),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("motor_angle",),
    _in_runout,
    listed=False,
    nearest=("pulley_runout",),
)


def _out_runout(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        if c["shaft_out"] == build.output:
            c["runout_m"], c["runout_phase"] = p["eccentricity_m"], p["phase_rad"]


PULLEY_RUNOUT = EffectKind(
    "pulley_runout",
    "The output pulley runs out of true: it winds R q + e (sin(q + φ) − sin φ) for both cables, with that "
    "lever arm.",
    (
        Parameter("eccentricity_m", "e", low=-0.01, high=0.01),
        Parameter("phase_rad", "φ", 0.0, -2 * math.pi, 2 * math.pi),
    ),
    ("joint_angle", "motor_angle"),
    _out_runout,
)


def _climb(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        if c["shaft_out"] == build.output:
            c["climb_m_per_rad"] = p["radius_m_per_rad"]


GROOVE_CLIMB = EffectKind(
    "groove_climb",
    "The cables climb the groove's flank as the joint turns: the output radius is R + g q.",
    (Parameter("radius_m_per_rad", "g", low=-0.01, high=0.01),),
    ("joint_angle", "motor_angle"),
    _climb,
    listed=False,
    nearest=("pulley_runout",),
)


def _flange(build: Build, p: Mapping[str, float]) -> None:
    _climb(build, p)
    for c in build.cables:
        if c["shaft_out"] == build.output:
            c["climb_beyond"], c["climb_from"] = 1, p["from_rad"]


FLANGE_CLIMB = EffectKind(
    "flange_climb",
    "From some joint angle on the cables climb the drum's flange: the output radius is R + g max(q − q_f, 0).",
    (
        Parameter("radius_m_per_rad", "g", low=-0.01, high=0.02),
        Parameter("from_rad", "q_f", 0.0),
    ),
    ("joint_angle", "motor_angle"),
    _flange,
    listed=False,
    nearest=("pulley_runout",),
)

KINDS = (
    NONLINEAR_CABLE,
    STRAND_FRICTION,
    PRETENSION_RELAXATION,
    THERMAL_PRETENSION,
    CLAMP_SLIP,
    STRAND_BREAK,
    PULLEY_RUNOUT,
    INPUT_PULLEY_RUNOUT,
    GROOVE_CLIMB,
    FLANGE_CLIMB,
)
