"""The verdict in one word, and what it rests on: does the model predict, is what it leaves more than noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cablecomp.diagnosis.answer.alike import drag_alike
from cablecomp.diagnosis.body import short
from cablecomp.diagnosis.calibration.drive import Calibrated
from cablecomp.diagnosis.explain.dependence import unjudged
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.model import Model, bears
from cablecomp.diagnosis.locate.location import Location
from cablecomp.diagnosis.locate.series import Series
from cablecomp.diagnosis.result import Errors
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, rms_left


def verdict_of(named: bool, structured: bool, drive: Calibrated, kept: Model) -> str:
    """explained | partly explained | unexplained | recalibrate | consistent."""
    if named:
        return "partly explained" if structured else "explained"
    if structured:
        return "unexplained"
    before, after = rms_left(drive.nominal), rms_left(kept.fit)
    return "recalibrate" if after < LIMITS.recalibrate * before else "consistent"


def predicts(
    before: Fit,
    after: Model,
    baseline: Errors,
    augmented: Errors,
    noise_rad: float,
) -> bool:
    """Whether a fit done again without a part predicts that part better than the calibrated drive does (clearly, where
    that is near the noise already); does so clearly where each recording has a zero of its own (zeros that depart by
    more than any effect does hide all of them); or whether another channel than the joint's angle is followed
    better (near the noise one that an effect of the model cannot be told without)."""
    near = baseline.heldout_rmse_rad < LIMITS.near_noise * noise_rad
    if augmented.heldout_rmse_rad < (LIMITS.hardly if near else 1.0) * baseline.heldout_rmse_rad:
        return True
    if augmented.heldout_own_zero_rmse_rad < LIMITS.followed * baseline.heldout_own_zero_rmse_rad:
        return True
    shown = {c for t in after.terms if isinstance(t, Hypothesis) for c in t.effect.needs}
    others = [c for c in before.problem.channels if c != JOINT and (c in shown or not near)]
    return any(rms_left(after.fit, c) < LIMITS.followed * rms_left(before, c) for c in others)


def is_structured(
    found: Location, series: Series, repeated_rad: float | None, usual_rad: float, named: bool
) -> bool:
    """Whether what is left is more than noise, than what repeats, and than what the joint is known to leave, and
    follows something (near these, that part of it alone has to be as much more); beside a name, far more than that is
    enough, and where nothing is named, far more than noise and clearly more than what repeats (an event makes repeats
    differ, too)."""
    left = float(np.mean(series.residual**2))
    noise, yardstick = float(np.mean(series.sigma)), max(repeated_rad or 0.0, usual_rad)
    shown = found.significant(LIMITS.p_structured)
    if shown:
        usual = max(noise, yardstick) ** 2
        near = left < LIMITS.near_noise**2 * usual
        part = max(m.share for m in shown) if near else 1.0
        return left > LIMITS.structured * usual and part * left > (LIMITS.structured - 1.0) * usual
    of_noise = LIMITS.beyond_noise if named else LIMITS.far_beyond_noise
    return left > max(of_noise * noise**2, LIMITS.beyond_noise * yardstick**2)


def share_left(drive: Calibrated, final: Model) -> float:
    """Mean square beyond noise left by the final model over that of the calibrated drive."""
    noise = drive.floor_rad**2
    before, after = rms_left(drive.fit) ** 2 - noise, rms_left(final.fit) ** 2 - noise
    return float(np.clip(after / max(before, 1e-3 * noise), 0.0, 1.0))


def warnings_of(model: Model, cut_short: bool) -> tuple[str, ...]:
    """What speaks against trusting the model as it is, one line each; `cut_short`: not all was tried."""
    lines = [f"{name} ended on its bound" for name in model.fit.at_bound()]
    if model.terms and not bears(model.fit):
        lines.append(
            "the joint as fitted has no solution at up to twice these loads; record greater ones as well"
        )
    if any(isinstance(t, Hypothesis) and t.effect.id == "clock_skew" for t in model.terms):
        lines += filter(None, [drag_alike(model.fit)])
    return (
        *lines,
        *_not_followed(model.fit, cut_short),
        *_set_anew(model.fit),
        *_hidden(model.fit.problem.evidence),
    )


def not_alike(model: Model, by: str) -> Iterator[str]:
    """What is not the same in all sessions, where each is one recording, of which nothing is left to judge that by."""
    for depends, share in unjudged(model.fit, model.terms, by):
        yield (
            f"{depends.parameter} is not the same in all sessions: of each its own, it would take off about "
            f"{1.0 - share:.0%} of the square of what is left, but one recording of each does not tell; name the "
            "channel by which they differ in [condition], or give two of each"
        )


def not_carried(errors: Errors, floor_rad: float) -> Iterator[str]:
    """That the model does not carry to what was kept for the end, where it predicts that far worse than what was left
    out in turn."""
    ratio = errors.final_rmse_rad / max(errors.heldout_rmse_rad, floor_rad, 1e-12)
    if ratio > LIMITS.not_carried:
        yield (
            f"what was kept for the end is predicted {ratio:.1f} times worse than what was left out in turn: something "
            "changed there, the load goes further there than before, or the model does not carry that far; look at the "
            "recordings' last stretches"
        )


def _not_followed(fit: Fit, cut_short: bool) -> Iterator[str]:
    """Channels beside the joint's angle that the model follows hardly or not at all."""
    why = (
        "what it takes (friction) may not have been tried yet: give more time before you doubt the channel"
        if cut_short
        else "its unit, sign or zero is not as stated, or it is stuck, or of another joint; leave it out or mend it"
    )
    for c in (c for c in fit.problem.channels if c != JOINT):
        read = [e.at_rows(c)[e.counted[c]] for e in fit.problem.evidence if c in e.counted]
        read = [x - np.mean(x) for x in read if len(x)]
        if not read:
            continue  # it counts nowhere
        own = float(np.sqrt(np.mean(np.concatenate(read) ** 2)))
        left = rms_left(fit, c)
        if left > LIMITS.not_followed * own:
            yield (
                f"{c} is not followed: the model leaves {left:.3g} of it RMS, and it changes by {own:.3g}; {why}"
            )


def _set_anew(fit: Fit) -> Iterator[str]:
    """Recordings with a zero of their own, each with how far it lies from its session's; not by less than what is
    usually left, which nobody would look for a clamp for."""
    zeros, usual = fit.problem.zeros(fit.x)[JOINT], rms_left(fit)
    for e in fit.problem.evidence:
        if e.name not in fit.problem.weighing.moved.get(JOINT, ()):
            continue
        apart = float(zeros[e.name][0] - zeros[e.session][0])
        if abs(apart) > usual:
            yield (
                f"{short(e.name)}: its zero lies {1e3 * apart:+.3g} mrad from the others' of its session, and nothing "
                "within the recordings moves it so: taken as set anew before it (several sessions: `--session each`, "
                "or [[session]]); if nobody did, a clamp or a drum slipped there"
            )


def _hidden(evidence: Sequence[Evidence]) -> Iterator[str]:
    """Recordings in whose gaps the drive went where it was not seen to, with when."""
    for e in evidence:
        time = e.columns["time_s"]
        if e.hidden:
            when = ", ".join(
                f"{time[k] - e.shift_s:.4g} to {time[k + 1] - e.shift_s:.4g} s" for k in e.hidden
            )
            yield (
                f"{short(e.name)}: the angle steps at a gap ({when}) as if motion or load had gone further in it and "
                "come back; what friction remembers of that is estimated and taken off; record without gaps"
            )
