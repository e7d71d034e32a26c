"""Joint fits of calibration and effects: Gauss-Newton with a kept Jacobian, on the rows that a mask leaves.

z holds the calibration coordinates c (in units of their tolerance, prior sd 1) and the coordinates of
the effects. Minimised is sum over training rows of ((measured - predicted)/(sigma f))^2 + sum (c/prior
sd)^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.forms import Form
from cablecomp.errors import InputError
from cablecomp.identification.misfit import Prepared, predicted
from cablecomp.identification.parameters import OFFSET, Parameter, with_values
from cablecomp.signal.smoothing import FloatArray

Mask = np.ndarray[tuple[int], np.dtype[np.bool_]]
DAMPING = (0.0, 0.1, 1.0, 10.0)  # tried in turn until the misfit falls
STALLED = 3e-4  # share of the cost that a step must gain
INFLATION = 3.0  # noise that passes through friction remembers: some ten samples count as one


@dataclass(frozen=True)
class Problem:
    """Recordings to be explained, in weighted form.

    `replicas`: the recordings as they might have been read as well, with other noise on their inputs;
    `own_rad`: what the joint encoder's own noise leaves, RMS of the rows.
    """

    config: JointConfig
    parameters: tuple[Parameter, ...]
    parts: tuple[Prepared, ...]
    measured: FloatArray
    sigma: FloatArray
    replicas: tuple[tuple[Prepared, ...], ...]
    own_rad: float

    @property
    def rows(self) -> int:
        """Number of rows of all recordings together."""
        return len(self.measured)

    def values(self, c: FloatArray) -> dict[str, float]:
        """Calibration values by name."""
        return {p.name: p.value(float(v)) for p, v in zip(self.parameters, c, strict=True)}

    def joint(self, c: FloatArray, entries: Sequence[EffectEntry] = ()) -> JointConfig:
        """The configuration at calibration coordinates c, with these effects beside its own."""
        config = with_values(self.config, self.values(c))
        return config.model_copy(update={"effect": (*config.effect, *entries)}) if entries else config

    def predict(self, config: JointConfig) -> FloatArray:
        """Predicted reading of the joint encoder, all recordings one after the other."""
        offset = config.sensors.joint_position_offset_rad
        return np.concatenate([predicted(config, part)[part.first :] for part in self.parts]) + offset

    def residual(self, config: JointConfig) -> FloatArray:
        """Measured minus predicted, over the noise with its memory: the weighted residual."""
        return (self.measured - self.predict(config)) / (self.sigma * INFLATION)

    def rough(self) -> Problem:
        """The same rows, each simulated in one step: quicker, and good enough to see what is worth a fit."""
        parts = tuple(replace(p, inputs=p.means(), each=1) for p in self.parts)
        return replace(self, parts=parts, replicas=())

    def moved(self, config: JointConfig, count: int | None = None) -> FloatArray:
        """How noise on the inputs moves a prediction (rad), one row for each replica that can be followed."""
        base = self.predict(config)
        found = []
        for parts in self.replicas[:count]:
            try:
                found.append(replace(self, parts=parts).predict(config) - base)
            except InputError:  # noise alone can ask for what an edge-of-slack joint cannot give
                continue
        return np.array(found).reshape(-1, self.rows)

    def noise_rad(self, config: JointConfig, count: int | None = None) -> float:
        """RMS that noise alone leaves of a perfect model: the encoder's own, and what noisy inputs do to the
        prediction (friction rectifies noise, inertia differentiates it: so it is simulated).
        """
        moved = self.moved(config, count)
        return float(np.sqrt(self.own_rad**2 + (np.mean(np.var(moved, axis=1)) if len(moved) else 0.0)))


@dataclass(frozen=True)
class Model:
    """A fitted model: effects with their coordinates, calibration, and the weighted residual of every row.

    `J` is the weighted sensitivity (minus the derivative of the residual) by all coordinates z = [c,
    x_1, x_2, ...].
    """

    forms: tuple[Form, ...]
    c: FloatArray
    x: tuple[FloatArray, ...]
    residual: FloatArray
    J: FloatArray

    @property
    def z(self) -> FloatArray:
        """All coordinates."""
        return np.concatenate([self.c, *self.x])

    def entries(self) -> tuple[EffectEntry, ...]:
        """The effects as configuration entries."""
        return tuple(f.entry(list(x)) for f, x in zip(self.forms, self.x, strict=True))

    @property
    def name(self) -> str:
        """Names of the effects, joined."""
        return "+".join(f.name for f in self.forms) or "calibrated drive"


def evaluate(problem: Problem, forms: Sequence[Form], z: FloatArray) -> FloatArray | None:
    """Weighted residual at z; None where the joint cannot follow."""
    c, xs = split(problem, forms, z)
    entries = [f.entry(list(x)) for f, x in zip(forms, xs, strict=True)]
    try:
        found = problem.residual(problem.joint(c, entries))
    except InputError:
        return None
    return found if np.all(np.isfinite(found)) else None


def seen_by(problem: Problem, model: Model) -> Model | None:
    """The model with its residual as this problem simulates it; None where the joint cannot follow."""
    found = evaluate(problem, model.forms, model.z)
    return None if found is None else replace(model, residual=found)


def split(
    problem: Problem, forms: Sequence[Form], z: FloatArray
) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Calibration and effect coordinates of z."""
    n = len(problem.parameters)
    xs = []
    for form in forms:
        xs.append(z[n : n + form.size])
        n += form.size
    return z[: len(problem.parameters)], tuple(xs)


def bounds_of(problem: Problem, forms: Sequence[Form]) -> tuple[FloatArray, FloatArray]:
    """Bounds of z."""
    low = [np.array([p.low for p in problem.parameters])]
    high = [np.array([p.high for p in problem.parameters])]
    for form in forms:
        a, b = form.bounds()
        low.append(a)
        high.append(b)
    return np.concatenate(low), np.concatenate(high)


def prior_of(problem: Problem, forms: Sequence[Form]) -> FloatArray:
    """Inverse prior variance of z (effects: none)."""
    own = [1.0 / p.prior_sd**2 for p in problem.parameters]
    return np.array(own + [0.0] * sum(f.size for f in forms))


def cost(residual: FloatArray, z: FloatArray, prior: FloatArray, mask: Mask) -> float:
    """What a fit minimises."""
    return float(residual[mask] @ residual[mask] + prior @ z**2)


def sensitivities(problem: Problem, forms: Sequence[Form], z: FloatArray, base: FloatArray) -> FloatArray:
    """J by forward differences (a hundredth of a tolerance, a twentieth of an effect's unit)."""
    J = np.zeros((problem.rows, len(z)))
    _, high = bounds_of(problem, forms)
    n = len(problem.parameters)
    for k in range(len(z)):
        if k < n and problem.parameters[k].name == OFFSET:
            J[:, k] = problem.parameters[k].unit / (problem.sigma * INFLATION)
            continue
        step = 0.01 if k < n else 0.05
        if z[k] + step > high[k]:
            step = -step
        moved = z.copy()
        moved[k] += step
        found = evaluate(problem, forms, moved)
        if found is not None:
            J[:, k] = (base - found) / step
    return J


def solve(
    problem: Problem,
    forms: Sequence[Form],
    z: FloatArray,
    mask: Mask,
    J: FloatArray | None = None,
    residual: FloatArray | None = None,
    iterations: int = 6,
    renew: bool = False,
    firm: float = 1.0,
) -> Model | None:
    """Fit from z on the rows of `mask`; J (by differences if not given) follows by Broyden's rule, and is
    renewed where steps no longer gain, if `renew`. `firm`: weight of the priors, else as stated.

    Returns None if the joint cannot follow the start.
    """
    prior, (low, high) = firm * prior_of(problem, forms), bounds_of(problem, forms)
    z = np.clip(z, low, high)
    r = evaluate(problem, forms, z) if residual is None else residual
    if r is None:
        return None
    now = cost(r, z, prior, mask)
    fresh = J is None
    if J is None:
        J = sensitivities(problem, forms, z, r)
    for _ in range(iterations):
        better = None
        for damping in DAMPING:
            step = bounded_step(J[mask], r[mask], z, prior, low, high, damping)
            trial = np.clip(z + step, low, high)
            found = evaluate(problem, forms, trial)
            moved = trial - z
            if found is None or float(moved @ moved) == 0.0:
                continue
            J = J + np.outer((r - found) - J @ moved, moved) / float(moved @ moved)
            reached = cost(found, trial, prior, mask)
            if reached < now:
                better = (trial, found, reached)
                break
        gain = 0.0 if better is None else now - better[2]
        if better is not None:
            z, r, now = better
        if gain > STALLED * now:
            fresh = False
        elif renew and not fresh:
            J, fresh = sensitivities(problem, forms, z, r), True
        else:
            break
    c, xs = split(problem, forms, z)
    return Model(tuple(forms), c, xs, r, J)


def bounded_step(
    J: FloatArray,
    r: FloatArray,
    z: FloatArray,
    prior: FloatArray,
    low: FloatArray,
    high: FloatArray,
    damping: float = 0.0,
) -> FloatArray:
    """Gauss-Newton step (Levenberg-Marquardt with `damping`) inside the bounds: the least of the quadratic
    model there.
    """
    A = J.T @ J + np.diag(prior)
    g = J.T @ r - prior * z
    scale = np.sqrt(np.maximum(np.diag(A), 1e-12))
    inner = A / np.outer(scale, scale) + (1e-9 + damping) * np.eye(len(z))
    root = np.linalg.cholesky(inner)
    wanted = np.linalg.solve(root, g / scale)
    ends = ((low - z) * scale - 1e-12, (high - z) * scale + 1e-12)
    free = np.linalg.solve(root.T, wanted)
    if np.all(free >= ends[0]) and np.all(free <= ends[1]):
        return np.asarray(free / scale)
    found = lsq_linear(root.T, wanted, bounds=ends, method="bvls")
    return np.asarray(found.x / scale)


def refit(problem: Problem, model: Model, mask: Mask, iterations: int = 4) -> Model:
    """The same model fitted to other rows, starting with the Jacobian it has."""
    found = solve(problem, model.forms, model.z, mask, model.J, model.residual, iterations)
    return model if found is None else found


def rescale(model: Model, forms: Sequence[Form]) -> Model:
    """The model with the forms' units replaced (coordinates follow)."""
    return replace(model, forms=tuple(forms))
