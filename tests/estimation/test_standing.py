"""How a drive stands in a session: another pretension leaves the cable and its coat the same material."""

from __future__ import annotations

import numpy as np
import pytest
from turning import JOINT

from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.estimation.standing import at_pretension

BOTH = with_effects(
    JOINT, [("nonlinear_cable", {"stiffening": 0.3}), ("pressure_dependent_friction", {"exponent": 0.25})]
)
TENSIONS = np.linspace(20.0, 120.0, 11)


def stiffness(config: JointConfig) -> np.ndarray:
    """EA(T) = EA (1 + b (T/T0 - 1)) [N]."""
    stage = config.drive.stage[0]
    (b,) = [float(e.parameters["stiffening"]) for e in config.effect if e.id == "nonlinear_cable"]
    return np.asarray(stage.EA_N * (1.0 + b * (TENSIONS / stage.pretension_N - 1.0)))


def friction(config: JointConfig, key: str) -> np.ndarray:
    """mu(T) = mu0 (T/T0)^-n."""
    stage = config.drive.stage[0]
    (n,) = [float(e.parameters["exponent"]) for e in config.effect if e.id == "pressure_dependent_friction"]
    return np.asarray(getattr(stage, key) * (TENSIONS / stage.pretension_N) ** -n)


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.6])
def test_another_pretension_keeps_the_laws_of_cable_and_coat(factor: float) -> None:
    there = at_pretension(BOTH, factor * BOTH.drive.stage[0].pretension_N)
    assert there.drive.stage[0].pretension_N == pytest.approx(factor * BOTH.drive.stage[0].pretension_N)
    np.testing.assert_allclose(stiffness(there), stiffness(BOTH), rtol=1e-12)
    for key in ("mu_output", "mu_input"):
        np.testing.assert_allclose(friction(there, key), friction(BOTH, key), rtol=1e-12)


def test_a_plain_cable_changes_its_pretension_alone() -> None:
    there = at_pretension(JOINT, 33.0)
    same = there.drive.stage[0].model_dump() | {"pretension_N": JOINT.drive.stage[0].pretension_N}
    assert same == JOINT.drive.stage[0].model_dump()
