"""What holds an effect down whatever its evidence is: a shape that is another's, little of what there is, chance, a
curve that bends to anything."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, Round
from cablecomp.diagnosis.explain.plausible import better_word, drag_at_speed, drags, leaps
from cablecomp.diagnosis.explain.scores import ScoreDifference, demanded
from cablecomp.diagnosis.explain.ties import alone_by_far, surest_alone
from cablecomp.diagnosis.thresholds import LIMITS


def another(final: Model, term: Hypothesis, rounds: Sequence[Round], lead: float, removes: float) -> str:
    """What is to be said of an effect whose shape stands where another is the better word; "" of any other, and of one
    that is alone by far, but where it is known that the other is none of the catalogue's. What gives way in series
    would be the other of a coupling and a clearance: it is none if it is ahead of its rivals, `lead` standard errors,
    and not beside the other. Of another effect with a shape on its upper bound the others were tried in its place:
    where they are far behind, whatever their forms, none of them is the better word; nor of a friction that leaps at
    each reversal, if it `removes` most of the mismatch: what other frictions' forms leave is less.
    """
    stretched = better_word(final.fit, term)
    if not stretched:
        return ""
    shape = term.effect.parameter(stretched)
    if shape.another_is_unlisted:
        return f"with this `{stretched}` it stands for physics that has no name here"
    in_series = [t for t in final.terms if isinstance(t, Hypothesis) and t.effect.in_series]
    needed = LIMITS.z_no_other
    if term.effect.in_series:
        told, needed = len(in_series) == 1, LIMITS.z_unbeaten
    elif shape.role == "presliding":
        told = leaps(final.fit, term) and removes > LIMITS.most_of_it
    else:
        told = not shape.least_is_another
    if (told and lead >= needed) or alone_by_far(rounds, term):
        return ""
    return f"with this `{stretched}` another effect is the better word"


def too_little(removes: float, left: float) -> str:
    """What is to be said of an effect that takes off little beside what is `left` beyond noise, both as shares of the
    calibrated drive's mean square; "" of one that takes off enough."""
    if removes >= LIMITS.little * left:
        return ""
    return f"it takes off {removes:.0%} of the mismatch, and {left:.0%} of it, beyond noise, is left"


def slight(
    final: Model, term: Hypothesis, rounds: Sequence[Round], own: ScoreDifference, removes: float
) -> str:
    """What is to be said of an effect beside others that is not missed, or of one that gives way in series and of which
    their form may do as well what it does, `removes` of the mismatch and `own` of what is left without it; "" of any
    other. What takes off no more than a tie is not missed, whatever it does alone, unless nearly all data choose it
    alone: that others do as well together is chance then. What a further effect would have to be missed by tells it
    from a form.
    """
    if sum(isinstance(t, Hypothesis) for t in final.terms) < 2:
        return ""
    if own.gain < LIMITS.tie and not surest_alone(rounds, term):
        return "without it the others predict data left out as well"
    slightly = removes < LIMITS.slight and own.gain < LIMITS.slight_gain and own.z < LIMITS.z
    if slightly and term.effect.in_series:
        return f"it takes off {removes:.1%} of the mismatch, which the form of what takes off the rest may do as well"
    return ""


def stands_in(final: Model, term: Hypothesis, put_in: Collection[str], own: ScoreDifference) -> str:
    """What is to be said of an effect that was put in the place of another beside others, if data left out do not
    demand it as they would a further one; "" of any other: alone its confidence says what it is worth (trials seeds
    749 to 809 and 970 to 975: held down alone six of six were right, beside others one of four)."""
    alone = sum(isinstance(t, Hypothesis) for t in final.terms) < 2
    if alone or term.name not in put_in or demanded(own):
        return ""
    return f"in another's place, z = {own.z:.1f}; {LIMITS.z:g} are asked for"


def greased(final: Model, term: Hypothesis) -> str:
    """What is to be said of a joint's friction that mostly goes with speed beside friction of the cable's path, whose
    grease drags alike (735/42: a greased path, and this name with 0.98); "" of any other."""
    along = any(isinstance(t, Hypothesis) and t.effect.id == "routing_friction" for t in final.terms)
    if not (along and drags(final.fit, term)):
        return ""
    return "a drag in proportion to speed: grease in the cable's path, whose friction is there, drags alike"


def in_part_a_drag(final: Model, term: Hypothesis, rounds: Sequence[Round], lead: float) -> str:
    """What is to be said of a friction of which a part goes with speed and a part does not, as whatever yields late
    seems to (a greased guide, strands, a frame that flexes); "" of any other, and of one that alone is by far the best
    and `lead` standard errors ahead of its rivals."""
    low, high = LIMITS.mixed_drag
    if not low < drag_at_speed(final.fit, term) < high:
        return ""
    if lead >= LIMITS.z_unbeaten and alone_by_far(rounds, term):
        return ""
    return "in part it goes with speed and in part it does not: whatever yields late does alike"


def hardly_ahead(final: Model, term: Hypothesis, lead: float) -> str:
    """What is to be said of an effect beside others that bends to what their forms leave and is not clearly ahead,
    `lead` standard errors, of none or of its nearest rival; "" of any other."""
    alone = sum(isinstance(t, Hypothesis) for t in final.terms) < 2
    if alone or not term.effect.pliant or lead >= LIMITS.z_pliant:
        return ""
    return (
        f"a curve or a step that other effects' forms leave as well, ahead of its nearest rival or of none by "
        f"{lead:.1f} standard errors; {LIMITS.z_pliant:g} are asked for"
    )


def seen_once(final: Model, term: Hypothesis, lead: float) -> str:
    """The same of a payload of which no recording shows a whole cycle: a torque sensor that drifts reads alike."""
    if not term.cycle_start or lead >= LIMITS.z_seen_once:
        return ""
    period = final.fit.values.get(term.key(term.of_cycle[0]), 0.0)
    time = [e.columns["time_s"] for e in final.fit.problem.evidence]
    if period <= max(float(t[-1] - t[0]) for t in time):
        return ""
    return (
        f"no recording shows a whole cycle, as of a load that is read with a drift, and it is ahead by "
        f"{lead:.1f} standard errors; {LIMITS.z_seen_once:g} are asked for"
    )


def tightened(term: Hypothesis, plain: Sequence[str]) -> str:
    """What is to be said of what changes the pretension slowly, with temperature or time, if a pretension of each
    session's own does as well (it is among what is `plain`, no effect): cables are tightened anew between two sessions,
    which have other temperatures, too; "" of any other. An event is held against that by its standard errors."""
    slow = term.acts_through[0] in ("temperature", "time") and not term.has_instant
    return f"{plain[0]} predicts data left out as well" if slow and plain else ""
