"""The calibrated drive fitted once more on every sample: what vibrates moves friction along, and thinned rows lose it.

A fit on thinned, cleaned rows is quick, and blind to fast motion: a link that swings under its load shakes the cable
loose where a smoothed recording shows it sticking. Here the kernel runs on all samples, once on raw inputs and once on
cleaned ones; the inputs that leave less are kept. A law is trusted to `MODEL` of the deflection it predicts, no more:
such an error lasts as long as the deflection does, and is counted so, beside what the residual itself remembers
(M. C. Kennedy and A. O'Hagan, J. R. Statist. Soc. B 63, 2001: calibration with model discrepancy).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cablecomp.diagnosis.body import Columns
from cablecomp.diagnosis.calibration.drive import Calibrated
from cablecomp.diagnosis.pace import Pace
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, OUTPUTS, Evidence, gather
from cablecomp.estimation.least_squares import Fit, refit, rms_left, solve, weighed
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.smoothing import FloatArray, group_means

MODEL: Final = 3e-3
"""Share of the deflection to which a drive's law is trusted: set on joints 100, 102, 103 of
`tests/golden/calibration_coverage.py`, whose true values it puts where a stated sd ought to; others judge it."""
MOST: Final = 120_000
"""Samples of all recordings together that are run one by one; of more, means of neighbours are."""
SPIKE: Final = 8.0
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
    cleaned = [_all_rows(thin, e, recordings[e.name], group) for e in thin.evidence]
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


def settled(fit: Fit, floor: Weighing, times: int = 1) -> Fit:
    """The fit with weights as its own remainder and the trust in the law ask for."""
    for _ in range(times):
        weighing = weighed(fit, floor)
        trust = trusted(fit.problem)
        sigma = {c: float(np.hypot(s, trust.get(c, 0.0))) for c, s in weighing.sigma.items()}
        fit = refit(fit, replace(weighing, sigma=sigma), 6)
    return fit


def trusted(problem: Problem) -> dict[str, float]:
    """By channel, the 1-sigma of a row with its memory that comes of the law itself: MODEL x RMS of what it predicts x
    root of the rows for which that lasts."""
    ratio = problem.config.drive.ratio
    found = {}
    for c in problem.channels:
        parts = []
        for e in problem.evidence:
            if c in e.counted and e.counted[c].sum() > 8:
                y = e.at_rows(c) - (ratio * e.at_rows("motor_position_rad") if c == JOINT else 0.0)
                parts.append(y[e.counted[c]] - np.mean(y[e.counted[c]]))
        if parts:
            size = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            found[c] = MODEL * size * float(np.sqrt(integrated_time_of_parts(parts)))
    return found


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
        near = np.abs(values[good] - smooth) <= SPIKE * max(e.noise.get(name, 0.0), 1e-300)
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
