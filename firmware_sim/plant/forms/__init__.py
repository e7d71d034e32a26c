"""Further forms of the catalogue's laws: the same physics in other words, one file per effect.

A form goes by `effect:form`. Some of them the catalogue has as shapes of its own laws (the trials' order says which);
a diagnosis that knows the effect should know the others again. Imports what an effect is, `effects/base.py`, and the
plant's assembly. Start reading at any file.
"""

from __future__ import annotations

from firmware_sim.plant.effects.base import EffectKind
from firmware_sim.plant.forms import (
    bearing_friction,
    clamp_slip,
    clock_skew,
    crosstalk,
    gravity_load,
    inertial_load,
    motor_friction,
    nonlinear_cable,
    position_dependent_friction,
    pressure_dependent_friction,
    pretension_relaxation,
    pulley_runout,
    routing_friction,
    series_compliance,
    strand_break,
    strand_friction,
    termination_backlash,
    thermal_pretension,
    viscous_slip,
)

_ROOMS = (
    routing_friction,
    viscous_slip,
    pretension_relaxation,
    thermal_pretension,
    bearing_friction,
    series_compliance,
    termination_backlash,
    nonlinear_cable,
    strand_friction,
    pressure_dependent_friction,
    position_dependent_friction,
    pulley_runout,
    clock_skew,
    inertial_load,
    gravity_load,
    clamp_slip,
    strand_break,
    crosstalk,
    motor_friction,
)
FORMS: dict[str, EffectKind] = {kind.id: kind for room in _ROOMS for kind in room.KINDS}

__all__ = ["FORMS"]
