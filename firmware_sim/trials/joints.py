"""Joints as they come: drawn dimensions, true values off the nominal ones, sensors fitting the joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from firmware_sim.plant import PlantConfig, StageConfig

OFF_NOMINAL = ("EA_N", "pretension_N", "mu_output", "mu_input")
LARGEST_DEVIATION = 2.0  # standard deviations
LONGEST_M = 0.6  # free length of one cable


@dataclass(frozen=True)
class DrawnJoint:
    """A joint to conceal something in.

    `true` is what the plant is built from, `nominal` what the configuration states; `tolerance` holds the
    relative 1-sigma of what is only nominally known. `load_Nm` is the greatest load, `travel_rad` how far
    the joint may turn either way.
    """

    true: PlantConfig
    nominal: PlantConfig
    tolerance: Mapping[str, float]
    load_Nm: float
    travel_rad: float
    offset_rad: float = 0.0
    sensors: Mapping[str, float] = field(default_factory=dict)

    @property
    def stage(self) -> StageConfig:
        """The one stage, with its true values."""
        return self.true.stages[0]

    def with_sensors(self, sensors: Mapping[str, float]) -> DrawnJoint:
        """The same joint read by these sensors."""
        return replace(self, sensors=dict(sensors))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def draw_joint(
    rng: np.random.Generator,
    as_stated: bool = False,
    between: tuple[float, float] = (0.05, 10.0),
    closed: bool = False,
) -> DrawnJoint:
    """Draw a single-stage joint: four in five closed, radii 5–60 mm, GF `between` two values
    (less where the cable would be longer than 0.6 m), EA 5–50 kN, T0 20–120 N.

    Wraps are long enough that the slip zone of the greatest load stays on the drums at every angle of the
    travel. With `as_stated` the true values are the nominal ones, with `closed` the circuit is.
    """
    closed = bool(rng.uniform() < 0.8) or closed
    ratio = log_uniform(rng, 0.3, 1.2)
    R = log_uniform(rng, max(0.008, 0.005 / ratio), min(0.06, 0.06 / ratio))
    mu_out, mu_in = log_uniform(rng, 0.05, 0.2), log_uniform(rng, 0.05, 0.2)
    mu = 1.0 / (1.0 / mu_out + ratio / mu_in)
    longest = LONGEST_M * mu / R
    geometry_friction = log_uniform(rng, min(between[0], 0.5 * longest), min(between[1], longest))
    T0 = log_uniform(rng, 20.0, 120.0)
    # strains as wire ropes are laid out for, some 0.25 % at the most: the theory is one of small strains
    EA = log_uniform(rng, max(5e3, 400.0 * T0), 5e4)
    share = float(rng.uniform(0.5, 1.0 if closed else 0.8))
    travel = float(rng.uniform(1.0, 1.5))
    reach = _slip_angle(share, geometry_friction, closed)
    stage = StageConfig(
        output_radius_m=_rounded(R),
        input_radius_m=_rounded(R * ratio),
        free_length_m=_rounded(geometry_friction * R / mu),
        EA_N=_rounded(EA),
        pretension_N=_rounded(T0),
        mu_output=_rounded(mu_out),
        mu_input=_rounded(mu_in),
        wrap_output_rad=_rounded(1.1 * reach / mu_out + travel + rng.uniform(0.5, 3.0)),
        wrap_input_rad=_rounded(1.1 * reach / mu_in + travel / ratio + rng.uniform(0.5, 3.0)),
    )
    nominal = PlantConfig("blind-joint", "closed" if closed else "open", (stage,))
    tolerance = _tolerance(rng)
    true = nominal if as_stated else _off_nominal(rng, nominal, tolerance)
    load = share * R * T0
    return DrawnJoint(true, nominal, tolerance, load, travel, float(rng.normal(0.0, 1e-3)))


def _slip_angle(share: float, geometry_friction: float, closed: bool) -> float:
    """Largest |ln(T/T0)| that a load of `share` R T0 brings, roughly: the angle of slip times mu."""
    if not closed:
        return max(math.log1p(share), -math.log1p(-share))
    tangent_low = share / math.expm1(share)  # thesis (4-42), nearly tangent
    low = min(tangent_low, 1.0 - 0.5 * share) if geometry_friction > 0.3 else tangent_low
    return max(-math.log(low), math.log(low + share))


def _tolerance(rng: np.random.Generator) -> dict[str, float]:
    friction = _rounded(float(rng.uniform(0.15, 0.30)))
    return {
        "EA_N": _rounded(float(rng.uniform(0.03, 0.05))),
        "pretension_N": _rounded(float(rng.uniform(0.05, 0.10))),
        "mu_output": friction,
        "mu_input": friction,
    }


def _off_nominal(
    rng: np.random.Generator, nominal: PlantConfig, tolerance: Mapping[str, float]
) -> PlantConfig:
    stage = nominal.stages[0]
    values = dict(stage.__dict__)
    for key in OFF_NOMINAL:
        deviation = float(np.clip(rng.standard_normal(), -LARGEST_DEVIATION, LARGEST_DEVIATION))
        values[key] *= math.exp(deviation * tolerance[key])
    return replace(nominal, stages=(StageConfig(**values),))


def _rounded(value: float, digits: int = 4) -> float:
    """To so many significant digits: what stands on a drawing."""
    return float(f"{value:.{digits - 1}e}")
