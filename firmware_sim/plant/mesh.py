"""Spacing of the material points along one cable."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from firmware_sim.plant.config import StageConfig
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.records import Floats


@dataclass(frozen=True)
class Resolution:
    """How finely the plant is resolved.

    `friction_step` is the friction angle mu dθ per material point where the cable can touch a drum; the
    discretisation error falls with its square. `steps_per_spacing` bounds the arc wound in one time step to
    a share of that spacing.
    """

    friction_step: float = 0.02
    spacings_per_step: float = 1.0
    max_nodes: int = 6000
    growth: float = 0.25
    ramp_steps: int = 60

    def __post_init__(self) -> None:
        if not (0 < self.friction_step < 0.5 and self.spacings_per_step > 0 and self.max_nodes >= 16):
            raise PlantError(
                f"resolution {self}: friction_step in (0, 0.5), spacings_per_step > 0 "
                "and max_nodes >= 16 are accepted"
            )


COARSE = Resolution(friction_step=0.05, spacings_per_step=2.0)
NORMAL = Resolution()
FINE = Resolution(friction_step=0.007, spacings_per_step=0.5, max_nodes=20000)


@dataclass(frozen=True)
class Guides:
    """Guides along a free span: how many, the share of the free length before the first (equal shares of the rest
    follow each), and mu Θ of all together."""

    count: int = 1
    first: float = 0.5
    friction_angle: float = 0.0

    @property
    def least_span(self) -> float:
        """The shortest span between two bodies, as a share of the free length."""
        return min(self.first, (1.0 - self.first) / self.count)

    def starts(self, free_m: float, arc_m: float) -> list[float]:
        """Where they begin, m from the output drum."""
        pitch = (arc_m + (1.0 - self.first) * free_m) / self.count
        return [self.first * free_m + k * pitch for k in range(self.count)]


def fine_spacing(stage: StageConfig, resolution: Resolution, least_span: float = 1.0) -> tuple[float, float]:
    """Spacing wanted near the output and near the input drum, m.

    A share of the friction length R/mu, from 0.01 to 0.2 rad of contact, never more than what lets one point
    touch two bodies.
    """
    apart = 0.9 * stage.free_length_m * least_span

    def spacing(radius: float, mu: float) -> float:
        return min(max(resolution.friction_step / mu, 0.01), 0.2) * radius

    out = spacing(stage.output_radius_m, stage.mu_output)
    inner = spacing(stage.input_radius_m, stage.mu_input)
    return min(out, apart), min(inner, apart)


def guide_spacing(arc_m: float, friction_angle: float, drums_m: float, free_m: float, step: float) -> float:
    """Spacing wanted on a guide, m: 2.5 friction steps a point.

    A guide may do with a single point, since the friction of all that lies on it adds up to its own; what
    is lost is where on the guide it acts, which hardly counts for a guide much shorter than the free
    length.
    """
    share = min(max(2.5 * step / max(friction_angle, 1e-9), 1 / 16), 1.0)
    return min(max(arc_m * share, 0.1 * drums_m, 0.004 * free_m), drums_m)


def element_lengths(
    stage: StageConfig,
    arcs: tuple[float, float, float],
    travel_m: float,
    resolution: Resolution,
    guides: Guides = Guides(),
) -> Floats:
    """Stretched element lengths from termination to termination.

    `arcs` = (arc on the output drum, free length and guide, arc on the input drum) at the start, m. Cable
    that can come to lie on a drum within `travel_m`, and a guide's surroundings, are fine; spacing grows
    with the distance from there.
    """
    on_out, span, on_in = arcs
    guide = span - stage.free_length_m
    fine_out, fine_in = fine_spacing(stage, resolution, guides.least_span if guide > 0 else 1.0)
    total = on_out + span + on_in
    edges = [(-math.inf, on_out + travel_m, fine_out), (total - on_in - travel_m, math.inf, fine_in)]
    if guide > 0:
        arc = guide / guides.count
        spacing = guide_spacing(
            arc,
            guides.friction_angle / guides.count,
            min(fine_out, fine_in),
            stage.free_length_m,
            resolution.friction_step,
        )
        for start in guides.starts(stage.free_length_m, guide):
            edges.append((on_out + start - travel_m, on_out + start + arc + travel_m, spacing))

    def wanted(p: float) -> float:
        return min(fine + resolution.growth * max(low - p, p - high, 0.0) for low, high, fine in edges)

    lengths: list[float] = []
    position = 0.0
    while position < total:
        length = wanted(position + 0.5 * wanted(position))
        lengths.append(length)
        position += length
        if len(lengths) > resolution.max_nodes:
            raise PlantError(
                f"the cable needs more than {resolution.max_nodes} material points at this resolution; "
                "raise friction_step or max_nodes, or give a longer free length"
            )
    result = np.asarray(lengths)
    return np.asarray(result * (total / result.sum()))
