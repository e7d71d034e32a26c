"""A fit of a linear model, where a test needs no drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Linear:
    """What is asked of a fit: its problem, where it ended, what it leaves, the derivative of that."""

    problem: Any
    x: FloatArray
    residual: FloatArray
    J: FloatArray
