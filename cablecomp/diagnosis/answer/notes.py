"""What a diagnosis assumed and left out, in a line each."""

from __future__ import annotations

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.body import read_by_some, short
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.neighbours import not_told_apart
from cablecomp.diagnosis.explain.turned import stands_still
from cablecomp.diagnosis.explain.usual import usual_of
from cablecomp.diagnosis.outcome import Case
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.catalogue import late_channels
from cablecomp.estimation.evidence import JOINT, MOTOR, load_channel
from cablecomp.recording.replay import required_channels
from cablecomp.signal.smoothing import step_s

SAID = 4
"""Recordings that a note names, or tells the clock of; of more, it says how many."""


def notes(case: Case) -> tuple[str, ...]:
    """What was assumed and what was left out."""
    body, drive = case.body, case.drive
    load = load_channel(case.config, body.used[0].columns)
    found = [load_said(case.config, load)]
    usual = usual_of(case.config, JOINT)
    if usual:
        found.append(
            f"this joint is known to leave {usual:.3g} rad of its angle ([remainder]): what stands out of that is named"
        )
    if drive.lost_rows:
        total = sum(len(e.rows) for e in body.used)
        found.append(f"{drive.lost_rows} of {total} rows given up to the history before the first sample")
    left = [e.quiet.get(JOINT, 1.0) / e.group for e in drive.fit.problem.evidence]
    percent = round(100 * float(np.sqrt(np.mean(left))))
    if percent < 100:
        found.append(
            "what was read between the rows that are judged is averaged into them: they have "
            f"{percent} % of a reading's noise, and errors are of such rows"
        )
    outliers = sum(e.outliers for e in body.used)
    if outliers:
        found.append(f"{outliers} single readings set aside as outliers")
    unread = [f"{', '.join(e.unread)} of {short(e.name)}" for e in body.used if e.unread]
    if unread:
        found.append(f"hardly read, and left out: {'; '.join(unread)}")
    for channel, names in read_by_some(case.config, body.used).items():
        more = f" and {len(names) - SAID} more" if len(names) > SAID else ""
        found.append(
            f"{channel} of {', '.join(names[:SAID])}{more} is left out: not every recording tells it; diagnose those "
            "that do by themselves"
        )
    for channel, share in not_told_apart(case.config, body.used).items():
        found.append(
            f"{channel} goes with the joint's own motion ({100 * share:.0f} % of it): whether a neighbour "
            "loads the joint by it cannot be told from the joint's own drive, and is not asked"
        )
    if stands_still(case.config, body.used):
        found.append(
            f"neither pulley is turned by {LIMITS.least_turn_rad:g} rad: a weight, a run-out or a groove cannot be "
            "told from what goes with the load then, and is not asked for unless another joint turns it"
        )
    if body.clock_s:
        begun = [f"of {short(name)} is {s:.4g} s" for name, s in body.clock_s.items()]
        more = f" and {len(begun) - SAID} more, `clock_s` in diagnosis.json" if len(begun) > SAID else ""
        found.append(
            "recordings that start their own clock are taken one after the other; on the clock of this page, 0 s "
            f"{', '.join(begun[:SAID])}{more}"
        )
    return tuple(found)


def load_said(config: JointConfig, load: str | None) -> str:
    """Where the load was taken from (`load`: its channel), and whether the joint as it runs has it from elsewhere."""
    stated = config.observer.load
    if load is None and stated == "motor_torque":
        return (
            f"{MOTOR}, which [observer] load = '{stated}' reads, is not recorded: the joint is taken as free"
        )
    if load is None:
        return "no load channel: the joint is taken as free"
    if load in required_channels(config):
        return f"load from {load}"
    return (
        f"load from {load}; [observer] load = '{stated}' does not read it, and errors of replay and of the joint as it "
        "runs are others: set load = 'joint_torque' to compare"
    )


def by_the_clock(model: Model) -> tuple[str, ...]:
    """What the written joint expects by the recordings' clock: effects that come and go."""
    fit, found = model.fit, []
    joint = fit.problem.joint(fit.x, fit.problem.evidence[0])  # an amount may be a session's own
    stood = {e.id: e.parameters for e in joint.effect}
    time = [e.columns["time_s"] for e in fit.problem.evidence]
    span = max(float(t[-1]) for t in time) - min(float(t[0]) for t in time)
    for term in (t for t in model.terms if isinstance(t, Hypothesis)):
        own = stood[term.effect.id]
        if term.cycle_start not in own:
            continue
        amount, when, period, _, always = (
            float(own[n]) for n in (term.amount.name, term.cycle_start, *term.of_cycle)
        )
        again = f"every {period:.4g} s" if 2.0 * period <= span else "(seen once: when again is not told)"
        found.append(
            f"the written joint expects the payload of {term.effect.id} {again} from {when:.4g} s on by these "
            f"recordings' clock; where another runs, set its `{term.cycle_start}`; where nothing is picked "
            f"up, `{term.of_cycle[0]} = 0` and `{term.amount.name} = {amount * always:.3g}`"
        )
    return tuple(found)


def carried_on(model: Model) -> tuple[str, ...]:
    """What errors are with, and a joint that runs is without: readings that came later."""
    fit = model.fit
    first = fit.problem.evidence[0]
    _, late = late_channels(fit.problem.joint(fit.x, first))
    ahead_s = max((max(one.load_s, -one.joint_s) for one in late), default=0.0)
    if ahead_s <= step_s(first.columns["time_s"]):
        return ()
    return (
        f"what is stamped up to {1e3 * ahead_s:.3g} ms late was read in time, as a whole recording allows, and errors "
        "are so; live and in `replay` the joint is carried straight on over that time, and more is left at corners",
    )
