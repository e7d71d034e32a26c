"""What the history before the first sample and in gaps, which nobody recorded, may still do to a prediction: its
carry-over.

The drive is run from several assumed histories (loaded to one side or the other, wound in from either end of the
stroke, both); rows count from where these runs agree but for a constant, and how far the constants differ is how far a
recording's zero may depart from its session's. What they still differ by from there on, and what detours in its gaps
do, the carry-over, is estimated with the zeros, each column with a prior.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import svd

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.gaps import along, detours
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.limits import (
    GAP_EACH,
    GAP_FAINT,
    GAP_LEAST,
    GAP_STEP,
    HISTORY_CUTS,
    HISTORY_FAINT,
    HISTORY_LEG,
    HISTORY_PARTS,
)
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.simulate import Unrecorded, load_of, simulator
from cablecomp.signal.smoothing import FloatArray


class Runs(NamedTuple):
    """What a drive does on judged rows, what each assumed history adds, and each detour of each gap; by channel."""

    plain: Mapping[str, FloatArray]
    of_history: list[dict[str, FloatArray]]
    of_gaps: Mapping[int, list[dict[str, FloatArray]]]

    def chosen(self, hidden: Sequence[int]) -> list[list[dict[str, FloatArray]]]:
        """Those of the history and of these gaps, where there are any."""
        return [rows for rows in (self.of_history, *(self.of_gaps.get(k, []) for k in hidden)) if rows]


NONE: Final = Runs({}, [], {})


@dataclass(frozen=True)
class Forgotten:
    """From which judged row on a recording's history no longer matters, how far it may still move the joint from
    there (RMS, rad, a constant apart), how far the constants differ (rad), what the assumed histories and detours add
    by channel (columns), and of which gaps these are."""

    first: int
    left_rad: float
    constant_rad: float
    carryover: Mapping[str, FloatArray] = field(default_factory=dict)
    hidden: tuple[int, ...] = ()


@dataclass(frozen=True)
class Reach:
    """How far the joint has been or may have been: motor angles [rad], greatest load either way [N m]."""

    low_rad: float
    high_rad: float
    load_Nm: float


def reaches(problem: Problem) -> tuple[Reach, ...]:
    """As far as any of the recordings goes, and, where that is further, as the joint's limits let it."""
    motors = [e.columns["motor_position_rad"] for e in problem.evidence]
    loads = [load_of(problem.config, e.columns) for e in problem.evidence]
    seen = Reach(
        min(float(np.min(q)) for q in motors),
        max(float(np.max(q)) for q in motors),
        max(float(np.max(np.abs(m))) for m in loads),
    )
    limits = problem.config.limits
    low, high, most = limits.motor_position_min_rad, limits.motor_position_max_rad, limits.joint_torque_max_Nm
    allowed = Reach(
        min(seen.low_rad, seen.low_rad if low is None else low),
        max(seen.high_rad, seen.high_rad if high is None else high),
        max(seen.load_Nm, most or 0.0) if seen.load_Nm > 0.0 else 0.0,
    )
    return (seen,) if allowed == seen else (seen, allowed)


def histories(problem: Problem, recording: Evidence) -> Iterator[Unrecorded]:
    """Assumed histories (motor angle, load) of a recording, as far as it goes and a part of that: loaded and back,
    either way; loaded one way, then a part as far the other; in from towards either end of the stroke; loaded there and
    wound in under load; loaded, wound there and back."""
    q = float(recording.columns["motor_position_rad"][0])
    m = float(np.ravel(load_of(problem.config, recording.columns))[0])
    for reach in reaches(problem):
        for part in HISTORY_PARTS:
            loads = [part * side for side in (reach.load_Nm, -reach.load_Nm) if reach.load_Nm > 0.0]
            ends = [q + part * (end - q) for end in (reach.high_rad, reach.low_rad) if abs(end - q) > 1e-9]
            for side in (s for s in loads if s != m):
                yield _path([(q, 0.0), (q, side), (q, m)])
                if part < 1.0:
                    yield _path([(q, 0.0), (q, -side / part), (q, side), (q, m)])
            for end in ends:
                yield _path([(end, m), (q, m)])
                for side in (s for s in loads if s != m):
                    yield _path([(end, 0.0), (end, side), (q, side), (q, m)])
                    yield _path([(q, 0.0), (q, side), (end, side), (q, m)])


def _path(corners: list[tuple[float, float]]) -> Unrecorded:
    return Unrecorded(along(corners, HISTORY_LEG))


def full_swing(problem: Problem, recording: Evidence, most: float) -> int:
    """First judged row after a swing over nine tenths of the range and a turn: friction on the path, too, has
    by then slid one way through and begun to slide the other. The motor's swing where it moves, else the
    load's; 0 where there is none within the share `most` of the recording."""
    motor = recording.at_rows("motor_position_rad")
    load = np.broadcast_to(
        np.asarray(load_of(problem.config, recording.columns), dtype=np.float64),
        recording.columns["time_s"].shape,
    )[recording.rows]
    ratio = problem.config.drive.ratio
    moves = np.ptp(motor) * ratio > 0.3 * np.ptp(recording.at_rows(JOINT))
    driver = motor if moves else load
    away = np.abs(driver - driver[0])
    if not away.max() > 0.0:
        return 0
    farthest = np.maximum.accumulate(away)
    turned = (farthest >= 0.9 * away.max()) & (farthest - away >= 0.02 * away.max())
    first = int(np.argmax(turned)) if turned.any() else 0
    return first if first <= most * len(motor) else 0


def forgotten(
    problem: Problem,
    x: FloatArray,
    recording: Evidence,
    size: Mapping[str, float],
    share: float,
    after: int = 0,
) -> Forgotten:
    """Where the history is forgotten to within `share` of what is usually left over of each channel (`size`), from row
    `after` on; the best cut there is if it is nowhere."""
    runs = _apart(problem, x, recording, tuple(size))
    if not runs.of_history:
        return Forgotten(0, 0.0, 0.0)
    apart = np.stack([run[JOINT] for run in runs.of_history])
    first, left = _first_row(apart, share * size[JOINT], after)
    hidden = _hidden(recording, runs, first)
    return Forgotten(first, left, _constant(apart, first), _carried_over(runs, hidden, first, size), hidden)


def zero_by_history(fit: Fit) -> float:
    """By how much the assumed histories move a recording's zero (RMS, rad; mean over the recordings) by this fit's own
    drive: a drive without the law that is missing may keep what the law forgets."""
    problem = fit.problem

    def constant(e: Evidence) -> float:
        runs = _apart(problem, fit.x, e, (JOINT,), ())
        if not runs.of_history:
            return 0.0
        return _constant(_of(runs.of_history, JOINT).T, int(np.argmax(e.counted[JOINT])))

    return float(np.mean(in_processes(constant, problem.evidence)))


def _constant(apart: FloatArray, first: int) -> float:
    """How far histories (k x rows) are apart in the mean from row `first` on (RMS)."""
    return float(np.sqrt(np.mean(apart[:, first:].mean(axis=1) ** 2)))


def _hidden(recording: Evidence, runs: Runs, first: int) -> tuple[int, ...]:
    """The gaps in which the drive went where it was not seen to, as the misfit from judged row `first` on has it: that
    whose detours lower the square of its steps from row to row most, and so on, as long as one lowers it by far more
    than chance. A law that is missing comes and goes with what is seen, a detour with the gap."""
    kept = recording.counted[JOINT] & (np.arange(len(recording.rows)) >= first)
    steps = np.diff((recording.at_rows(JOINT) - runs.plain[JOINT])[kept])
    usual = float(np.median(np.abs(steps))) / 0.6745 if len(steps) else 0.0
    if not usual > 0.0 or not runs.of_gaps:
        return ()
    y = np.clip(steps / usual, -GAP_STEP, GAP_STEP)

    def columns(rows: list[dict[str, FloatArray]]) -> FloatArray:
        found = np.diff(_columns([_of(rows, JOINT)], first, GAP_FAINT * usual)[kept], axis=0)
        return np.asarray(found / usual, dtype=np.float64)

    def square(A: FloatArray) -> float:
        both, target = np.vstack((A, np.eye(A.shape[1]))), np.concatenate((y, np.zeros(A.shape[1])))
        left = target - both @ np.linalg.lstsq(both, target, rcond=None)[0]
        return float(left @ left)

    asked = {k: columns(rows) for k, rows in runs.of_gaps.items() if rows}
    A = columns(runs.of_history) if runs.of_history else np.empty((len(y), 0))
    here, chosen = square(A), list[int]()
    while asked:
        with_it = {k: square(np.column_stack((A, c))) for k, c in asked.items()}
        best = min(with_it, key=lambda k: with_it[k])
        if here - with_it[best] < GAP_LEAST + GAP_EACH * asked[best].shape[1]:
            break
        here, A = with_it[best], np.column_stack((A, asked.pop(best)))
        chosen.append(best)
    return tuple(sorted(chosen))


def with_own_carryover(fit: Fit) -> Fit:
    """The fit about its recordings with what its own drive carries over: what the calibrated one does without the law
    that is missing looks like events while a recording is young. Where every run is dear, as it is."""
    problem = fit.problem
    if problem.fine:
        return fit
    evidence = tuple(in_processes(lambda e: _carried_over_anew(problem, fit.x, e), problem.evidence))
    return replace(fit, problem=problem.with_evidence(evidence))


def _carried_over_anew(problem: Problem, x: FloatArray, recording: Evidence) -> Evidence:
    """The recording with the carry-over of the drive as it is here, in as many columns as it had: another law carries
    over otherwise. As it was, where there was none or the drive can have had none of the assumed histories."""
    known = recording.carryover
    runs = _apart(problem, x, recording, tuple(known), recording.hidden) if known else NONE
    if not runs.of_history and not any(runs.of_gaps.values()):
        return recording
    first = int(np.argmax(recording.counted[JOINT]))
    chosen = runs.chosen(recording.hidden)
    found = {
        c: _columns([_of(rows, c) for rows in chosen], first, 0.0, columns.shape[1])
        for c, columns in known.items()
    }
    return replace(recording, carryover=found)


def _carried_over(
    runs: Runs, hidden: Sequence[int], first: int, size: Mapping[str, float]
) -> dict[str, FloatArray]:
    """Columns by channel of what these runs, of gaps those chosen, add from row `first` on, where they are worth
    any."""
    chosen = runs.chosen(hidden)
    found = {
        c: _columns([_of(rows, c) for rows in chosen], first, HISTORY_FAINT * s) for c, s in size.items()
    }
    return {c: columns for c, columns in found.items() if columns.shape[1]}


def _of(rows: Sequence[Mapping[str, FloatArray]], channel: str) -> FloatArray:
    return np.column_stack([run[channel] for run in rows])


def _apart(
    problem: Problem,
    x: FloatArray,
    recording: Evidence,
    channels: Sequence[str],
    only: Sequence[int] | None = None,
) -> Runs:
    """What each assumed history, and each detour in each gap (or in these), that the drive could have had adds to the
    judged rows, by channel."""
    made = simulator(problem.joint(x, recording))
    try:
        plain = made.predict(recording)
    except InputError:
        return NONE

    def added(each: Iterable[Unrecorded]) -> list[dict[str, FloatArray]]:
        found = []
        for unrecorded in each:
            try:
                run = made.predict(recording, unrecorded)
            except InputError:
                continue
            found.append({c: run[c] - plain[c] for c in channels})
        return found

    asked = detours(problem.config, recording) if only is None or only else {}
    gaps = {k: added(each) for k, each in asked.items() if only is None or k in only}
    return Runs(plain, added(histories(problem, recording)), gaps)


def _first_row(apart: FloatArray, enough: float, after: int) -> tuple[int, float]:
    """The earliest cut, from row `after` on, from which histories (k x rows) differ by no more than `enough` but for a
    constant, else the best there is; and by how much they differ from there on (RMS)."""
    best: tuple[int, float] | None = None
    for cut in HISTORY_CUTS:
        first = max(int(cut * apart.shape[1]), after)
        later = apart[:, first:]
        left = float(np.sqrt(np.mean((later - later.mean(axis=1, keepdims=True)) ** 2)))
        if left <= enough:
            return first, left
        if best is None or left < 0.7 * best[1]:
            best = (first, left)
    assert best is not None
    return best


def _columns(runs: Sequence[FloatArray], first: int, faint: float, count: int | None = None) -> FloatArray:
    """Principal columns of what the histories, and each gap's detours, add from row `first` on, a constant apart, those
    that are not faint or so many; rotated, so that one prior does for all, and of each gap over the root of their
    number, so that more of them say no more: one of these has been."""
    number = np.concatenate([np.full(r.shape[1], float(r.shape[1])) for r in runs])
    together = np.column_stack(runs)
    centred = (together - together[first:].mean(axis=0)) / np.sqrt(number)
    _, s, Vt = _svd(centred[first:])
    # in the history that has most of it: some directions few histories have
    most = s * np.max(np.abs(Vt) * np.sqrt(number), axis=1)
    kept = Vt[most > faint * np.sqrt(len(centred) - first)] if count is None else Vt[:count]
    columns: FloatArray = centred @ kept.T
    missing = 0 if count is None else count - columns.shape[1]
    return np.pad(columns, ((0, 0), (0, missing))) if missing > 0 else columns


def _svd(a: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Singular value decomposition, by the slower iteration where the quick one ends without an answer: it may on what
    is rounding alone."""
    try:
        return np.linalg.svd(a, full_matrices=False)
    except np.linalg.LinAlgError:
        U, s, Vt = svd(a, full_matrices=False, lapack_driver="gesvd")
        return U, s, Vt
