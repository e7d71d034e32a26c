"""What the drive's own memory makes of a law that changes along a covariate: columns out of the kernel.

A law of the drive that changes along the load, an angle or a speed leaves a residual that remembers: no curve over
that covariate fits it. So the kernel runs the calibrated drive again with each such change in small: friction by
tension and by place as hat functions, stiffness by tension, friction that grows with slip speed, cable that follows
through a play. It says along what a law changes, and not which law it is. What changes slowly (with time,
temperature, a neighbour) acts as the drive's sensitivities at that moment do (`views.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.locate.views import Response, Responses
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import INPUT, JOINT
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.simulate import Simulator, simulator
from cablecomp.estimation.steadying import on_every_row
from cablecomp.mechanics.change import Change, Factor
from cablecomp.signal.smoothing import FloatArray

_SMALL: Final = 0.3
"""By how much of itself friction changes at the top of a hat."""
_BY_TENSION: Final = 5
"""Hat functions of ln(T/T0)."""
_BY_PLACE: Final = 8
"""Hat functions of an angle, for either drum."""
_STIFFENING: Final = 0.2
"""b of EA (1 + b (T/T0 - 1)): small enough that twice as much does twice as much."""
_SLIP: Final = (1e-4, 1e-3, 1e-2, 1e-1)
"""Friction by slip speed, over EA/R (N s/m per rad): from slip over in a moment to slip that hardly ends."""
_PLAYS: Final = (0.05, 0.15, 0.4)
"""Half widths of the play, over T0."""
_PLAY_SHARE: Final = 0.2
"""Share of the free cable's compliance that follows through the play."""
_DRIVE: Final = {
    "EA_N": "stiffness",
    "pretension_N": "pretension",
    "mu_output": "friction on the joint's drum",
    "mu_input": "friction on the motor's drum",
}
"""Parameters of the drive whose sensitivities say what a slow change of it does, in words."""


class Place(NamedTuple):
    """A change of the drive, and the covariate that it goes along."""

    covariate: str
    how: str
    changes: tuple[Change, ...]


def every_row(fit: Fit) -> Fit:
    """The fit, not made again, on all fine rows of its recordings: what rests while nothing travels is seen too."""
    problem = _about_every_row(fit.problem)
    residual = problem.residual(fit.x)
    return Fit(problem, fit.x, residual, problem.jacobian(fit.x, residual))


def left_on_every_row(fit: Fit) -> list[FloatArray]:
    """What a fit leaves of the joint's angle [rad] on all fine rows, recording after recording."""
    return _about_every_row(fit.problem).left(fit.x)


def responses(fit: Fit) -> Responses:
    """What changes of the drive along covariates make of the joint's angle [rad], on counted rows of the fit."""
    problem = fit.problem
    plain = _run(problem, fit.x, None)
    if plain is None:
        return Responses((), ())
    reach = _reach(problem, fit.x, plain)
    here = _counted(problem, plain)

    def column(change: Change) -> FloatArray | None:
        there = _run(problem, fit.x, change)
        return None if there is None else _counted(problem, there) - here

    places = list(_places(problem.joint(fit.x, problem.evidence[0]), reach))
    asked = [(place, change) for place in places for change in place.changes]
    made = in_processes(lambda a: column(a[1]), asked)
    found = []
    for place in places:
        columns = [c for (at, _), c in zip(asked, made, strict=True) if at is place and c is not None]
        if columns:
            found.append(Response(place.covariate, place.how, np.column_stack(columns)))
    return Responses(tuple(found), _slow(fit))


def _slow(fit: Fit) -> tuple[tuple[str, FloatArray], ...]:
    """Sensitivities of the joint's rows to each parameter of the drive, in words, the sessions' own ones together."""
    problem = fit.problem
    count = len(problem.owners(JOINT))
    bases = [p.name.partition("@")[0] for p in problem.parameters]
    return tuple(
        (words, fit.J[:count, [b == name for b in bases]].sum(axis=1))
        for name, words in _DRIVE.items()
        if name in bases
    )


def _about_every_row(problem: Problem) -> Problem:
    return problem.with_evidence([on_every_row(e) for e in problem.evidence])


def _run(problem: Problem, x: FloatArray, change: Change | None) -> list[Any] | None:
    """The kernel's answers on all rows with this change beside the joint's own; None where the drive cannot follow."""
    drives: dict[Any, Simulator] = {}
    answers = []
    try:
        for e in problem.evidence:
            key = problem.stand_key(e)
            if key not in drives:
                drives[key] = simulator(problem.joint(x, e), beside=change)
            answers.append(drives[key].run(e, e.rows))
    except InputError:
        return None
    return answers


def _counted(problem: Problem, answers: Sequence[Any]) -> FloatArray:
    """The joint's angle [rad] on counted rows, recording after recording."""
    return np.concatenate([
        a.joint[e.counted[JOINT]] for e, a in zip(problem.evidence, answers, strict=True)
    ])  # fmt: skip


class Reach(NamedTuple):
    """Where the drive has been: ln(T/T0) of its cables, angles of joint and motor [rad]."""

    tension: tuple[float, float]
    joint: tuple[float, float]
    motor: tuple[float, float]


def _reach(problem: Problem, x: FloatArray, answers: Sequence[Any]) -> Reach:
    low, high = 1.0, 1.0
    for e, a in zip(problem.evidence, answers, strict=True):
        pretension = problem.joint(x, e).drive.stage[-1].pretension_N
        for tension in (a.tension_h, a.tension_l):
            over = tension[tension > 0.0] / pretension
            low, high = min(low, float(over.min(initial=1.0))), max(high, float(over.max(initial=1.0)))
    joint, motor = (np.concatenate([e.columns[k] for e in problem.evidence]) for k in (JOINT, INPUT))
    return Reach(
        (float(np.log(max(low, 0.05))), float(np.log(high))),
        (float(joint.min()), float(joint.max())),
        (float(motor.min()), float(motor.max())),
    )


def _places(joint: JointConfig, reach: Reach) -> Iterator[Place]:
    stage = joint.drive.stage[-1]
    by_tension = _hats(reach.tension, _BY_TENSION)
    yield Place(
        "load",
        "friction changes with the tension",
        tuple(Change(tension_factor=_of_log(f)) for f in by_tension),
    )
    yield Place("load", "stiffness changes with the tension", (Change(stiffening=_STIFFENING),))
    yield Place(
        "joint_angle",
        "friction changes along the joint's drum",
        tuple(Change(joint_angle_factor=f) for f in _hats(reach.joint, _BY_PLACE)),
    )
    yield Place(
        "motor_angle",
        "friction changes along the motor's drum",
        tuple(Change(motor_angle_factor=f) for f in _hats(reach.motor, _BY_PLACE)),
    )
    for slip in _SLIP:
        change = Change(viscous_Ns_per_m_rad=slip * stage.EA_N / stage.output_radius_m)
        yield Place("load_rate", "friction changes with the speed of slip", (change,))
    yield Place(
        "reversal",
        "cable between the drums follows through a play",
        tuple(Change(play_share=_PLAY_SHARE, play_yield_N=p * stage.pretension_N) for p in _PLAYS),
    )


def _of_log(factor: Factor) -> Factor:
    return lambda tau: factor(np.log(tau))


def _hats(ends: tuple[float, float], count: int) -> list[Factor]:
    """1 plus a small hat function at each of so many places between the ends."""
    places = np.linspace(*ends, count)

    def hat(k: int) -> Factor:
        tops = np.zeros(count)
        tops[k] = _SMALL
        return lambda x: np.asarray(1.0 + np.interp(x, places, tops), dtype=np.float64)

    return [hat(k) for k in range(count)]
