"""Effects in the load path: torques that act on the output pulley beside the measured moment."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import MIN_PRESLIDING_RAD, Build, Tail
from firmware_sim.plant.effects.base import EffectKind, Parameter


def _bearing(build: Build, p: Mapping[str, float]) -> None:
    shaft = build.shafts[build.output]
    shaft["coulomb_Nm"] = p["torque_Nm"]
    shaft["load_coefficient"] = p["load_coefficient"]
    shaft["presliding"] = max(p["presliding_rad"], MIN_PRESLIDING_RAD)


BEARING_FRICTION = EffectKind(
    "bearing_friction",
    "The output bearing holds back with up to τ_b = torque_Nm + load_coefficient R (T_h + T_l): a spring "
    "that yields, stretched by presliding_rad when it does.",
    (
        Parameter("torque_Nm", "friction torque without load", low=0.0),
        Parameter("load_coefficient", "growth with the radial load", 0.0, 0.0, 1.0),
        Parameter("presliding_rad", "turn within which friction builds up", 1e-5, 0.0, 0.1),
    ),
    ("reversal", "velocity"),
    _bearing,
)


def _inertia(build: Build, p: Mapping[str, float]) -> None:
    build.shafts["inertia"][build.output] += p["inertia_kgm2"]


INERTIAL_LOAD = EffectKind(
    "inertial_load",
    "Inertia on the output pulley that the torque channel does not see: the cables carry M − J q̈.",
    (Parameter("inertia_kgm2", "J", low=0.0),),
    ("acceleration",),
    _inertia,
)


def _gravity(build: Build, p: Mapping[str, float]) -> None:
    shaft = build.shafts[build.output]
    shaft["gravity_Nm"], shaft["gravity_phase"] = p["moment_Nm"], p["phase_rad"]


GRAVITY_LOAD = EffectKind(
    "gravity_load",
    "Weight on the output pulley that the torque channel does not see: the cables carry M − m g l sin(q + "
    "φ).",
    (
        Parameter("moment_Nm", "m g l"),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("joint_angle", "motor_angle"),
    _gravity,
)


def _crosstalk(build: Build, p: Mapping[str, float]) -> None:
    build.surround["crosstalk"] = p["load_coefficient"]


CROSSTALK = EffectKind(
    "crosstalk",
    "A neighbouring joint loads this one: the cables carry M + k · other_1.",
    (Parameter("load_coefficient", "k, N·m per unit of channel other_1"),),
    ("other:1",),
    _crosstalk,
)


def _viscous(build: Build, p: Mapping[str, float]) -> None:
    build.shafts["viscous"][build.output] += p["coefficient_Nms_per_rad"]


JOINT_VISCOUS_FRICTION = EffectKind(
    "joint_viscous_friction",
    "A seal or grease holds the output pulley back in proportion to its speed: the cables carry M − d q̇.",
    (Parameter("coefficient_Nms_per_rad", "d", low=0.0),),
    ("velocity",),
    _viscous,
    listed=False,
    nearest=("bearing_friction", "viscous_slip"),
)


def _spring(build: Build, p: Mapping[str, float]) -> None:
    shaft = build.shafts[build.output]
    shaft["spring_rate"], shaft["spring_Nm"] = p["stiffness_Nm_per_rad"], p["saturation_Nm"]


PARALLEL_SPRING = EffectKind(
    "parallel_spring",
    "A wire harness over the joint pulls it back, and gives way: the cables carry M − τ_s tanh(k q/τ_s).",
    (
        Parameter("stiffness_Nm_per_rad", "k", low=0.0),
        Parameter("saturation_Nm", "τ_s", low=1e-9),
    ),
    ("joint_angle", "motor_angle"),
    _spring,
    listed=False,
    nearest=("gravity_load",),
)


def _tip(build: Build, p: Mapping[str, float]) -> None:
    build.tails.append(Tail(p["inertia_kgm2"], p["stiffness_Nm_per_rad"], p["damping_Nms_per_rad"]))


TIP_LINK = EffectKind(
    "tip_link",
    "The link is flexible: a second inertia behind a spring and damper swings between load and pulley; "
    "the joint encoder sits on the far side.",
    (
        Parameter("inertia_kgm2", "inertia of the far part", low=0.0),
        Parameter("stiffness_Nm_per_rad", "stiffness of the link", low=1e-6),
        Parameter("damping_Nms_per_rad", "its damping", 0.0, 0.0),
    ),
    ("acceleration", "load_rate"),
    _tip,
    listed=False,
    nearest=("inertial_load", "series_compliance"),
)

KINDS = (
    BEARING_FRICTION,
    INERTIAL_LOAD,
    GRAVITY_LOAD,
    CROSSTALK,
    JOINT_VISCOUS_FRICTION,
    PARALLEL_SPRING,
    TIP_LINK,
)
