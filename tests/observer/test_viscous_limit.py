"""With hardly any viscosity what slides is the plain law, on wraps so long that all of a grid has to slide at once, and
on drums that wind on many turns of cable."""

from __future__ import annotations

import numpy as np
import pytest
from observer_joints import joint, pull_unit, run

from cablecomp.effects import with_effects
from cablecomp.observer import Observer

LONG = {"wrap_output_rad": 20.0, "wrap_input_rad": 18.0, "mu_output": 0.078, "mu_input": 0.17}


@pytest.mark.parametrize("drum", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_hardly_any_viscosity_is_none(circuit: str, drum: float) -> None:
    config = joint(circuit, LONG)
    count = 3000
    peak = 0.9 * pull_unit(config)
    load = peak * np.interp(np.arange(count), [0, 600, 620, 2000, 2300, 2999], [0, 1, -0.3, 0.9, 0.9, -0.8])
    plain = run(Observer(config), load, np.zeros(count))["joint_position_rad"]
    stage = config.drive.stage[-1]
    least = {"coefficient_Ns_per_m_rad": 1e-9 * stage.EA_N / stage.output_radius_m, "drum": drum}
    viscous = with_effects(config, (("viscous_slip", least),))
    found = run(Observer(viscous), load, np.zeros(count))["joint_position_rad"]
    assert np.max(np.abs(found - plain)) < 1e-3 * np.ptp(plain)


def test_hardly_any_viscosity_is_none_on_a_drum_that_winds_on_turn_after_turn() -> None:
    """The motor's, of a tenth of the joint's radius, over 24 rad: no grid covers that from the start."""
    config = joint("closed", {"output_radius_m": 0.05, "input_radius_m": 0.005, "wrap_input_rad": 14.0})
    peak = pull_unit(config)
    at = np.arange(500)
    load = peak * np.interp(at, np.linspace(0, 500, 11), [0, 1, -1, 0.8, 0, 0.9, -0.5, 1, 0, 0.9, -0.8])
    motor = np.interp(at, [0, 170, 400, 500], [0.0, 12.0, -12.0, 9.0])
    plain = run(Observer(config), load, motor)["deflection_rad"]
    viscous = with_effects(config, (("viscous_slip", {"coefficient_Ns_per_m_rad": 1e-3}),))
    found = run(Observer(viscous), load, motor)["deflection_rad"]
    assert np.max(np.abs(found - plain)) < 1e-3 * np.ptp(plain)


PRESSED = ("pressure_dependent_friction", {"exponent": 0.1, "lost": 0.6, "place": 0.9})
ROUGH = (
    "position_dependent_friction",
    {"amplitude": 0.6, "phase_rad": 0.3, "order": 3.0, "input_amplitude": 0.4},
)
STIFFENS = ("nonlinear_cable", {"stiffening": 0.4, "knee": 1.1})


@pytest.mark.parametrize("circuit", ["open", "closed"])
@pytest.mark.parametrize("laws", [(PRESSED,), (ROUGH,), (STIFFENS,), (PRESSED, ROUGH, STIFFENS)])
def test_hardly_any_viscosity_is_none_under_every_law(
    laws: tuple[tuple[str, dict[str, float]], ...], circuit: str
) -> None:
    config = joint(circuit)
    at = np.arange(400)
    load = (0.5 if circuit == "open" else 0.9) * pull_unit(config)
    load = load * np.interp(at, np.linspace(0, 400, 8), [0, 1, -0.5, 0.9, 0.2, 1, -1, 0.5])
    motor = np.interp(at, np.linspace(0, 400, 6), [0.0, 0.5, -0.5, 0.8, 0.8, 0.0])
    plain = run(Observer(with_effects(config, laws)), load, motor)["deflection_rad"]
    viscous = with_effects(config, (("viscous_slip", {"coefficient_Ns_per_m_rad": 1e-3}), *laws))
    found = run(Observer(viscous), load, motor)["deflection_rad"]
    assert np.max(np.abs(found - plain)) < 1e-3 * np.ptp(plain)


def test_friction_that_hardly_goes_by_tension_slips_as_that_which_does_not() -> None:
    config = joint()
    at = np.arange(400)
    load = 0.9 * pull_unit(config) * np.interp(at, np.linspace(0, 400, 5), [0.0, 1.0, -0.5, 0.9, -1.0])
    wet = ("viscous_slip", {"coefficient_Ns_per_m_rad": 5e3})
    hardly = ("pressure_dependent_friction", {"exponent": 1e-9})
    plain, found = (
        run(Observer(with_effects(config, laws)), load, 0.5 * np.sin(0.02 * at))["deflection_rad"]
        for laws in ((wet,), (wet, hardly))
    )
    assert np.max(np.abs(found - plain)) < 1e-8 * np.ptp(plain)
