"""How the drive stood in one recording: the common values, its session's own, and what its conditions add."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig, with_values
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence

PRETENSION = "pretension_N"


def standing(config: JointConfig, values: Mapping[str, float], recording: Evidence) -> JointConfig:
    """The joint with these values as it stood in this recording.

    The cable's law EA(T) and a coefficient mu(T) belong to the material: where a session's pretension is its own, their
    values at that pretension follow from those at the common one.
    """
    common = {k: v for k, v in values.items() if "@" not in k and "~" not in k}
    joint = with_values(config, _checked(config, common))
    own: dict[str, float] = {}
    for name, value in values.items():
        base, at, session = name.partition("@")
        if at and session == recording.session:
            own[base] = value
    if PRETENSION in own:
        joint = at_pretension(joint, own.pop(PRETENSION))
    if own:
        joint = with_values(joint, _checked(joint, own))
    gained: dict[str, float] = {}
    for name, value in values.items():
        base, tilde, condition = name.partition("~")
        if tilde:
            gained[base] = gained.get(base, value_of(joint, base)) + value * recording.condition[condition]
    return with_values(joint, _checked(joint, gained)) if gained else joint


def at_pretension(config: JointConfig, pretension_N: float) -> JointConfig:
    """The same joint tightened to another pretension (output stage), its cable and coats unchanged.

    EA(T) = EA (1 + b (T/T0 - 1)) keeps its values, so EA -> EA (1 + b (t - 1)), b -> b t/(1 + b (t - 1)), t = T0'/T0; a
    coefficient mu0 (T/T0)^-n keeps mu(T), so mu0 -> mu0 t^-n.
    """
    factor = pretension_N / config.drive.stage[-1].pretension_N
    changes = {PRETENSION: config.drive.stage[0].pretension_N * factor}
    for entry in config.effect:
        if entry.id == "nonlinear_cable":
            b = float(entry.parameters["stiffening"])
            gain = max(1.0 + b * (factor - 1.0), 0.05)
            changes["EA_N"] = config.drive.stage[0].EA_N * gain
            changes["effect.nonlinear_cable.stiffening"] = b * factor / gain
        if entry.id == "pressure_dependent_friction":
            n = float(entry.parameters["exponent"])
            for key in ("mu_output", "mu_input"):
                changes[key] = getattr(config.drive.stage[0], key) * factor**-n
    return with_values(config, _checked(config, changes))


def value_of(config: JointConfig, name: str) -> float:
    """The value that the configuration holds under a parameter's name."""
    if name.startswith("effect."):
        _, identifier, key = name.split(".")
        entry = next((e for e in config.effect if e.id == identifier), None)
        if entry is None:
            raise InputError(f"{config.name}: effect `{identifier}` is not in the configuration; add it")
        return float(entry.parameters[key])
    key, _, which = name.partition(".")
    stage = config.drive.stage[int(which) - 1 if which else 0]
    return float(getattr(stage, key)) if hasattr(stage, key) else float(getattr(config.sensors, key))


def _checked(config: JointConfig, values: Mapping[str, float]) -> dict[str, float]:
    """Values inside what the laws can take."""
    found = {}
    for name, value in values.items():
        if name.startswith("effect."):
            _, identifier, key = name.split(".")
            p = catalogue()[identifier].parameter(key)
            value = min(max(value, p.minimum), p.maximum)
            if p.neutral == 0.0 and p.name in ("mu_angle", "arc_length_m"):
                value = max(value, 0.0)
        found[name] = value
    return found
