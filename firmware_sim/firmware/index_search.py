"""Looking for the encoder's index: one way, back where range or travel ends, then given up."""

from __future__ import annotations

import math

_STALL_S, _STALL_RAD = 5.0, 0.01
"""A search that gets less far in that time has come to an end of the travel."""


class IndexSearch:
    """Where a search goes (`sign`), and how it ended: `zero_rad` (raw angle of the zero, once the index has passed) or
    `lost`.

    The index says where in the turn the motor is; which turn it is, the drive takes to be that of its zero.
    """

    def __init__(self, index_rad: float | None, range_rad: float, now_s: float) -> None:
        self._index_rad = index_rad
        self._range_rad = range_rad
        self._start_rad: float | None = None
        self._turn = 0
        self.sign = 1.0
        self._far_rad, self._far_s = -math.inf, now_s
        self.zero_rad: float | None = None
        self.lost = False

    def look(self, raw_rad: float, now_s: float) -> None:
        """Take in where the motor is."""
        if self._index_rad is None:
            return
        turn = math.floor((raw_rad - self._index_rad) / (2.0 * math.pi))
        if self._start_rad is None:
            self._start_rad, self._turn = raw_rad, turn
        if turn != self._turn:
            self.zero_rad = 2.0 * math.pi * max(turn, self._turn)
            return
        travelled = (raw_rad - self._start_rad) * self.sign
        if travelled > self._far_rad + _STALL_RAD:
            self._far_rad, self._far_s = travelled, now_s
        if travelled > self._range_rad or now_s - self._far_s > _STALL_S:
            if self.sign < 0.0:
                self.lost = True
            else:
                self.sign = -1.0
                self._far_rad, self._far_s = -math.inf, now_s
