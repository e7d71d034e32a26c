"""How long a diagnosis or a calibration may go on, and who is told how far it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from time import monotonic

Progress = Callable[[str, float], None]
"""Told what is being done, and the share done."""


@dataclass(frozen=True)
class Pace:
    """Its progress and its end by the monotonic clock [s]; after that nothing further is begun."""

    tell: Progress
    end_s: float = inf

    @property
    def over(self) -> bool:
        """Whether the time is up."""
        return monotonic() >= self.end_s
