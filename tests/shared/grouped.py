"""Rows of data in blocks, and what models may leave of them: noise, and a wave."""

from __future__ import annotations

import numpy as np

from cablecomp.diagnosis.folds import Groups

ROWS, BLOCKS = 600, 20
GROUPS = Groups(
    np.repeat(np.arange(BLOCKS), ROWS // BLOCKS),
    np.repeat(np.arange(BLOCKS), ROWS // BLOCKS) % 6,
    "block",
    np.zeros(ROWS, dtype=np.int64),
)
NOISE = np.random.default_rng(1).standard_normal(ROWS)
WAVE = np.sin(np.arange(ROWS) / 25.0)
