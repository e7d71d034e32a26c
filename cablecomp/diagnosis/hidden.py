"""Effects that hide behind the calibration: within the stated tolerances, a parameter and they predict alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.blocks import Layout
from cablecomp.diagnosis.fitting import INFLATION, Model, Problem, evaluate, prior_of
from cablecomp.diagnosis.screening import Probe
from cablecomp.identification.parameters import OFFSET
from cablecomp.signal.smoothing import FloatArray

SEEN = 2.0  # standard deviations up to which an amplitude is not excluded
LARGE = 1.5  # noise floors (RMS) that such an effect makes before calibration takes it up
ALIKE = 0.25  # of that, what calibration leaves of it
SHOWS = 0.1  # mean square over the floor that may be left of it
SHOWN = 3  # models that the next experiment is to set apart


@dataclass(frozen=True)
class Hidden:
    """One effect behind one parameter.

    `size`: what the effect could make unseen, RMS in noise floors, before the parameter makes up for it;
    `model`: the drive with the effect of that size, its calibration moved to match.
    """

    effect: str
    behind: str
    size: float
    model: JointConfig


def hidden_effects(
    problem: Problem, base: Model, probes: Sequence[Sequence[Probe]], layout: Layout
) -> list[Hidden]:
    """What the calibrated drive could conceal, largest first.

    With J the sensitivities to the calibration, P its priors and d that to the effect, an amplitude's
    variance is 1/(d'd - d'J (J'J + P)^-1 J'd); large while the data are many means that d lies along J.
    """
    mask = layout.heldout | layout.training
    J = base.J[mask]
    free = np.array([p.name != OFFSET for p in problem.parameters])
    if not np.any(free):
        return []
    inverse = np.asarray(np.linalg.inv(J.T @ J + np.diag(prior_of(problem, ()) + 1e-12)), dtype=np.float64)
    found = []
    for group in probes:
        best = max(
            (h for p in group if (h := _one(problem, base, p, mask, J, inverse, free))),
            key=_size,
            default=None,
        )
        if best is not None:
            found.append(best)
    return sorted(found, key=_size, reverse=True)


def _one(
    problem: Problem,
    base: Model,
    probe: Probe,
    mask: np.ndarray[tuple[int], np.dtype[np.bool_]],
    J: FloatArray,
    inverse: FloatArray,
    free: np.ndarray[tuple[int], np.dtype[np.bool_]],
) -> Hidden | None:
    d = probe.D[mask, 0]
    moved = inverse @ (J.T @ d)
    info = float(d @ d - d @ (J @ moved))
    _, high = probe.form.bounds()
    if _rms(d - J @ moved) > ALIKE * _rms(_without_offset(problem, d, J)):
        return None
    largest = min(SEEN / np.sqrt(max(info, 1e-12)), float(high[0]))
    low, top = np.array([[p.low, p.high] for p in problem.parameters]).T
    forms = (*base.forms, probe.form)
    for x in (largest, 0.5 * largest, 0.25 * largest):
        amplitudes = np.zeros(probe.form.size)
        amplitudes[0] = x
        bare = evaluate(problem, forms, np.concatenate([base.z, amplitudes]))
        c = np.clip(base.z - x * moved, low, top)
        taken_up = evaluate(problem, forms, np.concatenate([c, amplitudes]))
        if bare is None or taken_up is None:
            continue
        size = _rms(_without_offset(problem, (base.residual - bare)[mask], J)) * INFLATION
        shown = _rms(taken_up[mask]) ** 2 - _rms(base.residual[mask]) ** 2
        if size >= LARGE and shown * INFLATION**2 < SHOWS:
            along = [
                abs(_cosine(_without_offset(problem, J[:, k], J), d)) if free[k] else 0.0
                for k in range(len(free))
            ]
            behind = problem.parameters[int(np.argmax(along))].name
            model = problem.joint(c, [*base.entries(), probe.form.entry(list(amplitudes))])
            return Hidden(probe.form.name, behind, size, model)
    return None


def grouped(found: Sequence[Hidden]) -> list[tuple[tuple[str, ...], str]]:
    """For each parameter the effects behind it, with the reason."""
    groups: dict[str, list[Hidden]] = {}
    for h in found:
        groups.setdefault(h.behind, []).append(h)
    return [
        (
            tuple(dict.fromkeys(h.effect.partition(":")[0] for h in hidden)),
            f"within its tolerance {behind} takes up what these would make: unseen here, up to "
            + ", ".join(f"{h.size:.1f} noise floors of {h.effect}" for h in hidden),
        )
        for behind, hidden in groups.items()
    ]


def _size(h: Hidden) -> float:
    return h.size


def _without_offset(problem: Problem, d: FloatArray, J: FloatArray) -> FloatArray:
    for k, p in enumerate(problem.parameters):
        if p.name == OFFSET:
            u = J[:, k] / float(np.linalg.norm(J[:, k]))
            return np.asarray(d - u * (u @ d))
    return d


def _cosine(a: FloatArray, b: FloatArray) -> float:
    return float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
