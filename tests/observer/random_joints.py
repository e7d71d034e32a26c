"""Joints of any shape that a file may state, driven without mercy; whatever they take leaves a sound state."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import exp, inf, log
from typing import NamedTuple

import numpy as np
from observer_joints import joint, pull_unit

from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.observer import Observer, SampleRefused
from cablecomp.signals import Sample

EFFECTS = (
    (),
    (("nonlinear_cable", {"stiffening": 0.4}),),
    (("pressure_dependent_friction", {"exponent": 0.2}),),
    (("strand_friction", {"fraction": 0.2, "yield_N": 2.0}),),
    (("routing_friction", {"mu_angle": 0.05, "arc_length_m": 0.01}),),
    (("viscous_slip", {"coefficient_Ns_per_m_rad": 50.0}),),
    (("nonlinear_cable", {"stiffening": 0.9, "steady": 0.5}),),
    (("nonlinear_cable", {"stiffening": 0.8, "knee": 1.1}),),
    (("nonlinear_cable", {"stiffening": 0.8, "knee": 0.7, "again": 1.8}),),
    (("routing_friction", {"mu_angle": 0.05, "arc_length_m": 0.0, "place": 0.02, "spread": 0.9}),),
    (("viscous_slip", {"coefficient_Ns_per_m_rad": 50.0, "drum": -1.0}),),
    (("strand_friction", {"fraction": 0.2, "yield_N": 2.0, "spread": 1.0}),),
    (("strand_friction", {"fraction": 0.2, "yield_N": 2.0, "spread": 1.0, "grading": 3.0}),),
    (("strand_friction", {"fraction": 0.2, "yield_N": 2.0, "pressed": 0.7}),),
)


class Taken(NamedTuple):
    """How many samples a joint took, and how many it refused."""

    accepted: int
    refused: int


ANY_STRAIN = 1e-5, 0.1
SOFT_STRAIN = 1e-3, 0.1
"""Of a cable under its pretension: with the soft ones a deflection itself unwinds a drum."""


def random_joint(
    rng: np.random.Generator, effects: bool = True, strain: tuple[float, float] = ANY_STRAIN
) -> JointConfig:
    """Wraps of 0.01 to 60 rad, friction of 1e-6 to 3, strains under pretension within `strain`."""

    def between(low: float, high: float) -> float:
        return exp(rng.uniform(log(low), log(high)))

    def stage() -> dict[str, float]:
        tension = between(5.0, 200.0)
        return {
            "output_radius_m": between(0.003, 0.1),
            "input_radius_m": between(0.003, 0.1),
            "free_length_m": between(0.005, 0.5),
            "pretension_N": tension,
            "EA_N": tension / between(*strain),
            "mu_output": between(1e-6, 3.0),
            "mu_input": between(1e-6, 3.0),
            "wrap_output_rad": between(0.01, 60.0),
            "wrap_input_rad": between(0.01, 60.0),
        }

    circuit = rng.choice(["open", "closed"])
    stages = [stage() for _ in range(rng.integers(1, 4))]
    for near, far in reversed(
        list(pairwise(stages)) if circuit == "open" else []
    ):  # they hang one behind the other
        settled = far["pretension_N"] * far["input_radius_m"] / near["output_radius_m"]
        near["EA_N"] *= settled / near["pretension_N"]
        near["pretension_N"] = settled
    pieces = int(rng.choice([16, 24, 192]))
    observer = {"max_pieces": pieces, "merge_tolerance": float(rng.choice([1e-13, 1e-4]))}
    made = joint(circuit, *stages, observer=observer)
    chosen = EFFECTS[rng.integers(len(EFFECTS))] if effects and rng.random() < 0.3 else ()
    return with_effects(made, chosen)


def hard_walk(config: JointConfig, rng: np.random.Generator, count: int) -> Iterator[Sample]:
    """Loads up to several times what slackens a cable, most of them reversing; the motor to and beyond the ends
    of the wraps."""
    first, last = config.drive.stage[0], config.drive.stage[-1]
    reach = min(first.wrap_input_rad, last.wrap_output_rad / config.drive.ratio)
    unit, motor, load = pull_unit(config), 0.0, 0.0
    for k in range(count):
        kind = rng.integers(6)
        if kind == 0:  # next to the end of a wrap
            motor = rng.choice([-1.0, 1.0]) * reach * (1.0 - 10.0 ** -rng.uniform(0.0, 8.0))
        elif kind == 1:
            motor = rng.uniform(-1.05, 1.05) * reach
        elif kind == 2:
            motor += 1e-3 * reach * rng.standard_normal()
        size = unit * 10.0 ** rng.uniform(-6.0, 0.7)
        load = -load * rng.uniform(0.5, 1.5) if kind == 3 else size * rng.choice([-1.0, 1.0])
        yield Sample(1e-3 * (k + 1), motor, load)


def drive_hard(config: JointConfig, rng: np.random.Generator, count: int) -> Taken:
    """Every state after an accepted sample is sound, every refusal leaves the state as it was."""
    observer = Observer(config)
    accepted = refused = 0
    for sample in hard_walk(config, rng, count):
        before = observer.snapshot() if accepted else b""
        try:
            found = observer.step(sample)
        except SampleRefused:
            refused += 1
            assert not accepted or observer.snapshot() == before, "a refusal left its mark"
            continue
        accepted += 1
        observer.check_state()
        assert max(map(abs, (found.joint_position_rad, found.deflection_rad))) < inf
        assert found.tension_h_N > 0.0
    return Taken(accepted, refused)
