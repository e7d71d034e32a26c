"""What is held against a name: a bound that its law ran into, but not a bound that is an answer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.weighing import _at_bound


@pytest.mark.parametrize(
    ("effect", "bounds", "held"),
    [
        ("routing_friction", (), False),
        ("routing_friction", ("effect.routing_friction.arc_length_m",), False),
        ("routing_friction", ("effect.routing_friction.mu_angle",), True),
        ("routing_friction", ("effect.routing_friction.mu_angle@Tool_4.2",), True),
        ("routing_friction", ("effect.routing_friction.mu_angle~bend_rad",), True),
        ("routing_friction", ("effect.nonlinear_cable.stiffening", "mu_output"), False),
        ("nonlinear_cable", ("effect.nonlinear_cable.stiffening", "mu_output"), True),
    ],
)
def test_that_all_of_a_cable_lies_on_its_guides_is_held_against_no_name(
    effect: str, bounds: tuple[str, ...], held: bool
) -> None:
    model: Any = SimpleNamespace(fit=SimpleNamespace(at_bound=lambda: bounds))
    term = cast(Hypothesis, SimpleNamespace(effect=SimpleNamespace(id=effect)))
    assert _at_bound(model, term) is held
