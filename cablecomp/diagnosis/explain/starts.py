"""Where the parameters of a hypothesis start, by what they say and by what the recordings cover."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.explain.instants import instants
from cablecomp.effects import Effect, Parameter
from cablecomp.effects.base import wrap_deflection
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.parameter import of_drive, vague_drive


def absolute(
    effect: Effect, name: str, tried: float, config: JointConfig, evidence: Sequence[Evidence], channel: str
) -> float:
    """A value to try in the parameter's unit."""
    p = effect.parameter(name)
    if p.role in ("bend", "slack"):
        reach = width(evidence, channel) if channel else _reach(evidence, effect.needs[0])
        return tried / reach if p.role == "bend" else tried * reach
    if p.role == "tilt":
        return tried / width(evidence, channel)
    if p.role == "begin":
        return tried + min(float(e.columns["time_s"][0]) for e in evidence)
    return tried if p.scale is None else tried * p.scale(config)


def grid(
    p: Parameter, config: JointConfig, evidence: Sequence[Evidence], channel: str = ""
) -> tuple[float, ...]:
    """Where a shape starts, of an effect that reads this channel, if any: by what it says (`Parameter.role`)."""
    low, high = p.bounds(config)
    if p.role == "place":
        stood = np.concatenate([e.columns[JOINT][e.before_the_end] for e in evidence])
        return tuple(float(v) for v in np.nanquantile(stood, (0.1, 0.3, 0.5, 0.7, 0.9)))
    if p.role == "tilt":
        return tuple(turn / width(evidence, channel) for turn in (-1.2, -0.4, 0.4, 1.2))
    if p.role == "phase":
        return (0.0, 0.5 * math.pi)
    if p.role == "instant":
        return instants(evidence, between=not vague_drive(of_drive(config)))
    if p.role == "reference":
        means = [
            float(np.mean(e.columns["temperature_degC"])) for e in evidence if "temperature_degC" in e.columns
        ]
        return (float(np.mean(means)) if means else 20.0,)
    if p.role == "begin":  # with each recording's first sample, or with the first of all
        return (math.nan, min(float(e.columns["time_s"][0]) for e in evidence))
    if p.role == "length":
        return (0.02 * high, 0.25 * high)
    if p.role == "presliding":
        # of a joint that is held, and does not move by one count: what friction of its wraps makes
        turns = [np.ptp(e.columns[JOINT][e.before_the_end]) for e in evidence]
        reach = float(np.median(turns)) or wrap_deflection(config)
        wide = np.geomspace(max(low, 1e-3 * reach), max(0.05 * reach, 3e-3 * reach), 3)
        # as good as none, beside what friction of the wraps makes; of a loose drive the path's friction is as much
        least = max(low, min(1e-3 * reach, 1e-3 * wrap_deflection(config)))
        none = () if vague_drive(of_drive(config)) or least > 0.5 * wide[0] else (least,)
        return tuple(float(v) for v in (*none, *wide))
    if p.log:
        return tuple(float(v) for v in np.geomspace(low, high, p.points + 2)[1:-1])
    return (0.5 * (low + high),)


def width(evidence: Sequence[Evidence], channel: str) -> float:
    """The largest reading of a channel, of either sign."""
    return max(float(np.nanmax(np.abs(e.columns[channel]))) for e in evidence)


def _reach(evidence: Sequence[Evidence], channel: str) -> float:
    """Half of what a channel covers over all recordings."""
    read = [e.columns[channel][e.before_the_end] for e in evidence if channel in e.columns]
    readings = np.concatenate(read)
    return 0.5 * float(np.nanmax(readings) - np.nanmin(readings))
