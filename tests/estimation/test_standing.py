"""How a drive stands in a session: another pretension leaves the cable and its coat the same material."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from turning import JOINT

from cablecomp.config import JointConfig, parse_joint
from cablecomp.config_text import joint_text
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.estimation.standing import as_it_stood, at_pretension
from cablecomp.signal.smoothing import FloatArray

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


PLAIN = tomllib.loads(joint_text(JOINT))
BENT = {
    "condition": {"bend_rad": "other_bend"},
    "effect": [{"id": "routing_friction", "mu_angle": 0.3, "arc_length_m": 0.01}],
    "depends": [
        {"parameter": "effect.routing_friction.mu_angle", "on": "bend_rad", "per_unit": 0.2, "at": 0.0,
         "seen": [0.0, 2.0]}
    ],
    "session": [{"name": "straight", "recordings": ["straight.csv"], "values": {"pretension_N": 70.0}}],
}  # fmt: skip


def bent(bend: float) -> dict[str, FloatArray]:
    return {"other_bend": np.array([bend, np.nan, bend])}


def test_a_posture_that_no_session_claims_stands_as_its_law_says() -> None:
    joint = parse_joint({**PLAIN, **BENT}, "bent")
    assert parse_joint(tomllib.loads(joint_text(joint)), "again") == joint
    stood, session, said = as_it_stood(joint, Path("new.csv"), lambda: bent(1.5))
    assert (stood.effect[0].parameters["mu_angle"], session, said) == (pytest.approx(0.6), None, ())
    stood, session, _ = as_it_stood(joint, Path("straight.csv"), lambda: bent(1.5))
    assert (stood.drive.stage[0].pretension_N, session) == (70.0, "straight")
    assert stood.effect[0].parameters["mu_angle"] == 0.3


def test_beyond_what_told_a_law_it_is_held_and_said() -> None:
    joint = parse_joint({**PLAIN, **BENT}, "bent")
    stood, _, said = as_it_stood(joint, Path("new.csv"), lambda: bent(5.0))
    assert stood.effect[0].parameters["mu_angle"] == pytest.approx(0.7)
    assert "bend_rad = 5 lies beyond 0 to 2" in said[0]
    with pytest.raises(InputError, match="other_bend"):
        as_it_stood(joint, Path("new.csv"), dict)


def test_a_law_on_what_is_no_condition_is_refused() -> None:
    with pytest.raises(InputError, match="bend_rad"):
        parse_joint({**PLAIN, **BENT, "condition": {}}, "bent")
