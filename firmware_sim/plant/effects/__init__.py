"""Physics beyond the plain drive, in the plant's own terms: points, springs, forces."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.config import EffectSpec
from firmware_sim.plant.effects import cable, friction, load, sensing
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.errors import PlantError

EFFECTS: dict[str, EffectKind] = {
    kind.id: kind for group in (friction, cable, load, sensing) for kind in group.KINDS
}
LISTED = tuple(name for name, kind in EFFECTS.items() if kind.listed)
UNLISTED = tuple(name for name, kind in EFFECTS.items() if not kind.listed)


def apply_effects(build: Build, effects: Sequence[EffectSpec]) -> None:
    """Switch effects on in a drive under construction; raises PlantError for an unknown id or parameter, or
    one given twice."""
    seen: set[str] = set()
    for spec in effects:
        kind = EFFECTS.get(spec.id)
        if kind is None:
            raise PlantError(f"unknown effect `{spec.id}`; known are {', '.join(sorted(EFFECTS))}")
        if spec.id in seen:
            raise PlantError(f"effect `{spec.id}` is given twice; give it once")
        seen.add(spec.id)
        kind.apply(build, kind.values(spec.parameters))


__all__ = ["EFFECTS", "LISTED", "UNLISTED", "EffectKind", "Parameter", "apply_effects"]
