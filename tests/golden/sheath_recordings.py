"""Surgical manipulator with tendons in a sheath: five bends, and what models without the drive leave."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import recordings as files
from baselines import BASELINES
from recordings import JOINT

from cablecomp.recording.reader import read_all
from cablecomp.signal.smoothing import FloatArray

BENDS: Final = (0, 60, 120, 180, 240)


def path(bend_deg: int) -> Path:
    """The recording of one bend."""
    return files.folder("tendon-sheath") / f"sheath_{bend_deg:03d}.csv.gz"


def baseline(kind: str, train: Sequence[int], test: Sequence[int]) -> dict[str, FloatArray]:
    """Misfit of a baseline that sees motor angle and sheath angle; the encoder starts at zero wherever friction
    holds the tip, so each recording has a zero of its own."""

    def given(bend: int) -> dict[str, FloatArray]:
        columns = read_all(path(bend)).columns
        kept = {k: columns[k] for k in ("time_s", "motor_position_rad", JOINT)}
        return {**kept, "other_bend": np.asarray(columns["other_sheath_angle_rad"])}

    extra = ("other_bend",) if len(train) > 1 else ()
    model = BASELINES[kind]([given(b) for b in train], extra)
    return files.own_zero({str(b): given(b)[JOINT] - model.predict(given(b)) for b in test})


def baseline_left_out(kind: str) -> dict[str, FloatArray]:
    """Every bend left out once."""
    found: dict[str, FloatArray] = {}
    for bend in BENDS:
        found |= baseline(kind, [b for b in BENDS if b != bend], [bend])
    return found
