"""Cut a bench recording into load ramps and holds, under noise (thesis, Appendix A.2: pump on, pump off).

Own line fit: one window for the whole recording, as wide as a ramp's slope needs, for the bench's errors are worked out
from that window; `signal/smoothing.py` takes each place by itself.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cablecomp.errors import InputError

Array = npt.NDArray[np.float64]

_MOVING = 0.1  # a load that changes slower than this share of the fastest ramp counts as held


@dataclass(frozen=True)
class Segment:
    """A stretch of one kind; `direction` +1 or -1 in a ramp, 0 in a hold. Samples `start` to `stop`
    (exclusive).
    """

    direction: int
    start: int
    stop: int

    @property
    def is_hold(self) -> bool:
        return self.direction == 0


class Smoothed(NamedTuple):
    """Local straight-line fit: value and slope at every sample, and the window it used."""

    value: Array
    slope: Array
    window: int


def noise_of(signal: Array) -> float:
    """1-sigma white noise of a signal whose own second difference is small; in the signal's unit.

    From the 95th percentile of |second difference| (sqrt(6) sigma, 1.96 sigma wide), or its RMS where
    quantisation leaves most differences zero.
    """
    second = np.abs(np.diff(signal, 2))
    if len(second) == 0:
        return 0.0
    wide = float(np.quantile(second, 0.95)) / 1.96
    return max(wide, float(np.sqrt(np.mean(np.minimum(second, 8.0 * wide) ** 2)))) / math.sqrt(6.0)


def segments_of(time_s: Array, load: Array) -> tuple[tuple[Segment, ...], Smoothed]:
    """Return the ramps and holds of `load` in order, and the smoothed load that they were found in.

    Stretches shorter than half the smoothing window are put to their neighbours. Raises InputError where the
    load does not move by more than its noise.
    """
    noise, span = noise_of(load), float(np.ptp(load))
    if not span > 10.0 * noise:
        raise InputError(
            f"load moves by {span:.3g} N m, its noise is {noise:.3g} N m; a bench needs a ramp that "
            "stands out of the noise by a factor of 10"
        )
    count = len(load)
    # Wide enough that the slope's noise stays below a few percent of a ramp that takes half of the recording.
    wanted = (58.0 * noise / span * count) ** (2.0 / 3.0)
    window = int(np.clip(wanted, 5, max(5, count // 12))) | 1
    smoothed = local_line(time_s, load, window)
    spacing = (time_s[-1] - time_s[0]) / (count - 1)
    slope_noise = noise * math.sqrt(12.0) / (window**1.5 * spacing)
    threshold = max(_MOVING * float(np.max(np.abs(smoothed.slope))), 5.0 * slope_noise)
    kind = np.where(np.abs(smoothed.slope) > threshold, np.sign(smoothed.slope), 0.0).astype(int)
    return _runs(kind, max(2, window // 2)), smoothed


def local_line(time_s: Array, signal: Array, window: int) -> Smoothed:
    """Straight-line fit in a window of `window` samples around each sample (cut off at the ends); uneven
    times allowed.
    """
    count = len(signal)
    half = window // 2
    low = np.maximum(np.arange(count) - half, 0)
    high = np.minimum(np.arange(count) + half + 1, count)
    t, y = time_s - time_s.mean(), signal - signal.mean()

    def total(x: Array) -> Array:
        running = np.concatenate([[0.0], np.cumsum(x)])
        return np.asarray(running[high] - running[low])

    n = (high - low).astype(float)
    mean_t, mean_y = total(t) / n, total(y) / n
    # Centring on the window afterwards loses little: t is centred on the recording and n is not small beside
    # it.
    stt = total(t * t) / n - mean_t**2
    sty = total(t * y) / n - mean_t * mean_y
    slope = np.where(stt > 0.0, sty / np.where(stt > 0.0, stt, 1.0), 0.0)
    return Smoothed(mean_y + slope * (t - mean_t) + signal.mean(), slope, window)


def trimmed(segment: Segment, margin: int) -> slice:
    """The segment's samples without `margin` at either end, but at least its middle half."""
    length = segment.stop - segment.start
    cut = min(margin, length // 4)
    return slice(segment.start + cut, segment.stop - cut)


def _runs(kind: npt.NDArray[np.int_], shortest: int) -> tuple[Segment, ...]:
    edges = np.flatnonzero(np.diff(kind)) + 1
    bounds = [0, *edges.tolist(), len(kind)]
    runs = [Segment(int(kind[a]), a, b) for a, b in itertools.pairwise(bounds)]
    while len(runs) > 1:
        index = min(range(len(runs)), key=lambda i: runs[i].stop - runs[i].start)
        if runs[index].stop - runs[index].start >= shortest:
            break
        runs = _absorbed(runs, index)
    return tuple(runs)


def _absorbed(runs: list[Segment], index: int) -> list[Segment]:
    """Give a run that is too short to its longer neighbour, and join equals that meet."""
    around = [i for i in (index - 1, index + 1) if 0 <= i < len(runs)]
    into = max(around, key=lambda i: runs[i].stop - runs[i].start)
    kinds = [run.direction for run in runs]
    kinds[index] = kinds[into]
    joined: list[Segment] = []
    for run, direction in zip(runs, kinds, strict=True):
        if joined and joined[-1].direction == direction:
            joined[-1] = Segment(direction, joined[-1].start, run.stop)
        else:
            joined.append(Segment(direction, run.start, run.stop))
    return joined
