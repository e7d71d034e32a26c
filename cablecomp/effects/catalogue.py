"""All known effects, and how those of a configuration come together into one model."""

from __future__ import annotations

import difflib
import importlib
import importlib.util
import math
import pkgutil
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.effects.base import Effect, Late, Parameter, Role
from cablecomp.effects.empirical import empirical_term
from cablecomp.errors import InputError
from cablecomp.mechanics.change import Change, Term, together
from cablecomp.mechanics.records import OTHERS

_registered: dict[str, Effect] = {}


def register(effect: Effect) -> None:
    """Add an effect of the user's own to the catalogue; its id must be new."""
    if effect.id in catalogue() and catalogue()[effect.id] is not effect:
        raise InputError(f"effect `{effect.id}` exists already; give yours another id")
    _registered[effect.id] = effect


def load_effects(path: Path) -> tuple[str, ...]:
    """Run a Python file of the user's and register every `Effect` that it defines; returns their ids.

    Raises InputError if the file cannot be read or run, or defines no effect of its own.
    """
    spec = importlib.util.spec_from_file_location(f"cablecomp_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: is no Python file; give one that defines an `Effect`")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # the compiler looks its functions' globals up by the module's name
    try:
        spec.loader.exec_module(module)
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # whatever a user's file may raise
        raise InputError(f"{path}: does not run ({type(error).__name__}: {error}); mend it") from None
    found = {v.id: v for v in vars(module).values() if isinstance(v, Effect)}
    if not found:
        raise InputError(f"{path}: defines no effect; add `EFFECT = Effect(...)`")
    for effect in found.values():
        register(effect)
    return tuple(found)


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
    """Every known effect by its id: each file of this package with an `EFFECT`, and those registered."""
    return {**_built_in(), **_registered}


def parameter_of(name: str) -> Parameter | None:
    """The effect's parameter that is named `effect.ID.KEY`; None for any other name."""
    if not name.startswith("effect."):
        return None
    _, effect, key = name.split(".")
    return _look_up(effect).parameter(key)


def role_of(name: str) -> Role | None:
    """The role of that parameter."""
    found = parameter_of(name)
    return None if found is None else found.role


def with_effects(config: JointConfig, effects: Sequence[tuple[str, Mapping[str, Any]]]) -> JointConfig:
    """The same joint with exactly these effects, (id, {parameter: value}) each; `extend` checks them.

    Cheap (some microseconds), so that a fit may call it for every new parameter value.
    """
    entries = tuple(EffectEntry.model_construct(None, id=name, **values) for name, values in effects)
    return config.model_copy(update={"effect": entries})


def acts_through(entry: EffectEntry) -> tuple[str, ...]:
    """Covariates in which this effect's mismatch shows, best first, with its channel's `other:<name>`."""
    return _look_up(entry.id).covariates(str(entry.parameters.get("channel", "")))


def extend(config: JointConfig) -> Change | None:
    """What the configuration's effects change in the plain drive; None if there are none.

    Raises InputError for an unknown id, an unknown or missing parameter, or a value that the law cannot take.
    """
    if not config.effect and not config.empirical:
        return None
    known = sorted(((_look_up(entry.id), entry) for entry in config.effect), key=lambda pair: pair[0].rank)
    changes = [_change(effect, _values(effect, entry, config), config) for effect, entry in known]
    plays = [effect.id for (effect, _), c in zip(known, changes, strict=True) if c.play_share > 0.0]
    if len(plays) > 1:
        raise InputError(f"{config.name}: effect `{plays[1]}` is given twice; one is accepted")
    if config.empirical:
        changes.append(Change(terms=tuple(_empirical(config))))
    return changes[0] if len(changes) == 1 else together(changes)


def late_channels(config: JointConfig) -> tuple[JointConfig, tuple[Late, ...]]:
    """The joint without what merely comes late, and by how much its channels do, one after another; raises as
    `extend`."""
    known = [(_look_up(entry.id), entry) for entry in config.effect]
    late = [(effect.late, _values(effect, e, config)) for effect, e in known if effect.late is not None]
    if not late:
        return config, ()
    others = tuple(entry for effect, entry in known if effect.late is None)
    found = (told(values) for told, values in late if told is not None)
    acting = tuple(one for one in found if one.joint_s or one.drift or one.load_s)
    return config.model_copy(update={"effect": others}), acting


def is_bounded(config: JointConfig) -> bool:
    """True if all effects of the configuration preserve the order that guaranteed bounds rest on.

    An empirical law does unless it depends on the joint angle itself.
    """
    lawful = all(law.of != "joint_position_rad" for law in config.empirical)
    return lawful and all(_is_bounded(_look_up(entry.id), entry, config) for entry in config.effect)


def _is_bounded(effect: Effect, entry: EffectEntry, config: JointConfig) -> bool:
    found = ((entry.parameters.get(name), effect.parameter(name).neutral) for name in effect.unbounded_by)
    ordered = effect.bounded and config.observer.load not in effect.unbounded_with
    return ordered and all(value in (None, neutral) for value, neutral in found)


def _empirical(config: JointConfig) -> list[Term]:
    """The terms of the laws without a name; none of those that hold in one session alone, where the joint stands in
    none (`in_session`): these have to be such as can run all the same."""
    others = other_channels(config)
    terms = [(law, empirical_term(law, config, others)) for law in config.empirical]
    return [t for law, its in terms if not law.session for t in its]


def _change(effect: Effect, values: Mapping[str, float], config: JointConfig) -> Change:
    """What the effect changes; nothing at all where every value that says how much is neutral, and where the load is
    read at the motor, which feels the effect."""
    amounts = effect.amounts
    if amounts and all(values[name] == effect.by_name[name].neutral for name in amounts):
        return Change()
    if effect.felt_by_motor and config.observer.load == "motor_torque":
        return Change()
    return effect.change(values, config)


def _look_up(name: str) -> Effect:
    found = _built_in().get(name) or _registered.get(name)
    if found is None:
        known = catalogue()
        close = difflib.get_close_matches(name, known, 1)
        hint = (
            f"did you mean `{close[0]}`?"
            if close
            else f"known are {', '.join(sorted(known))} (one of your own: --effects FILE)"
        )
        raise InputError(f"key `effect.id` is '{name}', which is no known effect; {hint}")
    return found


def _values(effect: Effect, entry: EffectEntry, config: JointConfig) -> dict[str, float]:
    """The parameters of one entry, complete and finite; a channel becomes its place among the others."""
    known = effect.by_name
    values = {name: p.omitted for name, p in known.items() if p.omitted is not None}
    given = entry.parameters
    for key, value in given.items():
        if key in effect.texts:
            values[key] = float(_place(str(value), config))
        elif key in known:
            values[key] = _number(value, known[key], config)
        else:
            raise InputError(
                f"{config.name}: unknown key `effect.{key}` of effect `{effect.id}`; "
                f"it takes {', '.join(sorted((*known, *effect.texts)))}"
            )
    if effect.texts_optional:
        values |= {key: -1.0 for key in effect.texts if key not in values}
    missing = [name for name in (*known, *effect.texts) if name not in values]
    if missing:
        raise InputError(f"{config.name}: effect `{effect.id}` lacks key `{min(missing)}`; add it")
    amounts = effect.amounts
    if amounts and not any(name in given for name in amounts):
        raise InputError(f"{config.name}: effect `{effect.id}` says not how much; add {_any_of(amounts)}")
    return values


def _any_of(names: Sequence[str]) -> str:
    return " or ".join(f"`{name}`" for name in names)


def _number(value: object, parameter: Parameter, config: JointConfig) -> float:
    """The value of a parameter, within what its law can take."""

    def refused(accepted: str) -> InputError:
        return InputError(
            f"{config.name}: key `effect.{parameter.name}` is {value!r}{accepted} [{parameter.unit}] is accepted"
        )

    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise refused("; a finite number")
    if not parameter.minimum <= value <= parameter.maximum:
        raise refused(f"; {parameter.minimum:g} to {parameter.maximum:g}")
    if parameter.of_cable_l != "never" and config.drive.circuit == "open":
        below = parameter.of_cable_l == "below zero"
        if value < 0.0 if below else value != 0.0:
            most = f"0 to {parameter.maximum:g}" if below and parameter.maximum else "0"
            raise refused(f", which is of cable l; an open circuit has none: {most}")
    return float(value)


def _place(channel: str, config: JointConfig) -> int:
    """Place of a further channel among those that the kernel gets."""
    if not channel.startswith("other_"):
        raise InputError(
            f"{config.name}: key `effect.channel` is '{channel}'; a channel `other_<name>` is accepted"
        )
    place = other_channels(config).index(channel)
    if place >= OTHERS:
        raise InputError(
            f"{config.name}: key `effect.channel` '{channel}' is one channel too many; {OTHERS} are accepted"
        )
    return place


def other_channels(config: JointConfig) -> list[str]:
    """The further channels that effects and empirical laws of this joint read, in the order in which the kernel
    gets them."""
    names: list[str] = []
    for entry in config.effect:
        for key in _look_up(entry.id).texts:
            channel = str(entry.parameters.get(key, ""))
            if channel and channel not in names:
                names.append(channel)
    names += [law.of for law in config.empirical if law.of.startswith("other_")]
    return list(dict.fromkeys(names))
