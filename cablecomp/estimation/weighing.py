"""What a row's misfit counts for in a fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Weighing:
    """What a misfit counts for: by channel, 1-sigma of a row with its memory, and how far a recording's zero
    departs from its session's; `moved`: recordings whose zero was set anew, and how far it may be; `history`: how far
    one that nobody recorded moves zeros [the channel's unit]; `beside_leaps`: what part of their weight the joint's
    rows keep, by recording (`leaps`)."""

    sigma: Mapping[str, float]
    zero_sd: Mapping[str, float]
    moved: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    history: Mapping[str, float] = field(default_factory=dict)
    beside_leaps: Mapping[str, FloatArray] = field(default_factory=dict)

    def of_rows(self, e: Evidence, channel: str) -> FloatArray:
        """Weight of every row of a recording in a channel."""
        kept = self.beside_leaps.get(e.name) if channel == JOINT else None
        return e.weight if kept is None or len(kept) != len(e.weight) else e.weight * kept
