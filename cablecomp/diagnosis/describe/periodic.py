"""Is a residual periodic in an angle? Own code: the periodograms of SciPy and astropy know no surrogates by blocks.

A least-squares periodogram against the angle, after a smooth dependence on load and angle is taken off. Noise
remembers, so a p-value comes from surrogates that flip the sign of whole blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cablecomp.diagnosis.locate.series import Series
from cablecomp.diagnosis.locate.views import contrasts, hats, load_path
from cablecomp.signal.smoothing import FloatArray

_MOST: Final = 160
"""Frequencies of the periodogram: its cost."""
_HIGHEST: Final = 60.0
"""Highest frequency looked at [periods per revolution]: finer than any tooth or strand."""


@dataclass(frozen=True)
class Periodicity:
    """The strongest periodic part against one angle.

    `angle`: "motor_angle" or "joint_angle"; `cycles`: periods per revolution of that angle;
    `cycles_sd`: its resolution; `with_load`: the amplitude grows with the load (then in rad per RMS
    load); `amplitude` (rad) and `phase` (rad): amplitude sin(cycles q + phase); `share` of the
    residual's energy (after a smooth dependence on load, direction and angle is taken off); `p_value`
    for the strongest of all frequencies tried.
    """

    angle: str
    with_load: bool
    cycles: float
    cycles_sd: float
    amplitude: float
    phase: float
    share: float
    p_value: float


def periodicity(
    series: Series, angle: str, rng: np.random.Generator, with_load: bool = False, surrogates: int = 299
) -> Periodicity | None:
    """Look for a period of the residual in `angle`; None if the angle covers too little to hold two periods.

    Frequencies run from two periods over the angle's range up to 60 per revolution (160 of them at
    most). Surrogates flip the sign of whole blocks and are asked for their own strongest frequency.
    """
    values = series.covariates.values
    if angle not in values:
        return None
    q = values[angle]
    reach = float(np.ptp(q))
    if reach <= 0.0:
        return None
    lowest, resolution = 2.0 * 2.0 * np.pi / reach, 0.25 * 2.0 * np.pi / reach
    if lowest >= _HIGHEST:
        return None
    count = int(min(_MOST, (_HIGHEST - lowest) / resolution + 1.0))
    cycles = lowest + np.arange(count) * resolution
    weight = 1.0 / series.sigma
    plain = np.column_stack(
        (np.ones(series.samples), load_path(series), contrasts(hats(values["load"], 7)), q, q**2)
    )
    base, _ = np.linalg.qr(plain * weight[:, None])
    residual = series.residual * weight
    residual = residual - base @ (base.T @ residual)
    block = series.blocks()
    firsts = np.flatnonzero(np.concatenate(([True], np.diff(block) != 0)))
    signs = rng.choice(np.array([-1.0, 1.0]), size=(surrogates, len(firsts)))
    signs = np.vstack((np.ones((1, len(firsts))), signs))
    power = np.empty((len(signs), count))
    factor = weight * load_path(series)[:, 0] if with_load else weight
    for index, k in enumerate(cycles):
        waves = _waves(q, k, factor, base)
        inverse = np.linalg.pinv(waves.T @ waves)
        moments = signs @ np.add.reduceat(waves * residual[:, None], firsts, axis=0)
        power[:, index] = np.einsum("si,ij,sj->s", moments, inverse, moments)
    top = int(np.argmax(power[0]))
    best, pair, height = _refined(q, float(cycles[top]), resolution, factor, base, residual)
    p_value = float(1 + np.count_nonzero(power[1:].max(axis=1) >= power[0, top])) / (surrogates + 1)
    energy = float(series.residual @ (series.residual * weight**2))
    return Periodicity(
        angle,
        with_load,
        best,
        float(resolution),
        float(np.hypot(pair[0], pair[1])),
        float(np.arctan2(pair[1], pair[0])),
        height / energy if energy > 0.0 else 0.0,
        p_value,
    )


def _waves(q: FloatArray, cycles: float, factor: FloatArray, base: FloatArray) -> FloatArray:
    waves = np.column_stack((np.sin(cycles * q), np.cos(cycles * q))) * factor[:, None]
    return np.asarray(waves - base @ (base.T @ waves), dtype=np.float64)


class _Peak(NamedTuple):
    cycles: float
    pair: FloatArray
    height: float


def _refined(
    q: FloatArray,
    cycles: float,
    width: float,
    factor: FloatArray,
    base: FloatArray,
    residual: FloatArray,
) -> _Peak:
    """The highest point of the periodogram within one step of a grid frequency."""
    best = _Peak(cycles, np.zeros(2), -np.inf)
    for trial in cycles + width * np.linspace(-1.0, 1.0, 17):
        waves = _waves(q, float(trial), factor, base)
        pair = np.linalg.lstsq(waves, residual, rcond=None)[0]
        height = float(pair @ (waves.T @ residual))
        if height > best.height:
            best = _Peak(float(trial), np.asarray(pair, dtype=np.float64), height)
    return best


def which_angle(found: list[Periodicity], ratio: float | None) -> str:
    """Say in which angle the period lies: "motor_angle", "joint_angle", or "either" if these data
    cannot tell.

    Physical periods (teeth, an eccentric pulley, a lay of wires around a drum) come as whole cycles per
    revolution; `ratio` = motor angle per joint angle. The better fit decides if it is clearly better,
    whole cycles otherwise.
    """
    if not found:
        return "either"
    best = max(found, key=lambda entry: entry.share)
    rivals = [entry for entry in found if entry is not best]
    if not rivals or rivals[0].share < 0.8 * best.share:
        return best.angle
    if ratio is not None and abs(abs(ratio) - 1.0) > 0.02:
        whole = [e for e in found if abs(e.cycles - round(e.cycles)) < 0.5 * e.cycles_sd and round(e.cycles)]
        if len(whole) == 1:
            return whole[0].angle
    return "either"
