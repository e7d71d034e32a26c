"""How large each effect could be without having shown: what *consistent* means, and what it does not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.screening import Anchor, anchor, contribution
from cablecomp.estimation.least_squares import Fit

SIGMAS = 3.0
"""Standard deviations of its amount up to which an effect could have stayed unseen."""

SHAPES = 6
"""Shapes of an effect, and instants of an event, among which the least visible one is looked for."""


def could_be_unseen(fit: Fit, pool: Sequence[Hypothesis], named: Sequence[str]) -> list[dict[str, Any]]:
    """One row per effect: its amount is below `below` unless it hides in the least visible of its shapes; None = any size."""
    here = anchor(fit)
    found = []
    for h in pool:
        if h.name in named:
            continue
        shapes = range(0, len(h.starts), 1 + (len(h.starts) - 1) // SHAPES)
        sizes = [_bound(here, h, k) for k in shapes]
        seen = [s for s in sizes if s is not None]
        most = max(abs(b) for b in h.amount.bounds(fit.problem.config))
        below = max(seen) if seen and len(seen) == len(sizes) else None
        any_size = below is None or below > most
        found.append(
            {
                "effect": h.name,
                "parameter": h.amount.name,
                "below": None if any_size else below,
                "unit": h.amount.unit,
                "why": "these data say nothing of it: it could be any size" if any_size else "",
            }
        )
    return found


def _bound(here: Anchor, h: Hypothesis, k: int) -> float | None:
    made = contribution(here, h, h.starts[k])
    if made is None:
        return None
    d, size = made
    length = float(np.linalg.norm(here.beyond(d)))
    return SIGMAS * abs(size) / length if length > 1e-9 else None
