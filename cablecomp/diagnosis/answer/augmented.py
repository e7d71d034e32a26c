"""The joint that a diagnosis ends with: common values, each session's own, laws without a name; replay and
controller run it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from glob import escape
from math import hypot, inf
from pathlib import Path

import numpy as np

from cablecomp.config import Depends, Empirical, JointConfig, ObserverOptions, Session, claiming, with_values
from cablecomp.config.sessions import ZEROS
from cablecomp.diagnosis.body import paths_apart
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, load_channel
from cablecomp.estimation.least_squares import Fit, covariance, rms_left
from cablecomp.estimation.limits import EXACT
from cablecomp.estimation.parameter import known_by_factor
from cablecomp.estimation.standing import ON_THE_CLOCK, apart_of, on_the_clock, standing, value_of
from cablecomp.signal.smoothing import FloatArray

STAGE_OWN = ("pretension_N", "EA_N", "mu_output", "mu_input")


def augmented_joint(
    config: JointConfig, model: Model, laws: Sequence[Empirical], kept: Sequence[Evidence] = ()
) -> JointConfig:
    """The configuration with what was fitted, tolerances as they were. Several sessions, a parameter that depends on
    something, or an event: a `[[session]]` for each way in which the drive stood, which claims its recordings, those
    `kept` for the end among them."""
    fit = model.fit
    zeros = fit.problem.zeros(fit.x)
    first, latest = fit.problem.evidence[0], fit.problem.evidence[-1]
    common = _afterwards(_stood(config, fit, replace(first, apart={})), model, latest)
    joint = common.model_copy(
        update={
            "observer": _loaded(config, [*fit.problem.evidence, *kept]),
            "empirical": (*config.empirical, *laws),
            "depends": (*config.depends, *_depends(model, first)),
        }
    )
    sessions = fit.problem.sessions
    if len(sessions) == 1:
        joint = _with_zeros(joint, _zeros_of(zeros, sessions[0]))
    known = [*fit.problem.evidence, *kept]
    paths = paths_apart([e.name for e in known])
    entries: list[Session] = []
    held: dict[str, tuple[str, ...]] = {}
    for label, members in _ways(model):
        recordings = [*members, *(e for e in kept if _alike(e, members[0], model))]
        last = max(recordings, key=lambda e: float(e.columns["time_s"][0]))
        session = members[0].session
        own_zeros = _zeros_of(zeros, session)
        after = _afterwards(_stood(config, fit, last), model, last)
        alone = []
        for e in recordings:
            now = _meanwhile(_stood(config, fit, e), model, e)
            moved = _stands_apart(fit, zeros[JOINT], e)
            if now != after or moved:
                values = {**(_zeros_of(zeros, e.name) if moved else own_zeros), **_own(now, common, fit)}
                name, claims = f"{label} {paths[e.name]}", (escape(paths[e.name]),)
                alone.append(Session(name=name, mounting=session, recordings=claims, values=values))
        theirs = _own_laws(config, members[0])
        if len(sessions) > 1 or _tied(model) or after != common or theirs:
            values = {**own_zeros, **_own(after, common, fit)}
            part = "" if label == session else session
            whole = () if part else _folder(session, recordings, known)
            every = [escape(path) for path in whole or [paths[e.name] for e in recordings]]
            rest = tuple(path for path in every if (path,) not in {s.recordings for s in alone})
            entries.append(Session(name=label, mounting=part, recordings=rest, values=values))
        entries += alone
        held |= {s.name: (session, *theirs) for s in entries if s.name not in held}
    entries += [s for s in _others(config, model, common, known) if s.name not in {e.name for e in entries}]
    held |= {s.name: (s.name, s.mounting) for s in entries if s.name not in held}
    joint = joint.model_copy(update={"empirical": tuple(_of_sessions(joint.empirical, entries, held))})
    if not entries:
        return joint
    return joint.model_copy(update={"session": (Session(own=tuple(config.session_own)), *entries)})


def _own_laws(config: JointConfig, e: Evidence) -> tuple[str, ...]:
    """The names of the configuration's sessions that a recording belongs to and that have laws of their own."""
    return tuple(dict.fromkeys(law.session for law in config.empirical if law.session in e.claimed))


def _of_sessions(
    laws: Iterable[Empirical], entries: Sequence[Session], held: Mapping[str, Collection[str]]
) -> Iterator[Empirical]:
    """The laws; those of one session under the names that the `entries` in which they `held` have now. A law without
    one goes."""
    for law in laws:
        if not law.session:
            yield law
            continue
        here = [s for s in entries if law.session in held[s.name]]
        names = {s.name for s in here}
        now = (
            law.session if law.session in (s.name, s.mounting) else s.name
            for s in here
            if s.mounting not in names
        )
        yield from (law.model_copy(update={"session": name}) for name in dict.fromkeys(now))


def _stands_apart(fit: Fit, zeros: Mapping[str, FloatArray], e: Evidence) -> bool:
    """Whether a recording has a zero of its own in the joint that is written: set anew, or, of few, moved by its
    history further than all that is left."""
    if e.name not in zeros:
        return False
    if e.name in fit.problem.weighing.moved.get(JOINT, ()):
        return True
    apart = abs(float(zeros[e.name][0] - zeros[e.session][0]))
    return len(fit.problem.evidence) < LIMITS.recordings and apart > rms_left(fit)


def _loaded(config: JointConfig, recordings: Iterable[Evidence]) -> ObserverOptions:
    """The observer's options; where no recording holds the load that it would read, the joint was taken as free, and
    is so later on."""
    free = all(load_channel(config, e.columns) is None for e in recordings)
    if not free or config.observer.load == "both_encoders":
        return config.observer
    return config.observer.model_copy(update={"load": "none"})


def _others(
    config: JointConfig, model: Model, common: JointConfig, known: Sequence[Evidence]
) -> Iterator[Session]:
    """The configuration's sessions that claim none of the recordings: beside the new common values as they stood
    beside the old, without the events found now."""
    fit, first = model.fit, model.fit.problem.evidence[0]
    claimed = {s.name for e in known for s in claiming(config, Path(e.name))}
    for s in config.sessions:
        if s.name in claimed:
            continue
        there = replace(first, session="", apart=apart_of(config, s.values))
        stood = _with_events(standing(fit.problem.config, fit.values, there), model, 0.0, inf, -inf)
        zeros = {n: v for n, v in s.values.items() if n in ZEROS}
        yield s.model_copy(update={"values": {**zeros, **_own(stood, common, fit, s.values)}})


def _stood(config: JointConfig, fit: Fit, e: Evidence) -> JointConfig:
    """The joint as it stood in a recording; events that the configuration states, on the recording's own clock."""
    own = {
        n: e.apart[n]._replace(addend=e.apart[n].addend - e.shift_s)
        for n in on_the_clock(config)
        if n in e.apart
    }
    return standing(fit.problem.config, fit.values, replace(e, apart={**e.apart, **own}))


def _tied(model: Model) -> bool:
    """Whether a parameter grows with a condition."""
    found = any(isinstance(t, Dependence) and t.on != "session" for t in model.terms)
    return found or bool(model.fit.problem.config.depends)


def _alike(e: Evidence, other: Evidence, model: Model) -> bool:
    """Whether the drive stood alike in two recordings, events apart."""
    here = tuple(e.condition.values()) == tuple(other.condition.values())
    laws = [_own_laws(model.fit.problem.config, r) for r in (e, other)]
    return e.session == other.session and (here or not _tied(model)) and laws[0] == laws[1]


def _ways(model: Model) -> Iterator[tuple[str, list[Evidence]]]:
    """The ways in which the drive stood, each with its name and its recordings."""
    evidence = model.fit.problem.evidence
    for session in model.fit.problem.sessions:
        mine = [e for e in evidence if e.session == session]
        laws = {e.name: _own_laws(model.fit.problem.config, e) for e in mine}
        apart = len(set(laws.values())) > 1
        stood = {e.name: (tuple(e.condition.values()) if _tied(model) else (), laws[e.name]) for e in mine}
        for way in sorted(set(stood.values())):
            members = [e for e in mine if stood[e.name] == way]
            named = zip(members[0].condition, way[0], strict=False)
            words = [f" {k} {v:.4g}" for k, v in named] + [f" {law}" for law in way[1] if apart]
            yield session + "".join(words), members


def _meanwhile(joint: JointConfig, model: Model, e: Evidence) -> JointConfig:
    """The joint with the model's events as they stand on a recording's own clock: yet to come, under way, or over
    before it began. Where recordings share one clock, as it is."""
    if _one_clock(model):
        return joint
    begin_s, end_s = (float(e.columns["time_s"][k]) - e.shift_s for k in (0, -1))
    return _with_events(joint, model, e.shift_s, begin_s, end_s)


def _afterwards(joint: JointConfig, model: Model, e: Evidence) -> JointConfig:
    """The same after a recording: what has begun is over."""
    if _one_clock(model):
        return joint
    end_s = float(e.columns["time_s"][-1]) - e.shift_s
    return _with_events(joint, model, e.shift_s, inf, end_s)


def _one_clock(model: Model) -> bool:
    return not any(e.shift_s for e in model.fit.problem.evidence)


def _with_events(
    joint: JointConfig, model: Model, shift_s: float, over_by_s: float, begun_by_s: float
) -> JointConfig:
    """The joint with events on a clock that is `shift_s` behind that of the fit: those that begin later than
    `begun_by_s` on it do not happen, those that end before `over_by_s` have been."""
    changes: dict[str, float] = {}
    for term in (t for t in model.terms if isinstance(t, Hypothesis)):
        given = next(dict(e.parameters) for e in joint.effect if e.id == term.effect.id)
        lasts_s = given.get(term.duration, 0.0)
        for p in (p for p in term.effect.parameters if p.role in ON_THE_CLOCK and p.name in given):
            instant_s = given[p.name] - shift_s
            if p.role == "instant" and instant_s > begun_by_s:
                changes[term.key(term.amount.name)] = term.amount.neutral
            elif p.role == "instant" and instant_s + lasts_s <= over_by_s:
                changes[term.key(p.name)] = -lasts_s
            else:
                changes[term.key(p.name)] = instant_s
    return with_values(joint, changes)


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


def with_tolerances_of(joint: JointConfig, model: Model) -> JointConfig:
    """The joint with tolerances of how much of each effect was found, events apart, where the recordings tell it: as
    wide as stated, no less than from day to day. A later diagnosis or calibration moves them within these."""
    fit = model.fit
    sds = np.sqrt(np.diag(covariance(fit)))
    tolerance = dict(joint.tolerance)
    for term in (t for t in model.terms if isinstance(t, Hypothesis) and not t.has_instant):
        for p, x, sd in zip(fit.problem.parameters, fit.x, sds, strict=True):
            known = term.effect.parameter(p.base.rpartition(".")[2]) if p.base in _keys(term) else None
            if known is None or known.shape or p.session or p.condition:
                continue
            value = p.value(float(x))
            width = LIMITS.wider * float(sd) * abs(p.slope(float(x)))
            if not value or width > LIMITS.untold * abs(value):
                continue
            share = max(width / abs(value), LIMITS.known)
            tolerance[p.base] = float(f"{share if known_by_factor(known, value) else share * abs(value):.2g}")
    return joint.model_copy(update={"tolerance": tolerance})


def _keys(term: Hypothesis) -> set[str]:
    return {term.key(p.name) for p in term.effect.parameters}


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


def _folder(session: str, mine: Sequence[Evidence], known: Sequence[Evidence]) -> tuple[str, ...]:
    """The folder that a session is called after, where its recordings lie in it, no others do, and no
    other's whole path is the end of one of theirs."""
    names = {e.name for e in mine}
    others = {e.name for e in known} - names
    taken = any(session in o.split("/") or n.endswith(f"/{o}") for o in others for n in names)
    return (session,) if not taken and all(session in n.split("/") for n in names) else ()


def _zeros_of(zeros: Mapping[str, Mapping[str, FloatArray]], session: str) -> dict[str, float]:
    found = {"joint_position_offset_rad": float(zeros[JOINT][session][0])}
    if MOTOR in zeros:
        found["motor_torque_offset_Nm"] = float(zeros[MOTOR][session][0])
    return found


def _with_zeros(joint: JointConfig, zeros: Mapping[str, float]) -> JointConfig:
    return joint.model_copy(update={"sensors": joint.sensors.model_copy(update=dict(zeros))})


def _own(stood: JointConfig, common: JointConfig, fit: Fit, further: Iterable[str] = ()) -> dict[str, float]:
    """What of the drive differs where it stood so; `further` names may."""
    found = {}
    names = [*STAGE_OWN, *(p.base for p in fit.problem.parameters if p.session or p.condition)]
    names += [n for e in fit.problem.evidence for n in e.apart]
    names += [n for n in further if n not in ZEROS]
    names += [
        f"effect.{e.id}.{k}" for e in common.effect for k, v in e.parameters.items() if isinstance(v, float)
    ]
    for name in dict.fromkeys(names):
        here, there = value_of(stood, name), value_of(common, name)
        if here != there:
            found[name] = here
    return found
