"""Physics beyond the plain drive, in the plant's own terms: points, springs, forces.

Imports the plant's assembly, configuration and forms. Start reading at `base.py`, what an effect is.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.config import EffectSpec
from firmware_sim.plant.effects import cable, friction, load, motor, sensing, strangers
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.forms import FORMS

EFFECTS: dict[str, EffectKind] = {
    kind.id: kind for group in (friction, cable, load, motor, sensing, strangers) for kind in group.KINDS
}
LISTED = tuple(name for name, kind in EFFECTS.items() if kind.listed)
UNLISTED = tuple(name for name, kind in EFFECTS.items() if not kind.listed)


def apply_effects(build: Build, effects: Sequence[EffectSpec]) -> None:
    """Switch effects on in a drive under construction, in any of their forms; raises PlantError for an unknown id or
    parameter, or one given twice."""
    seen: set[str] = set()
    for spec in effects:
        kind = EFFECTS.get(spec.id) or FORMS.get(spec.id)
        if kind is None:
            raise PlantError(
                f"unknown effect `{spec.id}`; known are {', '.join(sorted({**EFFECTS, **FORMS}))}"
            )
        if kind.effect in seen:
            raise PlantError(f"effect `{kind.effect}` is given twice; give it once")
        seen.add(kind.effect)
        kind.apply(build, kind.values(spec.parameters))


__all__ = ["EFFECTS", "FORMS", "LISTED", "UNLISTED", "EffectKind", "Parameter", "apply_effects"]
