"""Calibration of the nominal drive: what is only nominally known, fitted to recordings within its tolerance.

A value that the recordings do not tell, or that ended on its bound, is never given out as known: it keeps what was
nominal, and its tolerance, and it is said why and which motion would tell it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.augmented import augmented_joint
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body
from cablecomp.diagnosis.calibration import Calibrated, calibrate_drive
from cablecomp.diagnosis.every_sample import on_every_sample
from cablecomp.diagnosis.explain.selection import Model
from cablecomp.diagnosis.motion import Advice, what_would_tell
from cablecomp.diagnosis.result import Value
from cablecomp.diagnosis.values import drive_values
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, covariance, refit, rms_left, solve
from cablecomp.estimation.limits import EXACT

UNTOLD = 0.9
"""Share of its prior's sd from which a parameter's own sd says that the recordings told nothing of it."""
TIED = 0.9
"""Correlation from which on two values are said to be known only together."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Kept:
    """A value that stays nominal: `why`, and what would tell it (None: no motion within the limits)."""

    name: str
    nominal: float
    tolerance: float
    why: str
    advice: Advice | None


@dataclass(frozen=True)
class Calibration:
    """`config`: the configuration with the values that are known now, their tolerances and zeros; `values`: those, each
    with its sd and what was nominal; `kept`: what stays nominal; `tied`: pairs of values known only together, with
    their correlation; `rmse_rad`, `nominal_rmse_rad`: what is left of all samples with them and with the nominal ones,
    zeros taken off; `noise_rad`: the joint encoder's own noise; `warnings`: one line each."""

    config: JointConfig
    values: tuple[Value, ...]
    kept: tuple[Kept, ...]
    tied: tuple[tuple[str, str, float], ...]
    rmse_rad: float
    nominal_rmse_rad: float
    noise_rad: float
    warnings: tuple[str, ...]
    fit: Fit

    def __getitem__(self, name: str) -> Value:
        """The value of that name."""
        return next(v for v in self.values if v.name == name)


def calibrate(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    seed: int = 0,
    sessions: Sessions | None = None,
    progress: Progress = lambda what, share: None,
) -> Calibration:
    """Fit what `[tolerance]` frees, and the zeros, to all rows of the recordings (name or path -> canonical channels).

    Raises InputError for recordings that lack a channel or that the nominal joint cannot follow.
    """
    progress("cleaning the recordings", 0.0)
    body = gather_body(config, recordings, sessions)
    progress("a quick fit on thinned rows", 0.1)
    drive = calibrate_drive(config, _everything(body), np.random.default_rng(seed))
    progress("the fit on every sample", 0.3)
    fit = on_every_sample(drive, recordings)
    progress("what could not be told", 0.9)
    unknown = _not_told(fit)
    fit = _without(fit, tuple(unknown))
    joint = augmented_joint(config, Model((), fit, fit.residual), (), body.names)
    at_nominal = fit.problem.start if not unknown else _nominal(fit)
    return Calibration(
        _with_tolerances(joint, fit),
        drive_values(fit, config),
        tuple(_kept(drive, name, why) for name, why in unknown.items()),
        _tied(fit),
        rms_left(fit),
        rms_left(replace(fit, x=at_nominal)),
        float(np.mean([e.noise[JOINT] for e in fit.problem.evidence])),
        _warnings(drive, fit),
        fit,
    )


def _everything(body: Body) -> list[Evidence]:
    """All rows: a calibration keeps none for the end."""
    if body.final_by != "block":
        return [*body.used, *body.final]
    return [
        replace(u, counted={k: v | f.counted[k] for k, v in u.counted.items()})
        for u, f in zip(body.used, body.final, strict=True)
    ]


def _nominal(fit: Fit) -> np.ndarray:
    return fit.problem.start


def _not_told(fit: Fit) -> dict[str, str]:
    """Parameters of which the recordings say nothing to be relied on, each with the reason."""
    found = {}
    sd = np.sqrt(np.diag(covariance(fit)))
    bounded = fit.at_bound()
    for p, s in zip(fit.problem.parameters, sd, strict=True):
        if p.name in bounded:
            found[p.name] = "the fit ended on its bound: what it would make up for is not its doing"
        elif s > UNTOLD * p.sd:
            found[p.name] = "these recordings tell nothing of it"
    return found


def _without(fit: Fit, names: tuple[str, ...]) -> Fit:
    """The fit of the others, these at their nominal values."""
    if not names:
        return fit
    kept = [k for k, p in enumerate(fit.problem.parameters) if p.name not in names]
    problem = replace(fit.problem, parameters=tuple(fit.problem.parameters[k] for k in kept))
    return refit(solve(problem, fit.x[kept], 6), fit.problem.weighing, 4)


def _kept(drive: Calibrated, name: str, why: str) -> Kept:
    p = next(p for p in drive.fit.problem.parameters if p.name == name)
    advice = what_would_tell(drive.fit.problem.config, p, drive.floor_rad)
    return Kept(name, p.start, p.sd, why, advice)


def _tied(fit: Fit) -> tuple[tuple[str, str, float], ...]:
    cov = covariance(fit)
    sd = np.sqrt(np.diag(cov))
    names = [p.name for p in fit.problem.parameters]
    found = []
    for i in range(len(names)):
        for k in range(i):
            correlation = float(cov[i, k] / (sd[i] * sd[k]))
            if abs(correlation) > TIED:
                found.append((names[k], names[i], correlation))
    return tuple(found)


def _with_tolerances(joint: JointConfig, fit: Fit) -> JointConfig:
    """Tolerances of what is known now: what the fit leaves, never less than what a drawing does."""
    tolerance = dict(joint.tolerance)
    sd = np.sqrt(np.diag(covariance(fit)))
    for p, s in zip(fit.problem.parameters, sd, strict=True):
        if p.name in tolerance:
            tolerance[p.name] = float(f"{max(float(s), EXACT if p.log else 0.0):.2g}")
    return joint.model_copy(update={"tolerance": tolerance})


def _warnings(drive: Calibrated, fit: Fit) -> tuple[str, ...]:
    found = []
    if drive.lost_rows:
        total = drive.lost_rows + sum(int(e.counted[JOINT].sum()) for e in drive.fit.problem.evidence)
        found.append(
            f"{100 * drive.lost_rows / total:.0f} % of the rows were given up to the history before the first sample"
        )
    if rms_left(fit) > 2.0 * float(np.mean([e.noise[JOINT] for e in fit.problem.evidence])):
        found.append("more than noise is left: `cablecomp diagnose` says what the model lacks")
    return tuple(found)
