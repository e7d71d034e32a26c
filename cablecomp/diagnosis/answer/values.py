"""A fit's parameters as values with their 1-sigma, the zeros among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cablecomp.config import JointConfig, claimed_by
from cablecomp.diagnosis.result import Value
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.catalogue import role_of
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.least_squares import Fit, covariance
from cablecomp.estimation.limits import STEP
from cablecomp.estimation.parallel import side_by_side
from cablecomp.estimation.standing import JOINT_ZERO, ONE_CLAIM, in_its_place, value_of
from cablecomp.signal.noise import reading_sigma
from cablecomp.signal.smoothing import FloatArray


def drive_values(fit: Fit, config: JointConfig) -> tuple[Value, ...]:
    """The parameters of the drive and of the effects that `config` has, and the joint encoder's zeros; nominal values
    as `config` has them."""
    known = tuple(f"effect.{e.id}." for e in config.effect)
    mine = [k for k, p in enumerate(fit.problem.parameters) if not p.of_effect or p.base.startswith(known)]
    return (*_parameters(fit, mine, config), *_zeros(fit, config))


def effect_values(fit: Fit) -> tuple[Value, ...]:
    """The effects' parameters, named `effect.ID.KEY`."""
    return _parameters(fit, [k for k, p in enumerate(fit.problem.parameters) if p.of_effect])


def as_trials_say(values: Sequence[Value]) -> tuple[Value, ...]:
    """The values with deviations as wide as blind trials ask for (`LIMITS.wider`)."""
    return tuple(replace(v, sd=LIMITS.wider * v.sd) for v in values)


def _parameters(fit: Fit, mine: Sequence[int], config: JointConfig | None = None) -> tuple[Value, ...]:
    sd = np.sqrt(np.maximum(np.diag(covariance(fit)), 0.0))
    found = []
    for k in mine:
        p, x = fit.problem.parameters[k], float(fit.x[k])
        nominal = None
        if config is not None and not p.condition:
            nominal = value_of(_stated(fit, config, p.session), p.base)
        value, own = p.value(x), float(sd[k] * abs(p.slope(x)))
        when = _when(fit, p.base, value)
        if when is not None:
            own = reading_sigma(own, _gap_around(fit, when))  # between two rows no fit can tell where
        found.append(Value(p.name, value, own, nominal, p.session))
    return tuple(found)


def _stated(fit: Fit, config: JointConfig, session: str | None) -> JointConfig:
    """The joint as the configuration has it in a session; without one, in general."""
    recording = next((e for e in fit.problem.evidence if e.session == session), None)
    return config if recording is None else in_its_place(config, recording)


def _when(fit: Fit, name: str, value: float) -> float | None:
    """The instant that an event's parameter tells: its own, or, of how long it takes, the end; None of any other."""
    role, effect = role_of(name), name.rpartition(".")[0]
    if role != "duration":
        return value if role == "instant" else None
    begins = (v for k, v in fit.values.items() if k.startswith(f"{effect}.") and role_of(k) == "instant")
    return next((b + value for b in begins), None)


def _gap_around(fit: Fit, instant_s: float) -> float:
    """Time [s] between the judged rows on both sides of an instant; 0 where there are none."""
    gaps = []
    for e in fit.problem.evidence:
        time = e.at_rows("time_s")[e.counted[JOINT]]
        k = int(np.searchsorted(time, instant_s))
        if 0 < k < len(time):
            gaps.append(float(time[k] - time[k - 1]))
    return max(gaps, default=0.0)


def _zeros(fit: Fit, config: JointConfig) -> tuple[Value, ...]:
    problem = fit.problem
    zeros = problem.zeros(fit.x)[JOINT]
    many = len(problem.sessions) > 1
    found = []
    for session, sd in zip(problem.sessions, _sd_of_zeros(fit, zeros), strict=True):
        name = JOINT_ZERO + (f"@{session}" if many else "")
        nominal = _stated_zero(fit, config, session)
        found.append(Value(name, float(zeros[session][0]), float(sd), nominal, session if many else None))
    return tuple(found)


def _sd_of_zeros(fit: Fit, zeros: Mapping[str, FloatArray]) -> FloatArray:
    """1-sigma of each session's zero [rad]: of its own, its recordings' departures in it, and of the parameters that it
    goes along with (of a load to one side a softer cable and another zero do nearly the same)."""
    problem, high = fit.problem, fit.problem.bounds()[1]
    here = np.array([zeros[s][0] for s in problem.sessions])

    def slope(k: int) -> FloatArray:
        step = STEP if fit.x[k] + STEP <= high[k] else -STEP
        moved = fit.x.copy()
        moved[k] += step
        try:
            there = problem.zeros(moved)[JOINT]
        except InputError:
            return np.zeros(len(here))
        return np.array([there[s][0] - z for s, z in zip(problem.sessions, here, strict=True)]) / step

    slopes = np.reshape(list(side_by_side(slope, range(len(fit.x)))), (len(fit.x), len(here)))
    own = problem.bases[JOINT].sd[: len(here)]
    return np.asarray(np.sqrt(own**2 + np.einsum("ks,kl,ls->s", slopes, covariance(fit), slopes)))


def _stated_zero(fit: Fit, config: JointConfig, session: str) -> float:
    """The joint encoder's zero as the configuration has it in a session: as its own entry states it, or that of a part
    of it; without one, in general."""
    names = (e.name for e in fit.problem.evidence if e.session == session)
    claims = [c for name in names if (c := claimed_by(config, Path(name), ONE_CLAIM)) is not None]
    stated = [
        c.values[JOINT_ZERO]
        for c in sorted(claims, key=lambda c: c.name != session)
        if JOINT_ZERO in c.values
    ]
    return stated[0] if stated else config.sensors.joint_position_offset_rad
