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


def slip(inward: np.ndarray, outward: np.ndarray, apart: np.ndarray, mu: float, fades: float) -> np.ndarray:
    """c v over T0 between neighbours: what of the slope is beyond mu T, mu (T/T0)^-fades."""
    steep, mean = (outward - inward) / apart, 0.5 * (inward + outward)
    return np.sign(steep) * np.maximum(np.abs(steep) - mu * mean ** (1.0 - fades), 0.0)


def strain(tension: np.ndarray, stiffens: float) -> np.ndarray:
    """EA/T0 times strain beyond that at T0, of a cable whose stiffness is EA (1 + b (T/T0 - 1))."""
    return np.log1p(stiffens * (tension - 1.0)) / stiffens if stiffens else tension - 1.0


@pytest.mark.parametrize(
    ("coefficient", "fades", "stiffens"),
    [
        (0.5, 0.0, 0.0),
        (50.0, 0.0, 0.0),
        (5_000.0, 0.0, 0.0),
        (50.0, 0.6, 0.0),
        (50.0, 0.0, 0.7),
        (5_000.0, 0.4, -0.3),
    ],
)
def test_what_slides_in_and_out_of_a_node_is_what_it_stretches_by(
    coefficient: float, fades: float, stiffens: float
) -> None:
    laws = [("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient})]
    laws += [("pressure_dependent_friction", {"exponent": fades})] if fades else []
    laws += [("nonlinear_cable", {"stiffening": stiffens})] if stiffens else []
    config = with_effects(joint(), laws)
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
            flow = slip(new, np.append(new[1:], grid["end"]), apart, mu, fades)
            length = np.full(count, h)
            length[0] -= 0.5 * h
            length[-1] += 0.5 * (gap - h)
            rate = STEP_S * stage.EA_N / (radius * coefficient)
            rate = min(rate, 1e3 * h * h)  # beyond that slip is over within the step
            gained = rate / length * np.diff(flow, prepend=0.0)
            stiff = 1.0 + 2.0 * rate / (h * min(h, gap))
            stretched = strain(new, stiffens) - strain(old[:count], stiffens)
            # tables of mu by tension are good to 1e-9 of it
            assert (
                np.max(np.abs(stretched - gained))
                <= (2e-12 + (1e-9 * float(rate / h) if fades else 0.0)) * stiff
            )
            moved += int(np.any(flow != 0.0))
    assert moved > 200


@pytest.mark.parametrize(
    "law",
    [
        ("pressure_dependent_friction", {"exponent": 0.6}),
        ("nonlinear_cable", {"stiffening": 0.7}),
        ("position_dependent_friction", {"amplitude": 0.7, "phase_rad": 0.4}),
    ],
    ids=lambda law: str(law[0]),
)
def test_with_next_to_no_viscosity_it_is_the_law_without(law: tuple[str, dict[str, float]]) -> None:
    """What the law changes in the exact profile without rates, and on the grid."""
    plain = joint()
    loads = (
        0.7 * pull_unit(plain) * np.interp(np.arange(300), [0, 60, 160, 230, 299], [0, 1, -0.9, 0.8, -0.2])
    )
    columns = {
        "time_s": STEP_S * np.arange(300),
        "motor_position_rad": 0.0 * loads,
        "joint_torque_Nm": loads,
        "joint_position_rad": 0.0 * loads,
    }
    hardly = ("viscous_slip", {"coefficient_Ns_per_m_rad": 1e-3})

    def deflection(*effects: tuple[str, dict[str, float]]) -> np.ndarray:
        return np.asarray(Observer(with_effects(plain, effects)).run(columns)["deflection_rad"])

    changes = deflection(law) - deflection()
    on_the_grid = deflection(law, hardly) - deflection(hardly)
    assert np.ptp(changes) > 1e-3 * np.ptp(deflection())
    assert np.max(np.abs(on_the_grid - changes)) < 0.1 * np.max(np.abs(changes))
