"""Effects on the friction between cable and what it lies on."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_sim.plant.assembly import Build, stage_of
from firmware_sim.plant.effects.base import EffectKind, Parameter


def _routing(build: Build, p: Mapping[str, float]) -> None:
    build.cables["guide_arc_m"] = p["arc_length_m"]
    build.cables["guide_mu_per_m"] = p["mu_angle"] / p["arc_length_m"]


ROUTING_FRICTION = EffectKind(
    "routing_friction",
    "A fixed guide in the middle of the free span of every cable: its material points stick to it or "
    "slide at mu T per radian.",
    (
        Parameter("mu_angle", "mu Θ of the guide, the log of the greatest tension ratio", low=0.0, high=8.0),
        Parameter(
            "arc_length_m", "cable lying on the guide, in addition to the free length", 1e-3, 1e-6, 10.0
        ),
    ),
    ("motor_angle", "reversal", "velocity"),
    _routing,
)


def _viscous(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        c["viscous_out"] = p["coefficient_Ns_per_m_rad"] / c["R"]
        c["viscous_in"] = p["coefficient_Ns_per_m_rad"] / c["r"]


VISCOUS_SLIP = EffectKind(
    "viscous_slip",
    "A sliding point feels mu T + c v per radian on both drums, v its slip speed.",
    (Parameter("coefficient_Ns_per_m_rad", "c", low=0.0),),
    ("load_rate", "dwell"),
    _viscous,
)


def _pressure(build: Build, p: Mapping[str, float]) -> None:
    build.cables["pressure_exponent"] = p["exponent"]


PRESSURE_DEPENDENT_FRICTION = EffectKind(
    "pressure_dependent_friction",
    "The coefficient falls with contact pressure: mu = mu0 (T/T0)^−n at every point.",
    (Parameter("exponent", "n", low=-0.9, high=0.9),),
    ("load",),
    _pressure,
)


def _position(build: Build, p: Mapping[str, float]) -> None:
    for k, c in enumerate(build.cables):
        if stage_of(build, k) is build.stages[-1]:
            c["groove_amplitude"], c["groove_phase"] = p["amplitude"], p["phase_rad"]


POSITION_DEPENDENT_FRICTION = EffectKind(
    "position_dependent_friction",
    "The output drum's groove is rougher in places: the point at which the cable departs when the joint "
    "stands at q has mu = mu0 (1 + a cos(q − φ)).",
    (
        Parameter("amplitude", "a", low=-0.98, high=0.98),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("joint_angle", "motor_angle"),
    _position,
)


def _ageing(build: Build, p: Mapping[str, float]) -> None:
    build.surround["ageing_gain"], build.surround["ageing_count"] = p["gain"], p["reversals"]


FRICTION_AGEING = EffectKind(
    "friction_ageing",
    "Every coefficient grows with the number n of load reversals: mu = mu0 (1 + g (1 − e^(−n/n0))).",
    (
        Parameter("gain", "g", low=-0.9, high=5.0),
        Parameter("reversals", "n0", 10.0, 0.1, 1e6),
    ),
    ("time", "reversal"),
    _ageing,
    listed=False,
    nearest=("pretension_relaxation",),
)


def _warm(build: Build, p: Mapping[str, float]) -> None:
    build.surround["mu_per_K"], build.surround["mu_ref"] = p["coefficient_per_K"], p["reference_degC"]


FRICTION_TEMPERATURE = EffectKind(
    "friction_temperature",
    "Every coefficient follows the temperature: mu = mu0 (1 + k (ϑ − ϑ_ref)).",
    (
        Parameter("coefficient_per_K", "k", low=-1.0, high=1.0),
        Parameter("reference_degC", "ϑ_ref", 20.0),
    ),
    ("temperature",),
    _warm,
    listed=False,
    nearest=("thermal_pretension",),
)

KINDS = (
    ROUTING_FRICTION,
    VISCOUS_SLIP,
    PRESSURE_DEPENDENT_FRICTION,
    POSITION_DEPENDENT_FRICTION,
    FRICTION_AGEING,
    FRICTION_TEMPERATURE,
)
