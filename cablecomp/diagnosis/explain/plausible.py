"""Whether an effect, as fitted, is what it stands for: an amount that is plausible, an instant in a recording, a shape
that is its own."""

from __future__ import annotations

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.instants import inside_of
from cablecomp.diagnosis.explain.starts import width
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, MOTOR
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import Parameter, vague_drive
from cablecomp.estimation.simulate import load_of


def amount_of(fit: Fit, h: Hypothesis) -> tuple[Parameter, float] | None:
    """The free parameter that is an effect's own amount, and its value; None where there is none of it."""
    name = h.key(h.amount.name)
    for p, x in zip(fit.problem.parameters, fit.x, strict=True):
        if p.name == name:
            return p, p.value(float(x))
    return None


def runs_away(fit: Fit, h: Hypothesis) -> bool:
    """Whether an effect's amount lies far beyond what is plausible, for the drive as configured and as fitted, and
    nothing holds it: it is on its bound, or the drive is known by order of magnitude only (a pulley whose centre is a
    third of its radius off bends a short stroke to anything)."""
    found = amount_of(fit, h)
    if found is None:
        return False
    p, value = found
    configured = abs(value) / _most(h, fit.problem.config, fit)
    if min(configured, over_plausible(fit, h)) <= LIMITS.beyond_plausible:
        return False
    return vague_drive(fit.problem.parameters) or abs(value) > LIMITS.on_bound * abs(
        p.high if value > 0.0 else p.low
    )


def over_plausible(fit: Fit, h: Hypothesis) -> float:
    """An effect's amount over the largest that is plausible for the drive as fitted; 0 where it has none."""
    found = amount_of(fit, h)
    joint = fit.problem.joint(fit.x, fit.problem.evidence[0])
    return 0.0 if found is None else abs(found[1]) / _most(h, joint, fit)


def better_word(fit: Fit, h: Hypothesis) -> str:
    """The shape of an effect that stands where another effect is the better word (`Parameter.is_another`); "" where
    none does. Near the most that is plausible it counts as on it; the least is the plain law but where that is said to
    be another (`Parameter.least_is_another`)."""
    own = _own(fit, h)
    at = zip(fit.problem.parameters, fit.x, strict=True)
    on_high = {p.base for p, x in at if p.value(float(x)) > LIMITS.near_bound * p.high}
    for p in h.effect.parameters:
        below = p.least_is_another and own[p.name] < p.bounds(fit.problem.config)[0]
        if below or p.is_another(own, h.key(p.name) in on_high):
            return p.name
    shape = h.effect.of_role("presliding")
    if (
        shape is not None
        and not drags(fit, h)
        and (own[shape.name] > _presliding(fit, h)[1] or leaps(fit, h))
    ):
        return shape.name
    return ""


def _own(fit: Fit, h: Hypothesis) -> dict[str, float]:
    """An effect's values as fitted."""
    return {p.name: fit.values.get(h.key(p.name), p.omitted or p.neutral) for p in h.effect.parameters}


def drags(fit: Fit, h: Hypothesis) -> bool:
    """Whether what goes with speed is most of a friction: within which turn the rest builds up says nothing of it
    then."""
    return drag_at_speed(fit, h) > 1.0


def drag_at_speed(fit: Fit, h: Hypothesis) -> float:
    """What goes with speed of a friction over what does not, at the speed at which the joint is usually moved (RMS)."""
    own = _own(fit, h)
    at_speed = sum(own[p.name] for p in h.effect.parameters if p.of_speed)
    if not at_speed:
        return 0.0
    rates = np.concatenate([e.motor_rate for e in fit.problem.evidence])
    return at_speed * fit.problem.config.drive.ratio * float(np.sqrt(np.nanmean(rates**2)))


def leaps(fit: Fit, h: Hypothesis) -> bool:
    """Whether a friction builds up within so little of a turn that another is the better word."""
    shape = h.effect.of_role("presliding")
    return shape is not None and 0.0 < _own(fit, h)[shape.name] < _presliding(fit, h)[0]


def _presliding(fit: Fit, h: Hypothesis) -> tuple[float, float]:
    """The turn within which a joint's own friction builds up, at least and at most [rad]: beyond it what gives way is a
    hysteresis of the drive; what leaps at each reversal is what other frictions' forms leave. No bounds beside a drive
    known by order of magnitude, whose deflection nothing tells from it."""
    if MOTOR in h.effect.needs or vague_drive(fit.problem.parameters):
        return 0.0, np.inf
    seen = max((e.deflection_rad for e in fit.problem.evidence if JOINT in e.columns), default=np.nan)
    least, most = LIMITS.presliding
    return least * seen, most * seen


def falls_between(fit: Fit, h: Hypothesis) -> bool:
    """Whether an event has moved to where nothing shows it: between two sessions, where mounting does as much; beside a
    drive known by order of magnitude, to where none of several recordings does: they differ in load and order, and such
    a drive may differ from one to the next in many ways."""
    evidence = fit.problem.evidence
    if not h.has_instant or len(evidence) == 1:
        return False
    middle = fit.values[h.key(h.instant)] + 0.5 * fit.values.get(h.key(h.duration), 0.0)
    vague = vague_drive(fit.problem.parameters)
    within: dict[str, list[float]] = {}
    for e in evidence:
        within.setdefault(e.name if vague else e.session, []).extend(inside_of(e))
    stretches = [(min(ends), max(ends)) for ends in within.values()]
    if any(a <= middle <= b for a, b in stretches):
        return False
    # of a known drive it may go on before the first session and beyond the last
    return vague or min(a for a, _ in stretches) <= middle <= max(b for _, b in stretches)


def _most(h: Hypothesis, joint: JointConfig, fit: Fit) -> float:
    """The largest plausible amount of an effect; a load that its channel does not see, a weight's or a neighbour's, may
    be as large as those that it does, and what holds the motor, which no cable bears, as the torques that it was seen
    to give."""
    most = max(abs(b) for b in h.amount.bounds(joint))
    if MOTOR in h.effect.needs:
        given = (np.max(np.abs(e.columns[MOTOR])) for e in fit.problem.evidence if MOTOR in e.columns)
        return max(most, *(float(torque) for torque in given))
    if h.has_phase and h.amount.unit == "N m":
        per_load = 1.0
    elif h.amount.per_reading and h.amount.unit == "N m/unit":
        per_load = 1.0 / width(fit.problem.evidence, h.channel)
    else:
        return most
    loads = (np.max(np.abs(load_of(joint, e.columns))) for e in fit.problem.evidence)
    return max(most, *(per_load * float(load) for load in loads))
