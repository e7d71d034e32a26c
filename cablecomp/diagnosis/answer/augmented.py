"""The joint that a diagnosis ends with: common values, each session's own, laws without a name; replay and
controller run it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot

import numpy as np

from cablecomp.config import Depends, Empirical, JointConfig, Session
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence
from cablecomp.estimation.least_squares import Fit, covariance
from cablecomp.estimation.limits import EXACT
from cablecomp.estimation.standing import standing, value_of
from cablecomp.signal.smoothing import FloatArray

STAGE_OWN = ("pretension_N", "EA_N", "mu_output", "mu_input")


def augmented_joint(
    config: JointConfig, model: Model, laws: Sequence[Empirical], names: Sequence[str]
) -> JointConfig:
    """The configuration with what was fitted, tolerances as they were. Several sessions, or a parameter that depends on
    something: a `[[session]]` for each way in which the drive stood, which claims its recordings."""
    fit = model.fit
    zeros = fit.problem.zeros(fit.x)
    tied = any(isinstance(t, Dependence) and t.on != "session" for t in model.terms)
    sessions = fit.problem.sessions
    first = fit.problem.evidence[0]
    common = standing(fit.problem.config, fit.values, first)
    joint = common.model_copy(
        update={
            "empirical": (*config.empirical, *laws),
            "depends": (*config.depends, *_depends(model, first)),
        }
    )
    if len(sessions) == 1 and not tied:
        return _with_zeros(joint, _zeros_of(zeros, sessions[0]))
    entries = [Session(own=tuple(config.session_own))]
    for session in sessions:
        mine = [e for e in fit.problem.evidence if e.session == session]
        ways = {tuple(e.condition.values()) for e in mine} if tied else {()}
        for way in sorted(ways):
            members = [e for e in mine if not tied or tuple(e.condition.values()) == way]
            stood = standing(fit.problem.config, fit.values, members[0])
            label = session + "".join(
                f" {k} {v:.4g}" for k, v in zip(members[0].condition, way, strict=False)
            )
            entries.append(
                Session(
                    name=label,
                    recordings=_patterns(members, names, session, tied),
                    values={**_zeros_of(zeros, session), **_own(stood, common, fit)},
                )
            )
    return joint.model_copy(update={"session": tuple(entries)})


def with_tolerances(joint: JointConfig, fit: Fit, spread: Mapping[str, float]) -> JointConfig:
    """The joint with tolerances of what was fitted: `spread`, by parameter in its coordinate, never less than what a
    drawing does, and how far sessions lie apart. What has no spread stays as it was."""
    tolerance = dict(joint.tolerance)
    for name in tolerance:
        mine = [k for k, p in enumerate(fit.problem.parameters) if p.base == name and not p.condition]
        widths = [spread.get(fit.problem.parameters[k].name) for k in mine]
        told = [w for w in widths if w is not None]
        if not told or len(told) < len(mine):
            continue
        p = fit.problem.parameters[mine[0]]
        width = hypot(max(*told, EXACT if p.log else 0.0), float(np.std(fit.x[mine])))
        tolerance[name] = float(f"{p.scale * width:.2g}")
    return joint.model_copy(update={"tolerance": tolerance})


def told_by(fit: Fit, stated: Mapping[str, float]) -> dict[str, float]:
    """How well parameters are known after a diagnosis: as wide as their values are stated, radii apart no less than
    from day to day, and no more than before. What the recordings do not tell is left out."""
    bounded = fit.at_bound()
    found = {}
    for p, sd in zip(fit.problem.parameters, np.sqrt(np.diag(covariance(fit))), strict=True):
        if sd > LIMITS.untold * p.sd or p.name in bounded or p.base not in stated:
            continue
        radius = p.base.partition(".")[0].endswith("_radius_m")
        least = LIMITS.known if p.log and not radius else 0.0
        before = stated[p.base] / p.scale
        found[p.name] = min(before, max(LIMITS.wider * float(sd), least))
    return found


def _depends(model: Model, first: Evidence) -> tuple[Depends, ...]:
    """The laws that tie parameters to conditions; the common values are those of the first recording's."""
    fit = model.fit
    found = []
    for term in model.terms:
        if isinstance(term, Dependence) and term.on != "session":
            spanned = [e.condition[term.on] for e in fit.problem.evidence]
            found.append(
                Depends(
                    parameter=term.parameter,
                    on=term.on,
                    per_unit=fit.values[f"{term.parameter}~{term.on}"],
                    at=first.condition[term.on],
                    seen=(min(spanned), max(spanned)),
                )
            )
    return tuple(found)


def _patterns(members: Sequence[Evidence], names: Sequence[str], session: str, tied: bool) -> tuple[str, ...]:
    if not tied and all(session in n.split("/") for n in names if n in {e.name for e in members}):
        return (session,)
    return tuple("/".join(e.name.split("/")[-2:]) for e in members)


def _zeros_of(zeros: Mapping[str, Mapping[str, FloatArray]], session: str) -> dict[str, float]:
    found = {"joint_position_offset_rad": float(zeros[JOINT][session][0])}
    if MOTOR in zeros:
        found["motor_torque_offset_Nm"] = float(zeros[MOTOR][session][0])
    return found


def _with_zeros(joint: JointConfig, zeros: Mapping[str, float]) -> JointConfig:
    return joint.model_copy(update={"sensors": joint.sensors.model_copy(update=dict(zeros))})


def _own(stood: JointConfig, common: JointConfig, fit: Fit) -> dict[str, float]:
    """What of the drive differs where it stood so."""
    found = {}
    names = [*STAGE_OWN, *(p.base for p in fit.problem.parameters if p.session or p.condition)]
    names += [
        f"effect.{e.id}.{k}" for e in common.effect for k, v in e.parameters.items() if isinstance(v, float)
    ]
    for name in dict.fromkeys(names):
        here, there = value_of(stood, name), value_of(common, name)
        if here != there:
            found[name] = here
    return found
