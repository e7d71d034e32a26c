"""Viscous slip obeys its conservation law at every node of its grid, worked out here from the profiles alone."""

from __future__ import annotations

import numpy as np
import pytest
from observer_joints import joint, pull_unit

from cablecomp.effects import with_effects
from cablecomp.observer import Observer
from cablecomp.signals import Sample

STEP_S = 0.01
OUT, IN = 0, 1


def slip(inward: np.ndarray, outward: np.ndarray, apart: np.ndarray, mu: float) -> np.ndarray:
    """c v over T0 between neighbours: what of the slope is beyond mu T."""
    steep = (outward - inward) / apart
    return np.sign(steep) * np.maximum(np.abs(steep) - mu * 0.5 * (inward + outward), 0.0)


@pytest.mark.parametrize("coefficient", [0.5, 50.0, 5_000.0])
def test_what_slides_in_and_out_of_a_node_is_what_it_stretches_by(coefficient: float) -> None:
    config = with_effects(joint(), (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}),))
    stage = config.drive.stage[-1]
    observer = Observer(config)
    peak = 0.6 * pull_unit(config)
    loads = peak * np.interp(np.arange(400), [0, 60, 61, 200, 230, 399], [0, 1, -0.3, 0.9, 0.9, -0.8])
    grids = observer._joint.named.grids
    moved = 0
    for k, load in enumerate(loads.tolist()):
        before = [(int(g["count"]), g["tau"].copy()) for g in grids]
        observer.step(Sample(STEP_S * k, 0.0, load, 0.0))
        if k == 0:
            continue
        for wrap, (count, old) in enumerate(before):
            grid = grids[wrap]
            assert int(grid["count"]) == count
            mu, radius = (
                (stage.mu_output, stage.output_radius_m)
                if wrap % 2 == OUT
                else (stage.mu_input, stage.input_radius_m)
            )
            h, gap = float(grid["step"]), float(grid["angle"]) - (count - 1) * float(grid["step"])
            new = grid["tau"][:count]
            apart = np.append(np.full(count - 1, h), gap)
            flow = slip(new, np.append(new[1:], grid["end"]), apart, mu)
            length = np.full(count, h)
            length[0] -= 0.5 * h
            length[-1] += 0.5 * (gap - h)
            rate = STEP_S * stage.EA_N / (radius * coefficient)
            rate = min(rate, 1e7 * h * h)  # beyond that slip is over within the step
            gained = rate / length * np.diff(flow, prepend=0.0)
            stiff = 1.0 + 2.0 * rate / (h * min(h, gap))
            assert np.max(np.abs(new - old[:count] - gained)) <= 2e-13 * count * stiff  # each node rounds
            moved += int(np.any(flow != 0.0))
    assert moved > 200
