"""Unseen inertia in other forms: at the end of a flexible link, changing with the joint's angle, in part a liquid's, on
two springs, behind a damper alone, on a base that turns."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build, Tail
from firmware_sim.plant.columns import OTHER, TIME, UNSEEN_TORQUE
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import second_rate
from firmware_sim.plant.records import Floats

_INERTIA = Parameter("inertia_kgm2", "J", low=0.0, neutral=0.0)


def _swinger(build: Build, inertia: float, w: float, ratio: float) -> None:
    """Hang an inertia on the pulley that swings at w, damped by that ratio; none of none."""
    if inertia > 0.0:
        build.tails.append(Tail(inertia, inertia * w**2, 2.0 * ratio * inertia * w, branch=True))


def _flexible(build: Build, p: Mapping[str, float]) -> None:
    if p["inertia_kgm2"] > 0.0:
        build.tails.append(
            Tail(p["inertia_kgm2"], p["stiffness_Nm_per_rad"], p["damping_Nms_per_rad"], branch=True)
        )


FLEXIBLE = form(
    "inertial_load",
    "flexible_link",
    "The inertia hangs on the pulley through a spring and a damper and swings after it; sensors sit on the pulley.",
    (
        _INERTIA,
        Parameter("stiffness_Nm_per_rad", "of the link", low=1e-6),
        Parameter("damping_Nms_per_rad", "of the link", 0.0, 0.0),
    ),
    ("acceleration",),
    _flexible,
)


def _folding(build: Build, p: Mapping[str, float]) -> None:
    shaft = build.shafts[build.output]
    shaft["inertia"] += p["inertia_kgm2"]
    shaft["inertia_swing"], shaft["inertia_phase"] = p["swing"], p["phase_rad"]


FOLDING = form(
    "inertial_load",
    "folding_arm",
    "An arm that folds as the joint turns: J (1 + w cos(q − φ)), with the torque −J′ q̇²/2 that goes with it.",
    (_INERTIA, Parameter("swing", "w", 0.5, -0.95, 0.95), Parameter("phase_rad", "φ", 0.0)),
    ("acceleration", "joint_angle"),
    _folding,
)


def _liquid(build: Build, p: Mapping[str, float]) -> None:
    sways = p["share"] * p["inertia_kgm2"]
    build.shafts[build.output]["inertia"] += p["inertia_kgm2"] - sways
    _swinger(build, sways, p["sways_rad_s"], p["damping_ratio"])


LIQUID = form(
    "inertial_load",
    "half_filled",
    "A vessel half filled: a share of the inertia sways in it at w, slowly, and follows the joint late.",
    (
        _INERTIA,
        Parameter("share", "of the inertia that sways", 0.4, 0.0, 0.95),
        Parameter("sways_rad_s", "w", 3.0, 1e-3),
        Parameter("damping_ratio", "of the swaying", 0.3, 0.0),
    ),
    ("acceleration",),
    _liquid,
)


def _on_two_springs(build: Build, p: Mapping[str, float]) -> None:
    quick, w = p["share"] * p["inertia_kgm2"], p["swings_rad_s"]
    _swinger(build, p["inertia_kgm2"] - quick, w, p["damping_ratio"])
    _swinger(build, quick, w * p["apart"], p["damping_ratio"])


TWO_MODES = form(
    "inertial_load",
    "two_modes",
    "A link that swings in two modes: a share of the inertia at w, the rest at a multiple of it.",
    (
        _INERTIA,
        Parameter("share", "of the inertia that swings in the quicker mode", 0.5, 0.0, 1.0),
        Parameter("swings_rad_s", "w", 6.0, 1e-3),
        Parameter("apart", "the quicker mode's pulsation over w", 4.0, 1.0),
        Parameter("damping_ratio", "of either", 0.3, 0.0),
    ),
    ("acceleration",),
    _on_two_springs,
)


def _dragged_along(build: Build, p: Mapping[str, float]) -> None:
    follows = p["share"] * p["inertia_kgm2"]
    build.shafts[build.output]["inertia"] += p["inertia_kgm2"] - follows
    if follows > 0.0:
        build.tails.append(Tail(follows, 1e-6 * follows, follows / p["lag_s"], branch=True))


DRAGGED = form(
    "inertial_load",
    "dragged_along",
    "A share of the inertia follows through a damper alone, as a wheel on a fluid coupling: J_s ẍ = d (q̇ − ẋ), "
    "d = J_s/t.",
    (
        _INERTIA,
        Parameter("share", "of the inertia that is dragged along", 0.6, 0.0, 1.0),
        Parameter("lag_s", "t", 0.2, 1e-4),
    ),
    ("acceleration",),
    _dragged_along,
)


def _turning_base(build: Build, p: Mapping[str, float]) -> None:
    build.shafts[build.output]["inertia"] += p["inertia_kgm2"]
    coupled = p["inertia_kgm2"] * p["coupling"]

    def fill(inputs: Floats) -> None:
        inputs[:, UNSEEN_TORQUE] -= coupled * second_rate(inputs[:, OTHER], inputs[:, TIME])

    build.schedules.append(fill)


TURNING_BASE = form(
    "inertial_load",
    "turning_base",
    "An inertia on a base that a neighbouring joint turns: the cables carry M − J (q̈ + c d²other_1/dt²), c the cosine "
    "between the two axes.",
    (_INERTIA, Parameter("coupling", "c", 1.0, -2.0, 2.0)),
    ("acceleration", "other:1"),
    _turning_base,
)

KINDS: tuple[EffectKind, ...] = (FLEXIBLE, FOLDING, LIQUID, TWO_MODES, DRAGGED, TURNING_BASE)
