"""Calibration of the nominal drive: what is only nominally known, fitted to recordings within its tolerance.

A value that the recordings do not tell, or that ended on its bound, is never given out as known: it keeps what was
nominal, and its tolerance, and it is said why and which motion would tell it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import hypot, inf
from pathlib import Path
from time import monotonic

import numpy as np

from cablecomp.config import JointConfig, claiming
from cablecomp.config.sessions import ZEROS
from cablecomp.diagnosis.answer.augmented import augmented_joint, with_tolerances
from cablecomp.diagnosis.answer.notes import SAID
from cablecomp.diagnosis.answer.values import drive_values
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body
from cablecomp.diagnosis.calibration.counts import count_rad
from cablecomp.diagnosis.calibration.drive import Calibrated, calibrate_drive, own_in_vain
from cablecomp.diagnosis.calibration.every_sample import by_wide_steps, on_every_sample
from cablecomp.diagnosis.calibration.motion import Advice, what_would_tell
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.pace import Pace, Progress
from cablecomp.diagnosis.result import Value
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, load_channel, noise_mean
from cablecomp.estimation.least_squares import Fit, covariance, refit, rms_left, solve
from cablecomp.estimation.parallel import algebra_in_one_thread
from cablecomp.estimation.parameter import Parameter
from cablecomp.estimation.standing import value_of

LOAD_BY_MOTOR = 0.05
"""Share to which a load read off the motor's torque is trusted: its gear and bearings take a few per cent."""
MOVED = 0.05
"""Share by which a value of a session changes without being said."""
OUT_OF_TIME = "the {:g} s were over before all steps were done: values are the best so far, less sure"


@dataclass(frozen=True)
class Kept:
    """A value that stays nominal: `why`, and what would tell it (None: no motion within the limits). Its tolerance, and
    the sd that it would be told to, are a `share` of it or in its unit, as those of `[tolerance]` are."""

    name: str
    nominal: float
    tolerance: float
    why: str
    advice: Advice | None
    share: bool = True


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


@algebra_in_one_thread
def calibrate(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    seed: int = 0,
    sessions: Sessions | None = None,
    progress: Progress = lambda what, share: None,
    budget_s: float = inf,
) -> Calibration:
    """Fit what `[tolerance]` frees, and the zeros, to all rows of the recordings (name or path -> canonical channels).

    After `budget_s` no further step begins: the best so far is given, and a warning says what it lacks.

    Raises InputError for recordings that lack a channel or that the nominal joint cannot follow.
    """
    pace = Pace(progress, monotonic() + budget_s)
    pace.tell("cleaning the recordings", 0.0)
    body = gather_body(config, recordings, sessions)
    pace.tell("a quick fit on thinned rows", 0.1)
    drive = calibrate_drive(config, _everything(body), np.random.default_rng(seed), as_stated=True)
    pace.tell("the fit on every sample", 0.3)
    fit = on_every_sample(drive, recordings, pace)
    cut = (OUT_OF_TIME.format(budget_s),) if pace.over else ()
    pace.tell("what could not be told", 0.9)
    unknown = _not_told(fit)
    spread, tied = _spread(fit), _tied(fit)
    fit = _without(fit, tuple(unknown))
    joint = augmented_joint(config, Model((), fit, fit.residual), ())
    return Calibration(
        with_tolerances(joint, fit, spread),
        tuple(_as_wide(v, fit, spread) for v in drive_values(fit, config)),
        tuple(_kept(drive, name, why) for name, why in unknown.items()),
        tied,
        rms_left(fit),
        rms_left(replace(fit, x=fit.problem.start)),
        noise_mean(fit.problem.evidence, JOINT),
        (*cut, *_warnings(drive, fit, recordings), *_gone_along(config, joint, recordings)),
        fit,
    )


def _gone_along(config: JointConfig, joint: JointConfig, recordings: Iterable[str]) -> Iterator[str]:
    """A line for each parameter that stated sessions have as their own, where those that none of the recordings is of
    went along with the joint's."""
    now = {s.name: s.values for s in joint.sessions}
    claimed = {s.name for r in recordings for s in claiming(config, Path(r))}
    others = [s for s in config.sessions if s.name in now and s.name not in claimed]
    for name in dict.fromkeys(n for s in config.sessions for n in s.values if n not in ZEROS):
        was, new = value_of(config, name), value_of(joint, name)
        pairs = [(s.name, s.values.get(name, was), now[s.name].get(name, new)) for s in others]
        moved = [f"`{n}` {a:.4g} -> {b:.4g}" for n, a, b in pairs if abs(b - a) > MOVED * abs(a)]
        if moved:
            more = f" and {len(moved) - SAID} more" if len(moved) > SAID else ""
            yield (
                f"{name} of sessions that these recordings are not of went along: {', '.join(moved[:SAID])}{more}; if "
                "it changed in this mounting alone, keep the old file for those, or calibrate all in one call"
            )


def _everything(body: Body) -> list[Evidence]:
    """All rows: a calibration keeps none for the end."""
    if body.final_by != "block":
        return [*body.used, *body.final]
    return [
        replace(u, counted={k: v | f.counted[k] for k, v in u.counted.items()})
        for u, f in zip(body.used, body.final, strict=True)
    ]


def _spread(fit: Fit) -> dict[str, float]:
    """1-sigma of every parameter's coordinate, all others free: what is not told later on widens the rest as well."""
    sd = np.sqrt(np.diag(covariance(fit))).tolist()
    found = {p.name: s for p, s in zip(fit.problem.parameters, sd, strict=True)}
    if not _by_motor(fit):
        return found
    return {
        p.name: _beside_the_motors(p, x, found[p.name])
        for p, x in zip(fit.problem.parameters, fit.x.tolist(), strict=True)
    }


def _by_motor(fit: Fit) -> bool:
    return any(load_channel(fit.problem.config, e.columns) == MOTOR for e in fit.problem.evidence)


def _beside_the_motors(p: Parameter, x: float, sd: float) -> float:
    """1-sigma with the load read off the motor's torque, in which its own friction stands and does what the cable's and
    the pretension do: these are known no better than before, nor than by how much they moved."""
    key = p.base.partition(".")[0]
    if key.endswith("_radius_m"):
        return sd
    if key == "EA_N":
        return hypot(sd, LOAD_BY_MOTOR)
    return max(sd, p.sd, abs(x - p.centre_x))


def _as_wide(value: Value, fit: Fit, spread: Mapping[str, float]) -> Value:
    """The value with the sd that it had while all others were free."""
    for p, x in zip(fit.problem.parameters, fit.x, strict=True):
        if p.name == value.name:
            return replace(value, sd=spread[p.name] * abs(p.slope(float(x))))
    return value


def _not_told(fit: Fit) -> dict[str, str]:
    """Parameters of which the recordings say nothing to be relied on, each with the reason."""
    found = {}
    sd = np.sqrt(np.diag(covariance(fit)))
    bounded = fit.at_bound()
    for p, s in zip(fit.problem.parameters, sd, strict=True):
        if p.name in bounded:
            found[p.name] = "the fit ended on its bound: what it would make up for is not its doing"
        elif s > LIMITS.untold * p.sd:
            found[p.name] = "these recordings tell nothing of it"
    return found


def _without(fit: Fit, names: tuple[str, ...]) -> Fit:
    """The fit of the others, these at their nominal values."""
    if not names:
        return fit
    kept = [k for k, p in enumerate(fit.problem.parameters) if p.name not in names]
    problem = replace(fit.problem, parameters=tuple(fit.problem.parameters[k] for k in kept))
    return by_wide_steps(refit(solve(problem, fit.x[kept], 6), fit.problem.weighing, 4))


def _kept(drive: Calibrated, name: str, why: str) -> Kept:
    p = next(p for p in drive.fit.problem.parameters if p.name == name)
    advice = what_would_tell(drive.fit.problem.config, p, drive.floor_rad)
    unit = 1.0 if p.log else p.scale
    advice = None if advice is None else replace(advice, sd=unit * advice.sd)
    return Kept(name, p.start, unit * p.sd, why, advice, p.log)


def _tied(fit: Fit) -> tuple[tuple[str, str, float], ...]:
    cov = covariance(fit)
    sd = np.sqrt(np.diag(cov))
    names = [p.name for p in fit.problem.parameters]
    found = []
    for i in range(len(names)):
        for k in range(i):
            together = float(sd[i] * sd[k])
            if together > 0.0 and abs(cov[i, k]) > LIMITS.tied * together:
                found.append((names[k], names[i], float(cov[i, k]) / together))
    return tuple(found)


def _warnings(drive: Calibrated, fit: Fit, recordings: Mapping[str, Columns]) -> tuple[str, ...]:
    found = [*own_in_vain(fit.problem.config, drive.fit)]
    if drive.lost_rows:
        total = drive.lost_rows + sum(int(e.counted[JOINT].sum()) for e in drive.fit.problem.evidence)
        found.append(
            f"{100 * drive.lost_rows / total:.0f} % of the rows were given up to the history before the first sample"
        )
    count = max(count_rad(c) for c in recordings.values()) * fit.problem.config.drive.ratio
    if count > noise_mean(fit.problem.evidence, JOINT):
        found.append(
            f"one count of the motor encoder turns the joint by {1e6 * count:.2g} "
            f"urad, more than the joint encoder's noise: "
            "a motor that hunts within a count shakes friction loose unseen; "
            "mu_input is what acts then, not the material's"
        )
    if _by_motor(fit):
        found.append(
            "the load is read off the motor's torque, in which the motor's own friction and inertia stand: friction "
            "and pretension are what acts with both, and their intervals as wide as before; calibrate with the joint's "
            "torque measured"
        )
    if rms_left(fit) > 2.0 * noise_mean(fit.problem.evidence, JOINT):
        found.append(
            "more than noise is left, and intervals know only of what the model has: `cablecomp diagnose` says what it "
            "lacks"
        )
    return tuple(found)
