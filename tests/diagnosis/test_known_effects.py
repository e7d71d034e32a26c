"""Effects that a joint is known to have: recalibrated within their tolerances, and written with such."""

from __future__ import annotations

from math import inf

import pytest
from joints import SMALL, closed
from small_drive import TOLERANT, recorded

from cablecomp.config import JointConfig, parse_joint
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.effects import with_effects
from cablecomp.estimation.parameter import of_drive
from firmware_sim.plant import EffectSpec

TRUE_NM = 0.2
BEARING = EffectSpec(
    "bearing_friction", {"torque_Nm": TRUE_NM, "presliding_rad": 1e-4, "load_coefficient": 0.0}
)
TORQUE = "effect.bearing_friction.torque_Nm"


def joint(stated_Nm: float, tolerance: dict[str, float]) -> JointConfig:
    """The small joint, whose bearing is known to rub."""
    known = {**BEARING.parameters, "id": BEARING.id, "torque_Nm": stated_Nm}
    told = {"pretension_N": 0.06, "mu_output": 0.25, **tolerance}
    return parse_joint({**closed(SMALL, "small"), "tolerance": told, "effect": [known]}, "small")


def test_a_known_friction_that_has_changed_is_recalibrated_and_nothing_is_named() -> None:
    recordings = {"small/1": recorded([BEARING], 30.0)}
    found = diagnose(joint(0.8 * TRUE_NM, {TORQUE: 0.2}), recordings)
    assert [n.effect for n in found.named] == []
    assert found.verdict in {"recalibrate", "consistent"}
    (told,) = (v for v in found.calibration if v.name == TORQUE)
    assert told.nominal == pytest.approx(0.8 * TRUE_NM)
    assert abs(told.value - TRUE_NM) < max(3.0 * told.sd, 0.03 * TRUE_NM)
    (entry,) = found.augmented_joint.effect
    assert entry.parameters["torque_Nm"] == pytest.approx(told.value)
    assert found.augmented_joint.tolerance[TORQUE] < 0.2


def test_calibrate_moves_a_known_friction() -> None:
    found = calibrate(joint(1.15 * TRUE_NM, {TORQUE: 0.2}), {"small/1": recorded([BEARING], 30.0)})
    (told,) = (v for v in found.values if v.name == TORQUE)
    assert abs(told.value - TRUE_NM) < max(3.0 * told.sd, 0.03 * TRUE_NM)
    assert found.config.effect[0].parameters["torque_Nm"] == pytest.approx(told.value)


def test_without_a_tolerance_a_known_effect_stays_as_it_is() -> None:
    found = diagnose(joint(TRUE_NM, {}), {"small/1": recorded([BEARING], 30.0)}, budget_s=0.0)
    assert TORQUE not in {v.name for v in found.calibration}
    assert found.augmented_joint.effect[0].parameters["torque_Nm"] == TRUE_NM


def test_how_much_of_a_named_effect_there_is_is_known_as_well_as_it_was_found() -> None:
    found = diagnose(TOLERANT, {"small/1": recorded([BEARING], 30.0)})
    assert [n.effect for n in found.named] == ["bearing_friction"]
    tolerance = found.augmented_joint.tolerance
    assert 0.05 <= tolerance[TORQUE] < 0.3
    assert (
        abs(float(found.augmented_joint.effect[0].parameters["torque_Nm"]) / TRUE_NM - 1.0)
        < 3.0 * tolerance[TORQUE]
    )
    again = diagnose(found.augmented_joint, {"small/1": recorded([BEARING], 30.0)}, budget_s=0.0)
    assert TORQUE in {v.name for v in again.calibration}


@pytest.mark.parametrize(
    ("effect", "key", "value", "tolerance", "expected"),
    [
        ("bearing_friction", "torque_Nm", 0.2, 0.1, (True, 0.2, 0.1)),  # by a factor
        ("nonlinear_cable", "stiffening", 0.3, 0.02, (False, 0.3, 1.0)),  # of either sign: in its own unit
        ("crosstalk", "load_coefficient", -0.1, 0.02, (False, -0.1, 1.0)),
    ],
)
def test_a_tolerance_of_an_effect_is_a_prior(
    effect: str, key: str, value: float, tolerance: float, expected: tuple[bool, float, float]
) -> None:
    given = {key: value, **({"channel": "other_neighbour"} if effect == "crosstalk" else {})}
    name = f"effect.{effect}.{key}"
    known = with_effects(TOLERANT, [(effect, given)]).model_copy(update={"tolerance": {name: tolerance}})
    p = next(p for p in of_drive(known) if p.name == name)
    assert (p.log, p.centre, p.sd) == pytest.approx(expected)
    assert p.scale == (1.0 if p.log else tolerance)
    low, high = 0.0 if effect == "bearing_friction" else -inf, 0.95 if effect == "nonlinear_cable" else inf
    assert low <= p.low < value < p.high <= high
