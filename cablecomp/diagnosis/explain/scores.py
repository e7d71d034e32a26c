"""How well models predict what they were not fitted to: residuals with a group left out, paired differences,
resampling.

With J the derivative of a fit's weighted residual r, H = J'J (priors in it), leaving the rows g out moves the
solution by a Gauss-Newton step, so that their residual becomes r_g + J_g (H - J_g' J_g)^-1 J_g' r_g. Models are
compared by paired differences of a Huber score over groups; the scatter between groups is the yardstick (P.
Hansen, A. Lunde and J. Nason, The Model Confidence Set, Econometrica 79, 2011, for the set of models that
cannot be told apart).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from cablecomp.diagnosis.folds import Groups
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects.catalogue import role_of
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.least_squares import Fit, fitted_to_part
from cablecomp.estimation.limits import HOPELESS
from cablecomp.estimation.parallel import side_by_side
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray


def left_out(fit: Fit, groups: Groups) -> FloatArray:
    """Weighted residual of every data row with its fold left out of the fit: one Gauss-Newton step each, or
    fits done again where the drive is known by order of magnitude only."""
    if any(p.vague for p in fit.problem.parameters):
        return left_out_exactly(fit, groups)
    return left_out_linearly(fit.residual, fit.J[:, movable(fit)], groups)


def left_out_linearly(residual: FloatArray, J: FloatArray, groups: Groups) -> FloatArray:
    """The same by one Gauss-Newton step for each fold, from residual and derivative (priors last) alone."""
    n = len(groups.fold)
    r = residual[:n].copy()
    H = J.T @ J
    J = J[:n]
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    data = groups.fold >= 0
    reach = 4.0 * max(J.shape[1], 1) * float(np.mean(r[data] ** 2))
    for g in range(groups.folds):
        here = groups.fold == g
        Jg, rg = J[here] / scale, residual[:n][here]
        if not Jg.shape[1] or not len(rg):
            continue
        rest = H / np.outer(scale, scale) - Jg.T @ Jg
        rest += 1e-9 * np.eye(len(rest))
        try:
            step = np.linalg.solve(rest, Jg.T @ rg)
        except np.linalg.LinAlgError:
            continue
        # a linear step far beyond what the rows left in would bear is no prediction: it is held inside of their
        # ellipsoid
        length = float(step @ rest @ step)
        if length > reach:
            step = step * sqrt(reach / length)
        r[here] = rg + Jg @ step
    return r


def left_out_exactly(fit: Fit, groups: Groups, evaluations: int = 4) -> FloatArray:
    """As `left_out`, each part really left out and the rest fitted again: for drives known by order of magnitude only,
    whose parameters trade places along bent valleys that no linear step follows. A part is some of the blocks, or a
    recording where there are no more of them than a search looks at. Rows that the drive cannot follow with what the
    rest tells of it are not predicted: they count as such."""
    n = len(groups.fold)
    r = fit.residual[:n].copy()
    parts = min(groups.folds, LIMITS.searched if groups.by == "recording" else LIMITS.refits)
    outs = [(groups.fold >= 0) & (groups.fold % parts == k) for k in range(parts)]
    outs = [out for out in outs if out.any()]

    def predicted(out: BoolArray) -> FloatArray | None:
        try:
            again = fitted_to_part(fit, _kept(fit.problem, out), evaluations)
        except InputError:
            return None
        return fit.problem.followed(again.x)

    for out, found in zip(outs, side_by_side(predicted, outs), strict=True):
        r[out] = HOPELESS if found is None else found[:n][out]
    return r


def _kept(problem: Problem, out: BoolArray) -> list[Evidence]:
    """The recordings with the rows that are out not counted; those with nothing left go."""
    masks: list[dict[str, BoolArray]] = [dict(e.counted) for e in problem.evidence]
    for c, span in problem.spans().items():
        owners = problem.owners(c)
        gone = out[span]
        for k, e in enumerate(problem.evidence):
            if c in e.counted:
                mask = e.counted[c].copy()
                mask[np.flatnonzero(mask)] = ~gone[owners == k]
                masks[k][c] = mask
    kept = [replace(e, counted=m) for e, m in zip(problem.evidence, masks, strict=True)]
    return [e for e in kept if any(m.any() for m in e.counted.values())]


def movable(fit: Fit) -> IntArray:
    """Parameters that a fold left out may move: those that are not on a bound; when an event happens is read from all
    rows, a block left out cannot place it."""
    low, high = fit.problem.bounds()
    margin = np.minimum(1e-4 * (high - low), 1e-2)  # of usual size, too, where bounds are decades away
    when = ("instant", "duration")
    instant = np.array([role_of(p.base) in when for p in fit.problem.parameters], dtype=np.bool_)
    return np.flatnonzero((fit.x > low + margin) & (fit.x < high - margin) & ~instant)


def huber(r: FloatArray) -> FloatArray:
    """Huber's loss over half of a residual in units of its scale: r^2 within `tail`, linear beyond."""
    z = np.abs(r)
    k = LIMITS.tail
    return np.where(z < k, z**2, 2.0 * k * z - k * k)


def scales(r: FloatArray, groups: Groups) -> FloatArray:
    """Deviation (scaled median) of what is left of each channel: a torque may be followed closely and an angle
    not, each has its own yardstick."""
    here = groups.block >= 0
    found = [
        np.median(np.abs(r[here & (groups.channel == c)])) / 0.6745 for c in range(groups.channel.max() + 1)
    ]
    return np.maximum(np.array(found, dtype=np.float64), 1e-300)


def block_losses(r: FloatArray, scale: FloatArray, groups: Groups) -> FloatArray:
    """Loss of each block, by channel in units of `scale` squared."""
    here = groups.block >= 0
    lost = huber(r[here] / scale[groups.channel[here]])
    return np.bincount(groups.block[here], lost, minlength=groups.blocks).astype(np.float64)


@dataclass(frozen=True)
class ScoreDifference:
    """How much better one model predicts than another.

    `gain`: share of the worse one's loss that it takes off, of more than two channels in the two in which they differ
    most: a further channel, which both follow alike, makes nothing harder to see. `z`: the difference over what the
    better one's own remainder makes of it by chance. `z_blocks`: over its scatter between blocks.
    """

    gain: float
    z: float
    z_blocks: float


def score_difference(better: FloatArray, worse: FloatArray, groups: Groups) -> ScoreDifference:
    """Paired comparison on left-out residuals.

    With d the difference of the two residuals and r the better one's, the losses differ by sum d^2 + 2 sum r d:
    the first is what the better one explains, the second is chance, and scatters by the blocks' sums of r d.
    """
    here = groups.block >= 0
    size = scales(better, groups)
    difference = block_losses(worse, size, groups) - block_losses(better, size, groups)
    by_row, block = size[groups.channel[here]], groups.block[here]
    a, b = better[here] / by_row, worse[here] / by_row
    total = float(np.sum(difference))
    spread = difference - difference.mean()
    error = sqrt(float(np.sum(spread**2)) * len(difference) / max(len(difference) - 1, 1))
    r, d = np.clip(a, -LIMITS.tail, LIMITS.tail), np.clip(b - a, -30.0, 30.0)
    chance = np.bincount(block, r * d, minlength=groups.blocks)
    noise = 2.0 * sqrt(float(np.sum(chance**2)) * len(chance) / max(len(chance) - 1, 1))
    return ScoreDifference(
        _share(huber(a), huber(b), groups.channel[here]),
        total / max(noise, 1e-300),
        total / max(error, 1e-300),
    )


def _share(better: FloatArray, worse: FloatArray, channel: IntArray) -> float:
    """Share of the worse loss (by row) that the better one takes off, in the channels in which they differ most."""
    lost = np.bincount(channel, worse)
    off = lost - np.bincount(channel, better)
    most = np.argsort(-np.abs(off))[: LIMITS.channels]
    return float(off[most].sum()) / max(float(lost[most].sum()), 1e-300)


def halves(problem: Problem, groups: Groups) -> list[IntArray]:
    """Ways to part the data rows in two (1 and -1; 0: in neither): early and late in each recording, more and
    less load than usual, quicker and slower than usual."""
    parts: list[list[IntArray]] = [[], [], []]
    for c in problem.channels:
        for e in problem.evidence:
            here = e.counted.get(c)
            if here is None:
                continue
            time = e.at_rows("time_s")
            load = np.broadcast_to(load_of(problem.config, e.columns), e.columns["time_s"].shape)[e.rows]
            speed = np.gradient(e.at_rows("motor_position_rad"), time)
            ways = (time, np.abs(load - np.median(load)), np.abs(speed))
            for found, way in zip(parts, ways, strict=True):
                middle = float(np.median(way[here])) if here.any() else 0.0
                found.append(np.where(way > middle, 1, -1)[here])
        penalty = np.zeros(problem.bases[c].penalty_rows, dtype=np.int64)
        for found in parts:
            found.append(penalty)
    return [np.concatenate(p) for p in parts]


def demanded(step: ScoreDifference, first: bool = False) -> bool:
    """Whether data left out demand what differences so; `first`: the first effect of all."""
    usual = step.z > (LIMITS.z_first if first else LIMITS.z) and step.gain > LIMITS.gain
    large = first and step.z > LIMITS.z_large and step.gain > LIMITS.gain_large
    much = step.z > LIMITS.z_first and step.gain > LIMITS.gain_much
    return usual or large or much or (step.z > LIMITS.z_sure and step.gain > LIMITS.gain_sure)


def selected_in(losses: Mapping[str, FloatArray], rng: np.random.Generator) -> dict[str, float]:
    """Share of resampled bodies of blocks in which each model is the best, by its losses per block."""
    if not losses:
        return {}
    names = list(losses)
    table = np.stack([losses[n] for n in names])
    draws = rng.multinomial(table.shape[1], np.full(table.shape[1], 1.0 / table.shape[1]), LIMITS.resamples)
    best = np.argmin(table @ draws.T, axis=0)
    return {n: float(np.mean(best == k)) for k, n in enumerate(names)}


def model_confidence_set(losses: Mapping[str, FloatArray], rng: np.random.Generator) -> tuple[str, ...]:
    """Models that cannot be told from the best by their losses per block (T_max elimination, bootstrap over blocks).

    Written out here because the libraries that have it bring pandas and statsmodels with them.
    """
    names = list(losses)
    table = np.stack([losses[n] for n in names])
    count = table.shape[1]
    draws = rng.multinomial(count, np.full(count, 1.0 / count), LIMITS.resamples) / count
    while len(names) > 1:
        relative = table - table.mean(axis=0)
        mean = relative.mean(axis=1)
        boot = draws @ relative.T - mean
        error = np.sqrt(np.mean(boot**2, axis=0)) + 1e-300
        t = mean / error
        p = float(np.mean(np.max(boot / error, axis=1) >= t.max()))
        if p >= LIMITS.rival:
            break
        worst = int(np.argmax(t))
        names.pop(worst)
        table = np.delete(table, worst, axis=0)
    return tuple(names)
