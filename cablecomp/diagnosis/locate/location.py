"""Where a residual is more than noise: over time and over the covariates, with honest p-values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cablecomp.diagnosis.locate.crossfit import BlockSums, block_sums, coefficients, gains, surrogate_gains
from cablecomp.diagnosis.locate.segments import Segments, segment
from cablecomp.diagnosis.locate.series import Series, thin
from cablecomp.diagnosis.locate.views import Response, Responses, View, load_path, views
from cablecomp.signal.smoothing import FloatArray, IntArray

_ENERGY_SHARE: Final = 0.8
"""Share of the fitted energy that a range, or intervals, are told to hold."""
_TIE: Final = 0.05
"""Least difference of shares by which one covariate is told before another, whatever each leaves of the other."""
_NEAR: Final = 0.9
"""Share over the first one's from which a covariate that is followed beyond chance is told before one that is not
(trials seeds 624, 626, 627, 631, 632, looked at: 127 of 148 located for 124; 0.5 lost one of them and a stranger)."""
_CHANCE: Final = 0.05
"""p-value below which something is followed beyond chance."""
_MOST_INTERVALS: Final = 40
"""Intervals that are told of one covariate."""


@dataclass(frozen=True)
class Mismatch:
    """One covariate's part in the mismatch, as in `diagnosis.json`.

    `share` of the energy beyond noise that the covariate accounts for in blocks not used for fitting;
    `low`, `high`: the range of the covariate that holds four fifths of that; `intervals_s`: when; `p_value`
    against autocorrelated noise, corrected for all covariates asked; `how`: in plain words, how the
    residual follows it.
    """

    covariate: str
    share: float
    low: float
    high: float
    intervals_s: tuple[tuple[float, float], ...]
    p_value: float
    how: str

    def entry(self) -> dict[str, Any]:
        """Return the entry of `diagnosis.json`."""
        return {
            "covariate": self.covariate,
            "share": self.share,
            "range": [self.low, self.high],
            "intervals_s": [list(interval) for interval in self.intervals_s],
            "p_value": self.p_value,
            "how": self.how,
        }


@dataclass(frozen=True)
class Location:
    """Where the mismatch is.

    `mismatch`: all covariates, ranked; `changes_s`: instants at which the residual's dependence on the load path
    changes.
    """

    mismatch: tuple[Mismatch, ...]
    changes_s: tuple[float, ...]

    def significant(self, level: float = _CHANCE) -> tuple[Mismatch, ...]:
        """Return the covariates whose corrected p-value is below `level`."""
        return tuple(entry for entry in self.mismatch if entry.p_value < level)


@dataclass(frozen=True)
class _Ground:
    """Thinned series and its blocks; what is asked about lies beyond `nuisance`, orthonormal under `weight`: the
    residual and every view are taken without what that can explain."""

    series: Series
    block: IntArray
    weight: FloatArray
    nuisance: FloatArray
    residual: FloatArray

    @property
    def energy(self) -> float:
        """Weighted square of the residual."""
        return float(np.sum(self.weight * self.residual**2))

    @property
    def excess(self) -> float:
        """Energy beyond noise; below a tenth of the energy that is not known well enough to divide by."""
        return max(self.energy - self.series.samples, 0.1 * self.energy, 1e-300)

    def beyond(self, columns: FloatArray) -> FloatArray:
        """Columns without what the nuisance can explain of them."""
        return _beyond(columns, self.nuisance, self.weight)

    def sums(self, basis: FloatArray) -> BlockSums:
        """Normal equations of the residual on a basis, block by block."""
        return block_sums(self.beyond(basis), self.residual, self.weight, self.block, self.nuisance)

    def with_path(self) -> _Ground:
        """The same with what a plain loop explains taken off too."""
        own = _orthonormal(np.column_stack((self.nuisance, load_path(self.series))), self.weight)
        return replace(self, nuisance=own, residual=_beyond(self.residual, own, self.weight))


@dataclass(frozen=True)
class _Answer:
    """What a view accounts for on its ground; `share`: of the energy beyond noise of the one without a loop."""

    view: View
    ground: _Ground
    sums: BlockSums
    share: float
    per_block: FloatArray
    score: float


def locate(
    series: Series,
    rng: np.random.Generator,
    nuisance: FloatArray | None = None,
    surrogates: int = 999,
    drive: Responses | None = None,
) -> Location:
    """Rank the covariates by the share of the mismatch that they account for.

    Each covariate is asked in a few ways (views); a view's share is the energy that its fit on the other
    blocks removes from a block, over the energy beyond noise. Surrogates flip the sign of whole blocks,
    longer than the residual remembers: noise cannot tell, a dependence is destroyed. p-values compare with
    the largest score over all views of each surrogate. `nuisance` (n x p): sensitivities of the prediction
    to the calibration parameters; what they can explain is not counted, for the covariate or against it. `drive`:
    what the drive itself makes of laws that change along a covariate.
    Near ties go to the covariate that leaves less to the other, and to one that is followed beyond chance.
    """
    ground, said = _ground(series, nuisance, drive)
    answers, highest = _asked(ground, said, rng, surrogates)
    regressors = np.column_stack((np.ones(ground.series.samples), load_path(ground.series)))
    pieces = segment(ground.series.residual / ground.series.sigma, regressors)
    mismatch = tuple(
        _mismatch(answer, ground, pieces, _p_value(highest, _top_score(answer, answers)))
        for answer in _ranked(_best_views(answers, ground.excess), ground)
    )
    times = ground.series.covariates.values["time"][pieces.changes]
    return Location(beyond_chance_first(mismatch), tuple(float(t) for t in times))


def beyond_chance_first(mismatch: tuple[Mismatch, ...]) -> tuple[Mismatch, ...]:
    """Covariates, best first, but where the first may be chance, one before it that is not and accounts for nearly as
    much."""
    if not mismatch or mismatch[0].p_value < _CHANCE:
        return mismatch
    sure = [m for m in mismatch if m.p_value < _CHANCE and m.share >= _NEAR * mismatch[0].share]
    first = max(sure, key=lambda m: m.share, default=mismatch[0])
    return (first, *(m for m in mismatch if m is not first))


def _asked(
    ground: _Ground, drive: Responses | None, rng: np.random.Generator, surrogates: int
) -> tuple[list[_Answer], FloatArray]:
    """What every view accounts for; and of each surrogate the largest score over all of them."""
    grounds = {False: ground, True: ground.with_path()}
    signs = rng.choice(np.array([-1.0, 1.0]), size=(surrogates, int(ground.block.max()) + 1))
    answers: list[_Answer] = []
    highest = np.full(surrogates, -np.inf)
    for view in views(ground.series, drive):
        here = grounds[view.beyond_loop]
        sums = here.sums(view.basis)
        per_block = gains(sums)
        total = float(per_block.sum())
        strength = float(_strength(total, here.energy))
        null = _strength(surrogate_gains(sums, signs), here.energy)
        # the lower tail is long where a fit extrapolates: the scale is that of the upper one
        centre, upper = (float(value) for value in np.quantile(null, (0.5, 0.95)))
        scale = max(upper - centre, 1e-12)
        highest = np.maximum(highest, (null - centre) / scale)
        score = (strength - centre) / scale
        answers.append(_Answer(view, here, sums, total / ground.excess, per_block, score))
    return answers, highest


def _mismatch(answer: _Answer, ground: _Ground, pieces: Segments, p_value: float) -> Mismatch:
    """One covariate's part, from its best view."""
    name = answer.view.covariate
    fitted = answer.ground.beyond(answer.view.basis) @ coefficients(answer.sums)
    return Mismatch(
        name,
        float(np.clip(answer.share, 0.0, 1.0)),
        *_range(name, fitted, ground),
        _intervals(name, fitted, ground, pieces.bounds),
        p_value,
        answer.view.how,
    )


def _ground(
    series: Series, nuisance: FloatArray | None, drive: Responses | None
) -> tuple[_Ground, Responses | None]:
    """Where views are asked, and what the drive says, both thinned."""
    columns = np.ones((series.samples, 1))
    if nuisance is not None:
        columns = np.column_stack((columns, np.asarray(nuisance, dtype=np.float64)))
    own = columns.shape[1]
    if drive is not None:
        columns = np.column_stack(
            (columns, *(r.columns for r in drive.of_laws), *(c for _, c in drive.sensitivities))
        )
    thinned = thin(series, columns)
    small = thinned.series
    weight = 1.0 / small.sigma**2
    beneath = _orthonormal(thinned.extra[:, :own], weight)
    ground = _Ground(small, small.blocks(), weight, beneath, _beyond(small.residual, beneath, weight))
    return ground, None if drive is None else _parted(drive, thinned.extra[:, own:])


def _beyond(columns: FloatArray, nuisance: FloatArray, weight: FloatArray) -> FloatArray:
    return np.asarray(columns - nuisance @ (nuisance.T @ (weight * columns.T).T), dtype=np.float64)


def _parted(drive: Responses, columns: FloatArray) -> Responses:
    """The same with these columns, thinned."""
    laws, first = [], 0
    for law in drive.of_laws:
        laws.append(Response(law.covariate, law.how, columns[:, first : first + law.columns.shape[1]]))
        first += law.columns.shape[1]
    slow = tuple((name, columns[:, first + k]) for k, (name, _) in enumerate(drive.sensitivities))
    return Responses(tuple(laws), slow)


def _orthonormal(columns: FloatArray, weight: FloatArray) -> FloatArray:
    root = np.sqrt(weight)[:, None]
    u, singular, _ = np.linalg.svd(columns * root, full_matrices=False)
    return np.asarray((u / root)[:, singular > 1e-9 * singular[0]], dtype=np.float64)


def _p_value(highest: FloatArray, score: float) -> float:
    return float(1 + np.count_nonzero(highest >= score)) / (len(highest) + 1)


def _strength(gain: Any, energy: float) -> Any:
    """Logarithm of energy before over energy after: grows without bound as little is left."""
    return -np.log(np.clip(1.0 - gain / max(energy, 1e-300), 1e-9, None))


def _share_sd(per_block: FloatArray, excess: float) -> float:
    return float(np.std(per_block, ddof=1) * np.sqrt(len(per_block)) / excess)


def _top_score(answer: _Answer, answers: list[_Answer]) -> float:
    return max(other.score for other in answers if other.view.covariate == answer.view.covariate)


def _best_views(answers: list[_Answer], excess: float) -> list[_Answer]:
    """One view per covariate: the narrowest one within a standard error of the best."""
    chosen = []
    for name in dict.fromkeys(answer.view.covariate for answer in answers):
        group = [answer for answer in answers if answer.view.covariate == name]
        top = max(group, key=lambda answer: answer.share)
        close = [
            answer
            for answer in group
            if top.share - answer.share
            <= max(0.01, _share_sd(top.per_block - answer.per_block, excess) if answer is not top else 0.01)
        ]
        chosen.append(min(close, key=lambda answer: answer.view.width))
    return chosen


def _ranked(best: list[_Answer], ground: _Ground) -> list[_Answer]:
    """Order by share; among near ties, the covariate that leaves least to the others is first."""
    order = sorted(best, key=lambda answer: -answer.share)
    if not order or order[0].share <= 0.0:
        return order
    tied = [
        answer
        for answer in order
        if order[0].share - answer.share
        <= np.clip(_share_sd(order[0].per_block - answer.per_block, ground.excess), _TIE, 2.0 * _TIE)
        and answer.share > 0.5 * order[0].share
    ][:5]
    if len(tied) < 2:
        return order
    left = {id(answer): 0.0 for answer in tied}
    for i, first in enumerate(tied):
        for second in tied[i + 1 :]:
            together = _joint_share(first, second, ground)
            # what each one still adds when the other is there; a narrow view needs less to be preferred
            left[id(first)] = max(left[id(first)], together - first.share)
            left[id(second)] = max(left[id(second)], together - second.share)
    narrowness = {id(answer): 0.004 * min(answer.view.width, 12) for answer in tied}
    tied.sort(key=lambda answer: left[id(answer)] + narrowness[id(answer)])
    return tied + [answer for answer in order if not any(answer is other for other in tied)]


def _joint_share(first: _Answer, second: _Answer, ground: _Ground) -> float:
    here = first if first.view.beyond_loop else second
    together = here.ground.sums(np.column_stack((first.view.basis, second.view.basis)))
    return float(gains(together).sum()) / ground.excess


def _range(name: str, fitted: FloatArray, ground: _Ground) -> tuple[float, float]:
    """The shortest range of the covariate that holds four fifths of the fitted energy."""
    x = ground.series.covariates.values[name]
    order = np.argsort(x, kind="stable")
    energy = np.cumsum((ground.weight * fitted**2)[order])
    if energy[-1] <= 0.0:
        return float(x.min()), float(x.max())
    before = np.concatenate(([0.0], energy[:-1]))
    ends = np.searchsorted(energy, before + _ENERGY_SHARE * energy[-1] * (1.0 - 1e-12))
    valid = ends < len(x)
    low = x[order]
    widths = np.where(valid, low[np.minimum(ends, len(x) - 1)] - low, np.inf)
    start = int(np.argmin(widths))
    return float(low[start]), float(low[min(int(ends[start]), len(x) - 1)])


def _intervals(
    name: str, fitted: FloatArray, ground: _Ground, bounds: IntArray
) -> tuple[tuple[float, float], ...]:
    """The times that hold four fifths of the fitted energy, short gaps closed; for time, whole pieces
    between changes.
    """
    time = ground.series.covariates.values["time"]
    energy = ground.weight * fitted**2
    starts = ground.series.covariates.starts
    if name == "time" and len(bounds) > 2:
        piece = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
        energy = np.bincount(piece, energy)[piece] / np.diff(bounds)[piece]
        starts = np.union1d(ground.series.covariates.starts, bounds[1:-1])
    if energy.sum() <= 0.0:
        return ()
    descending = np.sort(energy)[::-1]
    level = descending[int(np.searchsorted(np.cumsum(descending), _ENERGY_SHARE * energy.sum()))]
    gap = max(2, int(np.bincount(ground.block).min() // 3))
    strong = np.flatnonzero(energy >= level)
    parted = (np.diff(strong) > gap) | (np.diff(np.searchsorted(starts, strong, side="right")) > 0)
    found = [(int(part[0]), int(part[-1])) for part in np.split(strong, np.flatnonzero(parted) + 1)]
    found.sort(key=lambda pair: -float(energy[pair[0] : pair[1] + 1].sum()))
    kept = sorted(found[:_MOST_INTERVALS])
    return tuple((float(time[a]), float(time[b])) for a, b in kept)
