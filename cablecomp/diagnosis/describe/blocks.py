"""Contiguous blocks for fitting and for judging: the state runs through all of them, the score counts in
half.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray, IntArray


@dataclass(frozen=True)
class Layout:
    """Which samples are fitted and which are held out.

    `block`: number of the block of each sample, contiguous, within one recording; `heldout`: sample belongs
    to a held-out block and counts; `training`: sample belongs to a training block. Samples near a border
    belong to neither, so that noise that remembers does not carry over. `heldout_blocks`,
    `training_blocks`: their numbers.
    """

    block: IntArray
    heldout: np.ndarray[tuple[int], np.dtype[np.bool_]]
    training: np.ndarray[tuple[int], np.dtype[np.bool_]]
    heldout_blocks: IntArray
    training_blocks: IntArray


def alternate_blocks(
    starts: IntArray, samples: int, direction: FloatArray, guard: int = 0, count: int | None = None
) -> Layout:
    """Cut recordings into an even number of alternating training and held-out blocks.

    Each block holds about two reversals of the load (of `direction`: -1, 0, +1 per sample) if the recording
    has enough of them, so that either half has seen loading and unloading; there are 16 to 40 blocks in all
    (`count` fixes it). `guard`: samples left out on either side of a border. A recording alone is cut into
    at least 4 blocks if it has 40 samples or more.

    Raises InputError if there are fewer than 40 samples.
    """
    if samples < 40:
        raise InputError(f"judging needs 40 samples or more, found {samples}; record longer")
    turns = np.flatnonzero(np.diff(direction) != 0.0)
    wanted = count if count is not None else int(np.clip(len(turns) // 2, 16, 40))
    wanted = max(2 * ((wanted + 1) // 2), 2)
    bounds = np.append(starts, samples)
    block = np.zeros(samples, dtype=np.int64)
    held = np.zeros(samples, dtype=np.bool_)
    kept = np.zeros(samples, dtype=np.bool_)
    first = 0
    for a, b in itertools.pairwise(bounds):
        least = 4 if b - a >= 40 else 1
        parts = int(np.clip(round(wanted * (b - a) / samples), least, max(1, (b - a) // 10)))
        inner = np.arange(b - a) * parts // (b - a)
        block[a:b] = first + inner
        edges = np.searchsorted(inner, np.arange(parts + 1))
        room = min(guard, int(np.min(np.diff(edges))) // 4)
        for low, high in itertools.pairwise(edges):
            kept[a + low + (room if low else 0) : a + high - (room if high < b - a else 0)] = True
        first += parts
    held = block % 2 == 1
    numbers = np.arange(first, dtype=np.int64)
    return Layout(block, held & kept, ~held & kept, numbers[1::2], numbers[0::2])
