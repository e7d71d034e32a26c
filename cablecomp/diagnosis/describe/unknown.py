"""Describe structure that no known effect accounts for, without giving it a name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cablecomp.diagnosis.describe.law import SparseLaw, sparse_law
from cablecomp.diagnosis.describe.memory import lagged, play
from cablecomp.diagnosis.describe.periodic import Periodicity, periodicity, which_angle
from cablecomp.diagnosis.describe.terms import terms
from cablecomp.diagnosis.folds import alternate_blocks
from cablecomp.diagnosis.locate.covariates import FURTHER
from cablecomp.diagnosis.locate.crossfit import block_sums, gains
from cablecomp.diagnosis.locate.segments import segment
from cablecomp.diagnosis.locate.series import Series, thin
from cablecomp.diagnosis.locate.views import contrasts, elapsed, hats, load_path, products
from cablecomp.signal.smoothing import FloatArray

Memory = Literal["memoryless", "remembers time", "remembers motion", "undecided"]
Parity = Literal["odd", "even", "mixed", "undecided"]
Path = Literal["load", "displacement", "both", "undecided"]
_LEAST: Final = 0.04
"""Share of the energy beyond noise below which one description says no more than another."""


@dataclass(frozen=True)
class Description:
    """What a residual looks like.

    `memory`: whether present values account for it, or what went before;
    `parity` in the direction of motion; `path`: whether its size grows with the load ("load") or not
    ("displacement"); `period`: strongest period in an angle if it is beyond chance, `period_in`: which
    angle; `events_s`: instants at which it changes; `law`: a sparse equation if one holds on held-out
    blocks; `text`: all of it in plain words.
    """

    memory: Memory
    parity: Parity
    path: Path
    period: Periodicity | None
    period_in: str
    events_s: tuple[float, ...]
    law: SparseLaw | None
    text: str


@dataclass(frozen=True)
class _Gain:
    share: float
    per_block: FloatArray


def describe(
    series: Series, rng: np.random.Generator, nuisance: FloatArray | None = None, ratio: float | None = None
) -> Description:
    """Describe the residual of a series: memory, period, parity, path, events, and a sparse law
    if one holds.

    `nuisance` (n x p): sensitivities to the calibration parameters, fitted along and not counted.
    `ratio`: motor angle per joint angle, to tell motor periods from joint periods. Works on at most 12
    000 group means, so cost does not grow with length.
    """
    columns = (
        np.ones((series.samples, 1))
        if nuisance is None
        else np.column_stack((np.ones(series.samples), nuisance))
    )
    thinned = thin(series, columns)
    ask = _Questions(thinned.series, thinned.extra)
    memory = _memory(ask)
    parity = _parity(ask)
    path = _path(ask)
    found = [
        entry
        for angle in ("motor_angle", "joint_angle")
        for with_load in (False, True)
        if (entry := periodicity(ask.series, angle, rng, with_load)) is not None
        and entry.p_value < 0.01
        and entry.share > 0.1
    ]
    period = max(found, key=lambda entry: entry.share) if found else None
    whole = np.column_stack((np.ones(ask.series.samples), load_path(ask.series)))
    pieces = segment(ask.series.residual / ask.series.sigma, whole)
    changes = pieces.changes if pieces.gain > 0.2 and len(pieces.changes) <= 3 else pieces.changes[:0]
    events = tuple(float(t) for t in ask.series.covariates.values["time"][changes])
    directions = ask.series.covariates.values["load_direction"]
    layout = alternate_blocks(ask.series.covariates.starts, ask.series.samples, directions)
    law = sparse_law(ask.series, list(terms(ask.series, period, changes)), layout, rng)
    law = law if law is not None and law.supported else None
    alike = [entry for entry in found if period is not None and entry.with_load == period.with_load]
    where = which_angle(alike, ratio)
    text = _text(memory, parity, path, period, where, events, law)
    return Description(memory, parity, path, period, where, events, law, text)


class _Questions:
    """Cross-fitted shares of the energy beyond noise, for any set of regressors."""

    def __init__(self, series: Series, nuisance: FloatArray) -> None:
        self.series = series
        self.block = series.blocks()
        self.weight = 1.0 / series.sigma**2
        self.nuisance = nuisance
        energy = float(np.sum(self.weight * series.residual**2))
        self.excess = max(energy - series.samples, 0.1 * energy, 1e-300)
        self._base = gains(block_sums(nuisance, series.residual, self.weight, self.block))

    def gain(self, *bases: FloatArray) -> _Gain:
        basis = np.column_stack((self.nuisance, *bases))
        scale = np.sqrt(np.mean(basis**2, axis=0))
        basis = basis[:, scale > 0.0] / scale[scale > 0.0]
        per_block = gains(block_sums(basis, self.series.residual, self.weight, self.block)) - self._base
        return _Gain(float(per_block.sum()) / self.excess, per_block)

    def clear(self, better: _Gain, worse: _Gain) -> bool:
        """Whether one set accounts for more than another beyond two standard errors and a small share."""
        difference = better.per_block - worse.per_block
        error = float(np.std(difference, ddof=1) * np.sqrt(len(difference))) / self.excess
        return better.share - worse.share > max(_LEAST, 2.0 * error)


def _memory(ask: _Questions) -> Memory:
    series = ask.series
    values, starts = series.covariates.values, series.covariates.starts
    now = _present(series)
    clock = elapsed(series)
    length = float(clock[-1]) / max(1, len(starts))
    load = values["load"]
    q = values.get("joint_angle", values["motor_angle"])
    lags = [load - lagged(load, clock, share * length, starts) for share in (0.004, 0.015, 0.05)]
    lags += [q - lagged(q, clock, share * length, starts) for share in (0.004, 0.015, 0.05)]
    direction = values["load_direction"]
    dwell = values["dwell"]
    if float(np.max(dwell)) > 0.0:
        lags += [direction * np.exp(-dwell / (share * float(np.max(dwell)))) for share in (0.1, 0.4)]
    plays = [load - play(load, share * float(np.ptp(load)), starts) for share in (0.05, 0.15, 0.3)]
    plays += [q - play(q, share * float(np.ptp(q)), starts) for share in (0.02, 0.05, 0.15)]
    distance = products(hats(values["reversal"], 5), direction[:, None])
    timed = np.column_stack(lags)
    moved = np.column_stack((*plays, distance))
    plain, with_time = ask.gain(now), ask.gain(now, timed)
    with_motion, both = ask.gain(now, moved), ask.gain(now, timed, moved)
    richest = max((with_time, with_motion, both), key=lambda gain: gain.share)
    if ask.clear(richest, plain):
        return "remembers time" if with_time.share > with_motion.share else "remembers motion"
    return "memoryless" if plain.share > 0.5 else "undecided"


def _present(series: Series) -> FloatArray:
    """Regressors that depend on present values alone."""
    values = series.covariates.values
    path = load_path(series)
    parts = [path, contrasts(hats(values["load"], 8)), series.covariates.motion_direction[:, None]]
    for name, count in (("joint_angle", 9), ("velocity", 7), ("acceleration", 4), ("load_rate", 5)):
        if name in values and float(np.ptp(values[name])) > 0.0:
            basis = contrasts(hats(values[name], count))
            parts.append(basis)
            if name == "joint_angle":
                parts.append(products(contrasts(hats(values[name], 4)), path))
    for name in values:
        if name == "temperature" or name.startswith(FURTHER):
            parts.append(contrasts(hats(values[name], 4)))
            parts.append(products(contrasts(hats(values[name], 3)), path))
    return np.column_stack(parts)


def _parity(ask: _Questions) -> Parity:
    values = ask.series.covariates.values
    load, speed = values["load"], values["velocity"]
    q = values.get("joint_angle", values["motor_angle"])
    place = np.column_stack(
        (contrasts(hats(load, 7)), contrasts(hats(q, 7)), contrasts(hats(np.abs(speed), 4)))
    )
    turns = np.column_stack((ask.series.covariates.motion_direction, values["load_direction"]))
    ways = np.column_stack((turns, np.abs(load)[:, None] * turns, load[:, None] * turns, speed))
    odd, even, both = ask.gain(ways), ask.gain(place), ask.gain(ways, place)
    if both.share < 0.2:
        return "undecided"
    # what each part still adds when the other one is there: load and direction overlap in most recordings
    odd_only, even_only = max(0.0, both.share - even.share), max(0.0, both.share - odd.share)
    if odd_only > 3.0 * even_only and odd_only > 0.1:
        return "odd"
    if even_only > 3.0 * odd_only and even_only > 0.1:
        return "even"
    return "mixed" if min(odd_only, even_only) > 0.1 else "undecided"


def _path(ask: _Questions) -> Path:
    values = ask.series.covariates.values
    load = values["load"]
    top = float(np.max(np.abs(load)))
    if not top > 0.0 or float(np.ptp(np.abs(load))) < 0.2 * top:
        return "undecided"
    q = values.get("joint_angle", values["motor_angle"])
    direction = np.column_stack((values["load_direction"], ask.series.covariates.motion_direction))
    shape = np.column_stack((contrasts(hats(q, 9)), direction, contrasts(hats(values["velocity"], 5))))
    relative = np.abs(load) / top
    signed = load / top
    fixed = ask.gain(shape)
    scaled = ask.gain(relative[:, None] * direction, signed[:, None] * shape, signed[:, None])
    both = ask.gain(shape, relative[:, None] * direction, signed[:, None] * shape, signed[:, None])
    if both.share < 0.2:
        return "undecided"
    adds_load, adds_shape = ask.clear(both, fixed), ask.clear(both, scaled)
    if adds_load and adds_shape:
        return "both"
    if adds_load:
        return "load"
    return "displacement" if adds_shape else "undecided"


def _text(
    memory: Memory,
    parity: Parity,
    path: Path,
    period: Periodicity | None,
    period_in: str,
    events: tuple[float, ...],
    law: SparseLaw | None,
) -> str:
    if memory == "undecided" and period is None and law is None and not events and parity == "undecided":
        return "beyond the stated noise, without a pattern that could be described"
    words = [
        {
            "memoryless": "it follows present values alone",
            "remembers time": "it depends on the past and forgets in time",
            "remembers motion": "it depends on the past and forgets by motion, not by time",
            "undecided": "whether it has memory cannot be told",
        }[memory]
    ]
    if period is not None:
        names = {"motor_angle": "motor", "joint_angle": "joint", "either": "motor or joint"}
        words.append(
            f"periodic, {period.cycles:.3g} times per revolution of the {names[period_in]}, "
            f"amplitude {period.amplitude:.2g} rad{' at the usual load' if period.with_load else ''}"
        )
    if parity in ("odd", "even"):
        words.append(f"{parity} in the direction of motion")
    elif parity == "mixed":
        words.append("partly odd, partly even in the direction of motion")
    if path in ("load", "displacement"):
        words.append("grows with the load" if path == "load" else "its size does not follow the load")
    elif path == "both":
        words.append("one part of it grows with the load, another does not")
    words.append(
        "changes at " + ", ".join(f"{event:.4g} s" for event in events)
        if events
        else "steady over the recording"
    )
    if law is not None:
        words.append(f"a law that holds on held-out data: {law.equation}")
    else:
        words.append("no sparse law of plain terms holds on held-out data")
    return "; ".join(words)
