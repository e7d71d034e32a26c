"""All known effects, and how those of a configuration come together into one model."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.effects.base import Change, Effect, Floats
from cablecomp.errors import InputError
from cablecomp.mechanics.assemble import Extension
from cablecomp.mechanics.tables import law_table, plain_law

_registered: dict[str, Effect] = {}


def register(effect: Effect) -> None:
    """Add an effect of the user's own to the catalogue; its id must be new."""
    if effect.id in catalogue() and catalogue()[effect.id] is not effect:
        raise InputError(f"effect `{effect.id}` exists already; give yours another id")
    _registered[effect.id] = effect


@cache
def _built_in() -> dict[str, Effect]:
    package = importlib.import_module("cablecomp.effects")
    found = {}
    for module in sorted(m.name for m in pkgutil.iter_modules(package.__path__)):
        effect = getattr(importlib.import_module(f"cablecomp.effects.{module}"), "EFFECT", None)
        if effect is not None:
            found[effect.id] = effect
    return found


def catalogue() -> dict[str, Effect]:
    """Every known effect by its id: each file of this package that defines `EFFECT`, and those registered by the user."""
    return {**_built_in(), **_registered}


def extend(config: JointConfig) -> Extension | None:
    """What the configuration's effects change in the plain drive; None if nothing. Raises InputError for unknown ids or keys."""
    if not config.effect:
        return None
    known = sorted(
        ((_look_up(entry.id), entry) for entry in config.effect), key=lambda pair: pair[0].rank
    )
    changes = [effect.change(_values(effect, entry, config), config) for effect, entry in known]
    return Extension(
        terms=tuple(t for change in changes for t in change.terms),
        law=_law(changes, config),
        guide_angle=sum(c.guide_angle for c in changes),
        guide_length_m=sum(c.guide_length_m for c in changes),
        play_share=sum(c.play_share for c in changes),
        play_yield_N=max(c.play_yield_N for c in changes),
        viscous_Ns_per_m_rad=sum(c.viscous_Ns_per_m_rad for c in changes),
    )


def is_bounded(config: JointConfig) -> bool:
    """True if all effects of the configuration preserve the order that guaranteed bounds rest on."""
    return all(_look_up(entry.id).bounded for entry in config.effect)


def _look_up(name: str) -> Effect:
    known = catalogue()
    if name not in known:
        close = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean `{close[0]}`?" if close else f"known are {', '.join(sorted(known))}"
        raise InputError(f"key `effect.id` is '{name}', which is no known effect; {hint}")
    return known[name]


def _values(effect: Effect, entry: EffectEntry, config: JointConfig) -> dict[str, float]:
    """The parameters of one entry, complete and finite; a text parameter (a channel) becomes its place among the others."""
    allowed = {p.name for p in effect.parameters} | set(effect.texts)
    values: dict[str, float] = {}
    for key, value in entry.parameters.items():
        if key not in allowed:
            raise InputError(
                f"{config.name}: unknown key `effect.{key}` of effect `{effect.id}`; it takes {', '.join(sorted(allowed))}"
            )
        if key in effect.texts:
            values[key] = float(other_channels(config).index(str(value)))
            continue
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"{config.name}: key `effect.{key}` is {value!r}; a finite number is accepted")
        values[key] = float(value)
    missing = [name for name in sorted(allowed) if name not in values]
    if missing:
        raise InputError(f"{config.name}: effect `{effect.id}` lacks key `{missing[0]}`; add it")
    return values


def other_channels(config: JointConfig) -> list[str]:
    """The further channels that effects of this joint read, in the order in which the kernel gets them."""
    names: list[str] = []
    for entry in config.effect:
        channel = entry.parameters.get("channel")
        if isinstance(channel, str) and channel not in names:
            names.append(channel)
    return names


def _law(changes: Sequence[Change], config: JointConfig) -> Floats:
    """Law tables for the output drums of chain h and l and for all other places."""
    by_tension = [c.tension_factor for c in changes if c.tension_factor is not None]
    by_angle = [c.joint_angle_factor for c in changes if c.joint_angle_factor is not None]
    stiffening = sum(c.stiffening for c in changes)
    if not by_tension and not by_angle and stiffening == 0.0:
        return np.stack([plain_law()] * 3)
    stage = config.drive.stage[-1]
    widest = 2.0 * max(s.wrap_output_rad + s.wrap_input_rad for s in config.drive.stage) + 20.0
    tables = []
    for sign in (1.0, -1.0, 0.0):

        def groove(y: Floats, sign: float = sign) -> Floats:
            return _product(by_angle, sign * (y - stage.wrap_output_rad)) if sign else np.ones_like(y)

        tables.append(law_table(lambda tau: _product(by_tension, tau), groove, widest, stiffening))
    return np.stack(tables)


def _product(factors: Sequence[Callable[[Floats], Floats]], x: Floats) -> Floats:
    total = np.ones_like(x)
    for factor in factors:
        total = total * factor(x)
    return total
