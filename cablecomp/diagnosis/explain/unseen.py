"""How large each effect could be without having shown: what *consistent* means, and what it does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.diagnosis.explain.linear import Anchor, anchor, contribution
from cablecomp.diagnosis.explain.model import least
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parallel import in_processes
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Hidden:
    """An effect that parameters within their tolerances make up for, up to `amount`; the joint with as much of it."""

    effect: str
    parameters: tuple[str, ...]
    amount: float
    unit: str
    visible: float
    joint: JointConfig

    @property
    def why(self) -> str:
        """For readers."""
        names = " and ".join(f"`{name}`" for name in self.parameters)
        does = "within its tolerance makes" if len(self.parameters) == 1 else "within their tolerances make"
        size = f"{self.amount:.3g} {self.unit.removeprefix('-')}".rstrip()
        return f"{names} {does} up for it: up to {size} of it leave no trace in these data"


def could_be_unseen(
    fit: Fit, pool: Sequence[Hypothesis], named: Sequence[str]
) -> tuple[list[dict[str, Any]], list[Hidden]]:
    """One row per effect: its amount is below `below` unless it hides in the least visible of its shapes; None
    = any size. Beside them the effects that calibration within its tolerances conceals."""
    here = anchor(fit, reach=0.0)  # what a calibration within its tolerances may do, it may
    found, hidden = [], []
    held = {entry.id for entry in fit.problem.config.effect}
    asked = [h for h in pool if h.name not in named and (h.effect.id not in held or h.channel)]
    for h, made in zip(asked, in_processes(lambda h: _made(here, h), asked), strict=True):
        sizes = _bounds(here, h, made)
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
        if not (h.has_instant or h.has_phase):
            behind = [_hidden(here, h, k, *m) for k, m in zip(_shapes(h), made, strict=True) if m is not None]
            hidden += sorted((b for b in behind if b is not None), key=lambda b: -b.visible)[:1]
    return found, sorted(hidden, key=lambda b: -b.visible)[: LIMITS.hidden_most]


def _shapes(h: Hypothesis) -> range:
    """Which of its starts are looked at."""
    return range(0, len(h.starts), 1 + (len(h.starts) - 1) // LIMITS.unseen_shapes)


def _made(here: Anchor, h: Hypothesis) -> list[tuple[FloatArray, float] | None]:
    """What an effect does in each of its shapes, and of which size: what shows in one is about that in the next."""
    made: list[tuple[FloatArray, float] | None] = []
    about = None
    for k in _shapes(h):
        made.append(contribution(here, h, h.starts[k], about))
        about = made[-1][1] if made[-1] is not None else about
    return made


def _bounds(
    here: Anchor, h: Hypothesis, made: Sequence[tuple[FloatArray, float] | None]
) -> list[float | None]:
    """The bound of each shape whose contribution (what it does, of which size) is given; of a phase the one that shows
    least."""
    if not h.has_phase:
        return [None if m is None else _bound(here, *m, h.two_sided) for m in made]
    given = [m for m in made if m is not None]
    return [_bound_of_phase(here, given) if len(given) == len(made) else None]


def _bound_of_phase(here: Anchor, made: Sequence[tuple[FloatArray, float]]) -> float | None:
    """As `_bound`, amount and phase being a pair (a cos, a sin): the pair's own length, and its standard deviation
    along the phase that shows least."""
    own = np.column_stack([here.beyond(d) / size for d, size in made])
    u, s, vt = np.linalg.svd(own, full_matrices=False)
    if s[-1] <= 1e-9 * max(abs(1.0 / size) for _, size in made):
        return None
    shown = vt.T @ ((u.T @ here.beyond(here.fit.residual)) / s)
    return float(np.linalg.norm(shown) + LIMITS.unseen / s[-1])


def _bound(here: Anchor, d: FloatArray, size: float, two_sided: bool) -> float | None:
    """What these data show of an amount of which `size` does d, and `LIMITS.unseen` standard deviations more: an effect
    that is there and has no name is not held below what would show of noise alone."""
    own = here.beyond(d)
    length = float(np.linalg.norm(own))
    if length <= 1e-9:
        return None
    shown = float(here.beyond(here.fit.residual) @ own) / length
    return (LIMITS.unseen + (abs(shown) if two_sided else max(shown, 0.0))) * abs(size) / length


def _hidden(here: Anchor, h: Hypothesis, shape: int, d: FloatArray, size: float) -> Hidden | None:
    """Whether steps of the calibration inside the tolerances do what `size` of the effect does: J s = d, |s_j|
    <= LIMITS.hidden_within."""
    problem = here.fit.problem
    count = len(problem.parameters)
    J, d = here.fit.J[: len(d) - count], d[: len(d) - count]
    length = float(np.linalg.norm(d))
    finite = np.array([np.isfinite(p.sd) for p in problem.parameters], dtype=np.bool_)
    if not finite.any() or length <= 0.0:
        return None
    sds = np.array([p.sd for p in problem.parameters])
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    s = _likeliest(J, d, sds)
    if float(np.linalg.norm(d - J @ s)) > LIMITS.hidden * length:
        return None
    most = float(np.max(np.abs(s[finite]) / sds[finite]))
    factor = LIMITS.hidden_within / max(most, 1e-300)
    amount = min(abs(size) * factor, max(abs(b) for b in h.amount.bounds(problem.config)))
    visible = length * amount / abs(size)
    if visible < LIMITS.unseen or amount <= least(h.amount, problem.config):
        return None
    does = np.abs(s) * scale
    most_of_it = [problem.parameters[j].name for j in np.argsort(-does) if does[j] > 0.5 * np.max(does)]
    made = with_entry(problem, h, h.entry({**h.starts[shape].values, h.amount.name: amount}))
    x = here.fit.x + s * amount / size  # d is the residual without the effect less the one with it
    low, high = problem.bounds()
    moved = np.concatenate([np.clip(x, low, high), [q.x(q.start) for q in made.parameters[count:]]])
    there = made.followed(moved)
    if (
        there is None
        or float(np.linalg.norm(there[: len(d)] - here.fit.residual[: len(d)])) > LIMITS.hidden_kept * visible
    ):
        return None
    return Hidden(
        h.name, tuple(most_of_it), amount, h.amount.unit, visible, made.joint(moved, problem.evidence[0])
    )


def _likeliest(J: FloatArray, d: FloatArray, sds: FloatArray) -> FloatArray:
    """Steps s with J s = d that go least far within tolerances of these deviations: parameters that do nearly the same
    share what there is to do, and one that does nothing stays. Up to half of `LIMITS.hidden` of d is given up for
    that."""
    does = np.linalg.norm(J, axis=0)
    scale = np.where(does > 0.0, does, 1.0)
    plain = np.asarray(np.linalg.lstsq(J / scale, d, rcond=1e-6)[0] / scale, dtype=np.float64)
    far = float(np.linalg.norm(plain / sds))
    if far <= 0.0:
        return plain
    price = 0.5 * LIMITS.hidden * float(np.linalg.norm(d)) / far
    A = np.vstack([J, np.diag(price / sds)]) / scale
    return np.asarray(
        np.linalg.lstsq(A, np.append(d, np.zeros(len(sds))), rcond=1e-9)[0] / scale, dtype=np.float64
    )


__all__ = ["Hidden", "could_be_unseen"]
