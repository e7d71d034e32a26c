"""What a configuration may state but hardly means: asked about, never refused."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp
from typing import Final, NamedTuple

from cablecomp.config.drive import Stage
from cablecomp.config.schema import JointConfig


class _Usual(NamedTuple):
    """Where a value usually lies, and what else may have been meant outside of it."""

    low: float
    high: float
    below: str
    above: str


_UNIT: Final = "is the unit right? the key's name says it"
_USUAL: Final = {
    "output_radius_m": _Usual(5e-4, 1.0, _UNIT, "millimetres?"),
    "input_radius_m": _Usual(5e-4, 1.0, _UNIT, "millimetres?"),
    "free_length_m": _Usual(5e-4, 20.0, _UNIT, "millimetres?"),
    "EA_N": _Usual(
        200.0, 2e7, "as soft as rubber; EA is modulus x metal area: steel of 1 mm has some 50 000", _UNIT
    ),
    "pretension_N": _Usual(0.05, 2e4, "nearly slack", _UNIT),
    "mu_output": _Usual(0.005, 1.0, "hardly any friction", "as rough as rubber"),
    "mu_input": _Usual(0.005, 1.0, "hardly any friction", "as rough as rubber"),
    "wrap_output_rad": _Usual(0.1, 80.0, "turns instead of radians?", "degrees instead of radians?"),
    "wrap_input_rad": _Usual(0.1, 80.0, "turns instead of radians?", "degrees instead of radians?"),
}
_STRAIN: Final = 0.03
_BREAKS: Final = 0.1  # steel breaks at two or three per cent, polymer fibres at four or five
_RATIO: Final = 30.0
_NOISE: Final = {"rad": 0.02, "Nm": 50.0, "N": 500.0}


def doubts(config: JointConfig) -> tuple[str, ...]:
    """One line for each value that is possible but implausible; a right joint gives none."""
    return tuple(_all(config))


def _all(config: JointConfig) -> Iterator[str]:
    several = len(config.drive.stage) > 1
    for number, stage in enumerate(config.drive.stage, start=1):
        where = f"stage {number}: " if several else ""
        yield from (where + words for words in _of_stage(stage, config.tolerance))
    yield from _reach(config)
    yield from _pull(config)
    for key, value in config.sensors.model_dump(exclude_none=True).items():
        most = _NOISE.get(key.rpartition("_")[2], 0.0)
        if key.endswith(("noise_rad", "noise_Nm", "noise_N", "resolution_rad")) and value > most:
            yield f"{key} = {value:g} is a poor sensor; {_UNIT}"
    for key, value in config.tolerance.items():
        if value > 3.0 and not key.endswith(("offset_rad", "offset_Nm")):
            yield f"[tolerance] {key} = {value:g} is relative (0.05 = 5 %); per cent?"
    if config.observer.load == "motor_torque" and config.observer.input_filter_Hz == 0.0:
        yield (
            '[observer] load = "motor_torque" accelerates the motor too, and a loop on it may swing; '
            "try input_filter_Hz = 3"
        )


def _of_stage(stage: Stage, tolerance: dict[str, float]) -> Iterator[str]:
    for key, usual in _USUAL.items():
        value = getattr(stage, key)
        if tolerance.get(key, 0.0) < 1.0 and not usual.low <= value <= usual.high:
            words = usual.below if value < usual.low else usual.above
            yield f"{key} = {value:g} is outside of {usual.low:g} to {usual.high:g}; {words}"
    strain = stage.pretension_N / stage.EA_N
    if strain > _STRAIN and max(tolerance.get(k, 0.0) for k in ("EA_N", "pretension_N")) < 1.0:
        yield f"pretension_N/EA_N strains the cable by {100 * strain:.3g} %; is one of the two off?"
    ratio = stage.output_radius_m / stage.input_radius_m
    if not 1.0 / _RATIO <= ratio <= _RATIO and tolerance.get("input_radius_m", 0.0) < 1.0:
        yield f"output_radius_m/input_radius_m = {ratio:.3g}; are both in metres?"
    if stage.breaking_force_N is not None and stage.breaking_force_N < 1.5 * stage.pretension_N:
        yield f"pretension_N = {stage.pretension_N:g} is near breaking_force_N = {stage.breaking_force_N:g}"
    for side in ("output", "input"):
        hold = getattr(stage, f"mu_{side}") * getattr(stage, f"wrap_{side}_rad")
        if hold > 20.0:
            times = exp(min(hold, 700.0))
            yield f"mu_{side} x wrap_{side}_rad = {hold:.3g} lets the cable hold {times:.1g} times its load"


def _reach(config: JointConfig) -> Iterator[str]:
    """Whether the joint's limits unwind a pulley."""
    last, limits = config.drive.stage[-1], config.limits
    for value in (limits.joint_position_min_rad, limits.joint_position_max_rad):
        if value is not None and abs(value) >= last.wrap_output_rad:
            yield f"[limits] joint position {value:g} rad unwinds wrap_output_rad = {last.wrap_output_rad:g}; degrees?"


def _pull(config: JointConfig) -> Iterator[str]:
    """Whether the largest torques would strain a cable by what none bears."""
    first, last, limits = config.drive.stage[0], config.drive.stage[-1], config.limits
    torques = (
        ("joint_torque_max_Nm", limits.joint_torque_max_Nm, last.output_radius_m, last.EA_N),
        ("motor_torque_max_Nm", limits.motor_torque_max_Nm, first.input_radius_m, first.EA_N),
    )
    for key, torque_Nm, radius_m, EA_N in torques:
        if torque_Nm is None or config.tolerance.get("EA_N", 0.0) >= 1.0:
            continue
        strain = torque_Nm / radius_m / EA_N
        if strain > _BREAKS:
            yield f"[limits] {key} = {torque_Nm:g} would strain the cable by {100 * strain:.3g} %; N·mm?"
