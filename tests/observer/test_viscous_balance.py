"""Viscous slip obeys its conservation law at every node of its grid, worked out here from the profiles alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import pytest
from observer_joints import joint, pull_unit

from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.observer import Observer
from cablecomp.signals import Sample

STEP_S = 0.01
OUT, IN = 0, 1


class Balance(NamedTuple):
    """One drum after one step."""

    off: float  # T/T0 by which a node missed its balance at most, over how stiff it is and how many there are
    moved: bool
    same_nodes: bool


class Laws(NamedTuple):
    """What friction and strain go by beside mu T and T/EA."""

    pressed: Callable[[np.ndarray], np.ndarray] = np.ones_like  # mu over mu0, by T/T0
    rough: Callable[[int, np.ndarray], np.ndarray] = lambda _, y: y  # by wrap: its integral over the groove
    strain: Callable[[np.ndarray], np.ndarray] = lambda tau: tau - 1.0


PLAIN = Laws()


def slip(inward: np.ndarray, outward: np.ndarray, apart: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """c v over T0 between neighbours: what of the slope is beyond mu T."""
    steep = (outward - inward) / apart
    return np.sign(steep) * np.maximum(np.abs(steep) - mu * 0.5 * (inward + outward), 0.0)


def imbalances(
    config: JointConfig, course: Iterable[tuple[float, float]], step_s: float, laws: Laws = PLAIN
) -> Iterator[Balance]:
    """A drum after a step of the course (motor angle [rad], load [N m]), by its profile before and after."""
    stage = config.drive.stage[-1]
    coefficient = config.effect[0].parameters["coefficient_Ns_per_m_rad"]
    observer = Observer(config)
    grids = observer._joint.named.grids
    for k, (motor, load) in enumerate(course):
        before = [(int(g["count"]), g["tau"].copy()) for g in grids]
        observer.step(Sample(step_s * k, motor, load, 0.0))
        if k == 0:
            continue
        for wrap, (count, old) in enumerate(before):
            grid = grids[wrap]
            mu, radius = (
                (stage.mu_output, stage.output_radius_m)
                if wrap % 2 == OUT
                else (stage.mu_input, stage.input_radius_m)
            )
            now = int(grid["count"])
            h, gap = float(grid["step"]), float(grid["angle"]) - (now - 1) * float(grid["step"])
            new = grid["tau"][:now]
            apart = np.append(np.full(now - 1, h), gap)
            places = np.append(h * np.arange(now), grid["angle"])
            outward = np.append(new[1:], grid["end"])
            hold = mu * np.diff(laws.rough(wrap, places)) / apart * laws.pressed(0.5 * (new + outward))
            flow = slip(new, outward, apart, hold)
            length = np.full(now, h)
            length[0] -= 0.5 * h
            length[-1] += 0.5 * (gap - h)
            rate = step_s * stage.EA_N / (radius * coefficient)
            rate = min(rate, 1e7 * h * h)  # beyond that slip is over within the step
            gained = rate / length * np.diff(flow, prepend=0.0)
            stiff = 1.0 + 2.0 * rate / (h * min(h, gap))
            known = min(count, now)  # cable that has just arrived was nowhere before
            off = np.max(np.abs(laws.strain(new[:known]) - laws.strain(old[:known]) - gained[:known]))
            yield Balance(float(off) / (now * stiff), bool(np.any(flow != 0.0)), count == now)


@pytest.mark.parametrize("coefficient", [0.5, 50.0, 5_000.0])
def test_what_slides_in_and_out_of_a_node_is_what_it_stretches_by(coefficient: float) -> None:
    config = with_effects(joint(), (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}),))
    peak = 0.6 * pull_unit(config)
    loads = peak * np.interp(np.arange(400), [0, 60, 61, 200, 230, 399], [0, 1, -0.3, 0.9, 0.9, -0.8])
    found = list(imbalances(config, ((0.0, load) for load in loads.tolist()), STEP_S))
    assert max(b.off for b in found) <= 2e-13  # each node rounds
    assert all(b.same_nodes for b in found)
    assert sum(b.moved for b in found) > 200


@pytest.mark.parametrize("coefficient", [2.0, 15.0, 200.0])
def test_a_face_that_only_rounding_has_slip_does_not_go_on_slipping_from_a_node_at_rest(
    coefficient: float,
) -> None:
    """Where the joint turns to and fro many faces stand at the very limit of friction."""
    config = with_effects(joint(), (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}),))
    time = 0.04 * np.arange(1500)
    swing = np.sin(0.9 * time) + 0.4 * np.sin(2.3 * time + 1.0)
    course = zip((0.5 * swing).tolist(), (0.4 * pull_unit(config) * np.roll(swing, 7)).tolist(), strict=True)
    found = list(imbalances(config, course, 0.04))
    assert max(b.off for b in found) <= 2e-13
    assert sum(b.moved for b in found) > 1000


PRESSED = ("pressure_dependent_friction", {"exponent": 0.6, "lost": 0.4, "place": 0.9})
ROUGH = (
    "position_dependent_friction",
    {"amplitude": 0.6, "phase_rad": 0.3, "order": 3.0, "input_amplitude": -0.5},
)
STIFFENS = ("nonlinear_cable", {"stiffening": 0.4, "steady": 0.2})


def pressed(tau: np.ndarray) -> np.ndarray:
    return np.asarray(tau**-0.6 * (1.0 - 0.4 / (1.0 + (0.9 / tau) ** 10)))


def rough(wrap: int, y: np.ndarray) -> np.ndarray:
    """Integrals of 1 + a cos(k q - phi) over a groove of a wrap of 10 rad at q = 0 (12 rad on the motor's drum)."""
    sign = 1.0 if wrap < 2 else -1.0
    if wrap % 2 == OUT:
        return np.asarray(y + 0.6 / 3.0 * sign * np.sin(3.0 * sign * (y - 10.0) - 0.3))
    return np.asarray(y - 0.5 * np.sin(y - 12.0))


def strain(tau: np.ndarray) -> np.ndarray:
    return np.asarray(0.2 * (tau - 1.0) + 0.8 / 0.4 * np.log1p(0.4 * (tau - 1.0)))


@pytest.mark.parametrize("coefficient", [0.5, 50.0, 5_000.0])
@pytest.mark.parametrize(
    ("effects", "laws", "rel"),
    [
        ((PRESSED,), Laws(pressed=pressed), 1e-12),
        ((ROUGH,), Laws(rough=rough), 1e-9),  # tables of the groove
        ((STIFFENS,), Laws(strain=strain), 2e-13),
        ((PRESSED, ROUGH, STIFFENS), Laws(pressed, rough, strain), 1e-9),
    ],
)
def test_what_slides_balances_under_every_law_of_friction_and_strain(
    effects: tuple[tuple[str, dict[str, float]], ...], laws: Laws, rel: float, coefficient: float
) -> None:
    config = with_effects(joint(), (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}), *effects))
    peak = 0.6 * pull_unit(config)
    loads = peak * np.interp(np.arange(200), [0, 30, 31, 100, 115, 199], [0, 1, -0.3, 0.9, 0.9, -0.8])
    found = list(imbalances(config, ((0.0, load) for load in loads.tolist()), STEP_S, laws))
    assert max(b.off for b in found) <= rel
    assert sum(b.moved for b in found) > 100
