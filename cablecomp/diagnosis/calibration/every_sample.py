"""The calibrated drive fitted once more on every sample: what vibrates moves friction along, and thinned rows lose it.

A fit on thinned, cleaned rows is quick, and blind to fast motion: a link that swings under its load shakes the cable
loose where a smoothed recording shows it sticking. Here the kernel runs on all samples, once on raw inputs and once on
cleaned ones; the inputs that leave less are kept. A law is trusted to `MODEL` of the deflection it predicts, no more:
such an error lasts as long as the deflection does, and is counted so, beside what the residual itself remembers
(M. C. Kennedy and A. O'Hagan, J. R. Statist. Soc. B 63, 2001: calibration with model discrepancy). What a drive that
shakes winds onto its drums between two samples is not known either: by how much every other sample matters is counted
as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cablecomp.diagnosis.body import Columns
from cablecomp.diagnosis.calibration.counts import count_rad, with_places
from cablecomp.diagnosis.calibration.drive import Calibrated
from cablecomp.diagnosis.pace import Pace
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, OUTPUTS, Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit, approach, refit, rms_left, solve, weighed
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.noise import reading_sigma
from cablecomp.signal.smoothing import FloatArray, group_means

MODEL: Final = 3e-3
"""Share of the deflection to which a drive's law is trusted: set on joints 100, 102, 103 of
`tests/golden/calibration_coverage.py`, whose true values it puts where a stated sd ought to; others judge it."""
MOST: Final = 120_000
"""Samples of all recordings together that are run one by one; of more, means of neighbours are."""
WIDE: Final = (0.4, 0.8)
"""Shares of a parameter's prior sd over which its derivative is taken, and taken once more."""
RAW_SPIKE: Final = 8.0
"""Sensor noises beyond which a raw reading is left cleaned."""


def on_every_sample(drive: Calibrated, recordings: Mapping[str, Columns], pace: Pace) -> Fit:
    """The drive's fit, carried on from where it is on all samples (canonical channels, by name), or as far as the pace
    lets it: each step begins only in time."""
    floor = Weighing(dict.fromkeys(drive.fit.problem.channels, 1e-12), drive.floor.zero_sd)
    if pace.over:
        return settled(drive.fit, floor)
    total = sum(len(c["time_s"]) for c in recordings.values())
    group = max(1, -(-total // MOST))
    thin = drive.fit.problem
    cleaned = [
        _with_places(thin, _all_rows(thin, e, recordings[e.name], group), recordings[e.name])
        for e in thin.evidence
    ]
    raw = [_with_raw_inputs(e, recordings[e.name], group) for e in cleaned]
    best: Fit | None = None
    for evidence in (cleaned, raw):
        if best is not None and pace.over:
            break
        try:
            fit = solve(thin.with_evidence(evidence).finely(), drive.fit.x, 6)
        except InputError:
            continue  # raw torque so noisy that a cable would hang slack
        if best is None or rms_left(fit) < rms_left(best):
            best = fit
    if best is None:
        return drive.fit
    return settled(best, floor, 1 if pace.over else 2)


def by_wide_steps(fit: Fit, rounds: int = 2) -> Fit:
    """The fit carried on by derivatives over `WIDE` of each prior, and with such a one: a drive that shakes jumps from
    sample to sample when a value moves a little, and a derivative over a thousandth is that of its jumps."""
    near, far = WIDE
    J = _wide_jacobian(fit, near)
    for _ in range(rounds):
        better = approach(fit.problem, fit.x, dict(enumerate(J.T)), 6, 1e-4)
        if not better.cost < fit.cost:
            break
        fit, J = better, _wide_jacobian(better, near)
    return replace(fit, J=in_common(J, _wide_jacobian(fit, far)))


def in_common(one: FloatArray, other: FloatArray) -> FloatArray:
    """The mean of two derivatives K, turned so that its square is what both have in common, (K1'K2 + K2'K1)/2: jumps
    are drawn anew for each, and in a square of one alone they pass for knowledge. The last rows, the priors', stay."""
    data = len(one) - one.shape[1]
    mean, half = 0.5 * (one + other), 0.5 * (one - other)[:data]
    size, way = np.linalg.eigh(mean[:data].T @ mean[:data])
    root = np.sqrt(np.maximum(size, 1e-12 * size.max(initial=1e-300)))
    to, back = way * root @ way.T, way / root @ way.T
    share, turned = np.linalg.eigh(np.eye(len(root)) - back @ (half.T @ half) @ back)
    shrunk = turned * np.sqrt(np.maximum(share, 0.0)) @ turned.T
    return np.concatenate((mean[:data] @ back @ shrunk @ to, mean[data:]))


def _wide_jacobian(fit: Fit, share: float) -> FloatArray:
    """Central differences over a share of the prior sds either way; a side on which the drive cannot follow is left
    out."""
    problem = fit.problem
    low, high = problem.bounds()
    columns = []
    for k, p in enumerate(problem.parameters):
        reach = share * min(p.sd, float(high[k] - low[k]))
        ends = []
        for side in (-reach, reach):
            x = fit.x.copy()
            x[k] = min(max(x[k] + side, low[k]), high[k])
            found = problem.followed(x)
            ends.append((fit.x[k], fit.residual) if found is None else (x[k], found))
        (a, left), (b, right) = ends
        columns.append((right - left) / (b - a) if b > a else fit.J[:, k])
    return np.column_stack(columns) if columns else fit.J


def settled(fit: Fit, floor: Weighing, times: int = 1) -> Fit:
    """The fit with weights as its own remainder and the trust in the law ask for."""
    for _ in range(times):
        weighing = weighed(fit, floor)
        trust, between = trusted(fit.problem), between_samples(fit)
        sigma = {
            c: float(np.sqrt(s**2 + trust.get(c, 0.0) ** 2 + between.get(c, 0.0) ** 2))
            for c, s in weighing.sigma.items()
        }
        fit = by_wide_steps(refit(fit, replace(weighing, sigma=sigma), 6))
    return fit


def trusted(problem: Problem) -> dict[str, float]:
    """By channel, the 1-sigma of a row with its memory that comes of the law itself: MODEL x RMS of what it predicts x
    root of the rows for which that lasts."""
    found = {}
    for c in problem.channels:
        parts = [
            _deflection(problem, e, c) for e in problem.evidence if c in e.counted and e.counted[c].sum() > 8
        ]
        if parts:
            size = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            found[c] = MODEL * size * float(np.sqrt(integrated_time_of_parts(parts)))
    return found


def between_samples(fit: Fit) -> dict[str, float]:
    """By channel, the 1-sigma of a row with its memory that comes of what happens between samples: by how much
    predictions differ from those with every other sample left out, in RMS x root of the rows for which that lasts."""
    problem = fit.problem
    halved = [_every_other(e) for e in problem.evidence]
    try:
        there = problem.with_evidence(halved).misfits(fit.x)
    except InputError:
        return {}
    here = problem.misfits(fit.x)
    found = {}
    for c in problem.channels:
        parts = [
            (a[::2] - b)[e.counted[c]]
            for a, b, e in zip(here[c], there[c], halved, strict=True)
            if c in e.counted and e.counted[c].sum() > 8
        ]
        parts = [p - np.mean(p) for p in parts]
        if parts:
            size = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            found[c] = size * float(np.sqrt(2.0 * integrated_time_of_parts(parts)))
    return found


def _every_other(e: Evidence) -> Evidence:
    """A recording of which every sample is judged, every other one left out."""
    return replace(
        e,
        columns={k: v[e.rows][::2] for k, v in e.columns.items()},
        rows=np.arange(len(e.rows[::2])),
        counted={k: v[::2] for k, v in e.counted.items()},
        read={k: v[e.rows][::2] for k, v in e.read.items()},
        weight=e.weight[::2],
        carryover={k: v[::2] for k, v in e.carryover.items()},
        steady={k: v[::2] for k, v in e.steady.items()},
    )


def _deflection(problem: Problem, e: Evidence, channel: str = JOINT) -> FloatArray:
    """A channel beyond the rigid drive, about its mean."""
    rigid = problem.config.drive.ratio * e.at_rows("motor_position_rad") if channel == JOINT else 0.0
    y = (e.at_rows(channel) - rigid)[e.counted[channel]]
    return np.asarray(y - np.mean(y), dtype=np.float64)


def _with_places(problem: Problem, e: Evidence, columns: Columns) -> Evidence:
    """The recording with the motor's places inside its counts, where a count is more than the law is trusted to."""
    count = count_rad(columns)
    moves = problem.config.drive.ratio * reading_sigma(None, count)
    return with_places(problem.config, e, count) if moves > MODEL * np.std(_deflection(problem, e)) else e


def _all_rows(problem: Problem, thin: Evidence, columns: Columns, group: int) -> Evidence:
    """The recording cleaned, every (mean) sample judged, counted from where the thinned one is."""
    count = -(-len(columns["time_s"]) // group)
    e = gather(
        problem.config, thin.name, columns, thin.session, fine_rows=count, judged_rows=len(columns["time_s"])
    )
    time = e.columns["time_s"] + thin.shift_s
    counts = {c: np.zeros(len(e.rows), dtype=np.bool_) for c in e.counted}
    for c, kept in e.counted.items():
        if c in thin.counted and thin.counted[c].any():
            begins = thin.at_rows("time_s")[int(np.argmax(thin.counted[c]))]
            counts[c] = kept & (time[e.rows] >= begins)
    then = thin.at_rows("time_s")
    carryover = {
        c: np.column_stack([np.interp(time[e.rows], then, p) for p in t.T]) for c, t in thin.carryover.items()
    }
    return replace(
        e,
        columns={**e.columns, "time_s": time},
        counted=counts,
        carryover=carryover,
        condition=thin.condition,
        shift_s=thin.shift_s,
        apart=thin.apart,
        claimed=thin.claimed,
    )


def _with_raw_inputs(e: Evidence, columns: Columns, group: int) -> Evidence:
    """The same with inputs as they were read, spikes and holes apart."""
    raw_time = np.asarray(columns["time_s"], dtype=np.float64) + e.shift_s
    changed: dict[str, FloatArray] = {}
    for name, clean in e.columns.items():
        if name == "time_s" or (name in OUTPUTS and name in e.counted) or name not in columns:
            continue
        values = np.asarray(columns[name], dtype=np.float64)
        good = np.isfinite(values) & np.isfinite(raw_time)
        smooth = np.interp(raw_time[good], e.columns["time_s"], clean)
        near = np.abs(values[good] - smooth) <= RAW_SPIKE * max(e.noise.get(name, 0.0), 1e-300)
        read = np.where(near, values[good], smooth)
        if group == 1:
            changed[name] = np.interp(e.columns["time_s"], raw_time[good], read)
        else:
            changed[name] = _means(raw_time[good], read, e.columns["time_s"], group)
    return replace(e, columns={**e.columns, **changed})


def _means(time: FloatArray, values: FloatArray, at: FloatArray, group: int) -> FloatArray:
    whole = len(values) // group * group
    means: FloatArray = np.interp(at, group_means(time[:whole], group), group_means(values[:whole], group))
    return means
