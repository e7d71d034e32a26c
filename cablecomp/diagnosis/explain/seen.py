"""What effects were seen to do beside earlier models of a search: of the many points that an effect may be asked from,
those that a straight line by this puts first are run again, and no others.

What an effect does hardly hangs on what else the model has; what is left for it to explain does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cablecomp.diagnosis.explain.hypotheses import Hypothesis, Start
from cablecomp.estimation.least_squares import Fit
from cablecomp.signal.smoothing import FloatArray

Starts = tuple[Start, ...]
"""Where an effect is asked from: one point, or two of a phase, for its cosine and for its sine."""
Added = tuple[FloatArray, float]
"""What an effect adds (a weighted residual without it less the one with it), and the amount of it that does."""


class _Kept(NamedTuple):
    """What was found from there, of each channel in its unit; nothing where it could not be followed."""

    starts: Starts
    rows: tuple[Mapping[str, NDArray[np.float32]], ...]
    sizes: tuple[float, ...]


OfOne: TypeAlias = Mapping[object, _Kept]
"""What one hypothesis did, by where it was asked from."""


class Seen:
    """What each hypothesis did, by where it was asked from. Work that goes side by side shares none: what is told of a
    hypothesis would hang on which came first."""

    def __init__(self, of: Mapping[str, OfOne] | None = None) -> None:
        self._of: dict[str, dict[object, _Kept]] = {h: dict(kept) for h, kept in (of or {}).items()}

    def apart(self) -> Seen:
        """The same, to go on by itself."""
        return Seen(self._of)

    def only(self, h: Hypothesis) -> Seen:
        """What was seen of one hypothesis, to go on by itself."""
        return Seen({h.name: self._of[h.name]} if h.name in self._of else {})

    def learn(self, other: Seen) -> None:
        """Take over what another one has seen of its hypotheses."""
        self._of |= other._of

    def keep(self, h: Hypothesis, starts: Starts, fit: Fit, found: Sequence[Added]) -> None:
        """Remember what was found beside a fit."""
        sigma, spans = fit.problem.weighing.sigma, fit.problem.spans()
        rows = tuple({c: (d[s] * sigma[c]).astype(np.float32) for c, s in spans.items()} for d, _ in found)
        kept = _Kept(starts, rows, tuple(size for _, size in found))
        self._of.setdefault(h.name, {})[_place(h, starts)] = kept

    def starts_of(self, h: Hypothesis) -> list[Starts]:
        """All that the hypothesis was asked from."""
        return [kept.starts for kept in self._of.get(h.name, {}).values()]

    def recall(self, h: Hypothesis, starts: Starts, fit: Fit) -> list[Added] | None:
        """What was found from there, as rows of this fit's residual; None where nothing was asked, or of other rows."""
        kept = self._of.get(h.name, {}).get(_place(h, starts))
        if kept is None:
            return None
        sigma, spans = fit.problem.weighing.sigma, fit.problem.spans()
        found: list[Added] = []
        for rows, size in zip(kept.rows, kept.sizes, strict=True):
            if any(c not in rows or len(rows[c]) != s.stop - s.start for c, s in spans.items()):
                return None
            d = np.zeros(len(fit.residual))
            for c, s in spans.items():
                d[s] = rows[c] / sigma[c]
            found.append((d, size))
        return found


def _place(h: Hypothesis, starts: Starts) -> object:
    """Where that is, whatever the amount."""
    return tuple(frozenset((k, v) for k, v in s.values.items() if k != h.amount.name) for s in starts)
