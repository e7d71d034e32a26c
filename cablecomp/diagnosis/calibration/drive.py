"""The drive as it is, calibrated within its tolerances: weights, zeros, where histories are forgotten, what
noise alone leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.config.sessions import ZEROS
from cablecomp.diagnosis.body import read_by_all
from cablecomp.diagnosis.folds import kind_of_parts, shown_apart
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError, SlackError
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, load_channel
from cablecomp.estimation.history import Forgotten, forgotten, full_swing, with_own_carryover
from cablecomp.estimation.least_squares import Fit, refit, rms_left, solve, weighed
from cablecomp.estimation.limits import BY_TAPE, GAIN_OF_TORQUE, ZERO_FAINT, ZERO_OF_TORQUE
from cablecomp.estimation.multi_start import multi_start
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.parameter import DECADE, Parameter, of_drive, own_of, vague_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.estimation.standing import PRETENSION, in_its_place
from cablecomp.estimation.steadying import with_steady_readings
from cablecomp.signal.smoothing import FloatArray, keep_corners

TORQUE_ZERO, TORQUE_GAIN = "joint_torque_offset_Nm", "joint_torque_gain"
REPLICAS = 2
"""Noise replicas of every recording: how far noisy inputs move the prediction is a mean over all rows."""
NO_NOISE = 1e-12
"""Least that noise leaves [rad]: a residual is told in units of it."""
BESIDE = 1e3
"""Times its sigma that a further channel has where the joint's angle is followed first."""
PASSES = 5
"""Times at most that histories are looked for: what is left over tells how faint a carry-over matters, and at first it
holds those."""
NO_LESS = 0.9
"""Share of what was left over (RMS) that is left after another time, from which on that was the last; two there are."""


@dataclass(frozen=True)
class Calibrated:
    """`fit`: the calibrated drive. `nominal`: the drive as configured, evaluated. `lost_rows`: judged rows
    given up to unknown histories. `floor_rad`: RMS that the sensors' noise alone leaves of judged rows, whose readings
    are averaged, `fine_floor_rad`: of fine rows. `floor`: least weights."""

    fit: Fit
    nominal: Fit
    floor: Weighing
    floor_rad: float
    fine_floor_rad: float
    lost_rows: int


def calibrate_drive(
    config: JointConfig, evidence: Sequence[Evidence], rng: np.random.Generator, *, as_stated: bool = False
) -> Calibrated:
    """Calibrate the drive on these recordings; raises InputError where the nominal drive cannot follow one.

    `as_stated`: free lengths and the torque sensor's gain are exact where no tolerance is stated of them, and what
    `[session] own` does not name is one for all sessions."""
    parameters = _parameters(config, evidence, as_stated)
    problem = _followed(Problem(config, parameters, tuple(evidence), first_weights(config, evidence)))
    floor = _floor(evidence, problem.channels)
    fit = _begun(problem, floor)
    before = sum(int(e.counted[JOINT].sum()) for e in evidence)
    for k in range(PASSES):
        left = rms_left(fit)
        evidence = with_steady_readings(fit.problem, fit.x, evidence)
        cut, moved_rad = without_history(fit, evidence)
        floor = _floor(evidence, problem.channels).with_history(moved_rad)
        fit = solve(fit.problem.with_evidence(cut), fit.x, 10)
        fit = refit(fit, weighed(fit, floor), 6)
        if k > 0 and rms_left(fit) > NO_LESS * left:
            break
    floor_rad, fine_floor_rad = noise_floors(fit, rng)
    seen = tuple(replace(e, noise={**e.noise, JOINT: floor_rad}) for e in cut)
    fit = Fit(fit.problem.with_evidence(seen), fit.x, fit.residual, fit.J)
    fit = fit if as_stated else _tightened_anew(fit, floor, floor_rad)
    for _ in range(2):
        fit = refit(with_own_carryover(fit), weighed(fit, floor), 8)
    fit = _drums_exchanged(fit)
    here = fit.problem.start
    nominal = Fit(fit.problem, here, fit.problem.residual(here), fit.problem.jacobian(here))
    lost = before - sum(int(e.counted[JOINT].sum()) for e in cut)
    return Calibrated(fit, nominal, floor, floor_rad, fine_floor_rad, lost)


def _begun(problem: Problem, floor: Weighing) -> Fit:
    """The first fit, each channel then weighed by what is left of it: on all together, or, where that follows the
    joint's angle worse than the nominal drive does, on this first (a torque of the wrong sign was followed by a drive
    that does not turn)."""
    fit = solve(problem, evaluations=15)
    fit = refit(fit, weighed(fit, floor), 10)
    nominal = replace(fit, x=problem.start)
    if len(problem.channels) == 1 or rms_left(fit) <= LIMITS.spoiled * rms_left(nominal):
        return fit
    sigma = {c: s if c == JOINT else BESIDE * s for c, s in problem.weighing.sigma.items()}
    fit = solve(problem.with_weighing(replace(problem.weighing, sigma=sigma)), evaluations=15)
    return refit(fit, weighed(fit, floor), 10)


def _tightened_anew(fit: Fit, floor: Weighing, floor_rad: float) -> Fit:
    """The fit, or that with a pretension of each session's own, where that leaves less by more than chance, and little
    beyond noise: cables that were taken off are never tightened quite alike, and what one pretension leaves of them
    looks like physics.

    Where more is left, something else is missing (cables that creep loosen from session to session, too), and the
    search asks for it beside its effects, if it can (of four and more sessions of one recording each nothing would be
    left to judge it by), as it does for a drive that is known by order of magnitude. Not of an open circuit, whose
    weight or spring is the same."""
    problem = fit.problem
    place = next((k for k, p in enumerate(problem.parameters) if p.name == PRETENSION), None)
    closed = problem.config.drive.circuit == "closed"
    sessions = len(problem.sessions)
    stands = problem.states(PRETENSION) or vague_drive(problem.parameters)
    if place is None or sessions < 2 or not closed or stands:
        return fit
    x = np.concatenate((fit.x[:place], np.full(sessions, fit.x[place]), fit.x[place + 1 :]))
    own = solve(problem.with_own(place), x, 10)
    if 2.0 * (fit.cost - own.cost) <= LIMITS.tightened_anew * (sessions - 1):
        return fit
    own = refit(own, weighed(own, floor), 8)
    asked = len(shown_apart(problem, kind_of_parts(problem))) > 1
    return fit if asked and rms_left(own) >= LIMITS.near_noise * floor_rad else own


def _followed(problem: Problem) -> Problem:
    """The problem, begun where the drive can follow every recording: at the nominal values, or where an open circuit's
    cable slackens at these, at the least pretension within some tolerances at which it does not.

    Raises InputError where there is none: what the drive cannot follow is said, not fitted."""
    sds = {p.name: p.sd for p in problem.parameters if p.base == "pretension_N" and np.isfinite(p.sd)}
    for by in (0.0, *LIMITS.tighter):
        tight = tuple(
            replace(p, start=p.value(p.x(p.start) + by * sds.get(p.name, 0.0))) for p in problem.parameters
        )
        begun = replace(problem, parameters=tight)
        try:
            begun.misfits(begun.start)
        except SlackError as error:
            slack = error
            continue
        return begun
    raise slack


def _drums_exchanged(fit: Fit) -> Fit:
    """The fit, or that begun where the coefficients of a stage's two drums have changed places, if it leaves less.

    Which drum is the rough one is told by little, and a ridge lies between the two answers. Of what is known by orders
    of magnitude the search has starts of its own."""
    place = {p.name: k for k, p in enumerate(fit.problem.parameters) if p.sd < DECADE}
    for name, out in place.items():
        into = place.get(name.replace("mu_output", "mu_input"))
        if into is None or into == out:
            continue
        x = fit.x.copy()
        first, second = fit.problem.parameters[out], fit.problem.parameters[into]
        x[out], x[into] = first.x(second.value(fit.x[into])), second.x(first.value(fit.x[out]))
        fit = min([fit, *multi_start(fit.problem, [x], 15, LIMITS.tolerance)], key=lambda f: f.cost)
    return fit


def without_history(fit: Fit, evidence: Sequence[Evidence]) -> tuple[list[Evidence], float]:
    """The recordings, rows counting from where their histories are forgotten, with their carry-over; and by how much
    that moves a recording's zero [rad]."""
    size = {c: rms_left(fit, c) for c in fit.problem.channels}

    def forgets(e: Evidence) -> Forgotten:
        swing = full_swing(fit.problem, e, LIMITS.history_most)
        return forgotten(fit.problem, fit.x, e, size, LIMITS.history, swing)

    cut, constant = [], []
    for e, found in zip(evidence, in_processes(forgets, evidence), strict=True):
        read = np.flatnonzero(e.counted[JOINT])
        most = int(read[len(read) // 2]) if len(read) else 0  # of an encoder that was read at first only
        counting = e.counting_from(min(found.first, most))
        cut.append(replace(counting, carryover=found.carryover, hidden=found.hidden))
        constant.append(found.constant_rad)
    return cut, float(np.mean(constant))


def _parameters(config: JointConfig, evidence: Sequence[Evidence], as_stated: bool) -> tuple[Parameter, ...]:
    """What `[tolerance]` frees, and what is exact on paper alone; what `[session] own` names is each session's."""
    sessions = tuple(dict.fromkeys(e.session for e in evidence))
    own = [n for n in config.session_own if n not in ZEROS]  # these are found inside of the fit, by session
    usual = {} if as_stated else {**_by_tape(config), **_torque_gain(config, evidence)}
    further = {**usual, **_torque_zero(config, evidence)}
    free = list(of_drive(config, further))
    if len(sessions) > 1:
        first = [next(e for e in evidence if e.session == s) for s in sessions]
        theirs = [of_drive(in_its_place(config, e), further) for e in first]
        for name in own:
            if any(
                e.apart.get(name) != f.apart.get(name)
                for f in first
                for e in evidence
                if e.session == f.session
            ):
                continue  # within a session it follows what the configuration says
            for k in [k for k, p in enumerate(free) if p.name == name]:
                mine = [next(p for p in ps if p.name == name) for ps in theirs]
                free[k : k + 1] = [p for s, m in zip(sessions, mine, strict=True) for p in own_of(m, (s,))]
    return tuple(free)


def own_in_vain(config: JointConfig, fit: Fit) -> tuple[str, ...]:
    """A line for what `[session] own` names of several sessions and nothing frees."""
    free = {*(p.base for p in fit.problem.parameters), *ZEROS, TORQUE_ZERO}
    named = [n for n in config.session_own if n not in free and not config.tolerance.get(n, 0.0) > 0.0]
    return tuple(
        f"[session] own names {n}, of which [tolerance] says nothing: it is taken as exact, and as the same in every "
        f"session; state how well it is known ({n} = 0.05: to 5 %)"
        for n in (named if len(fit.problem.sessions) > 1 else ())
    )


def _by_tape(config: JointConfig) -> dict[str, float]:
    """How well free lengths without a tolerance are known; none where the cable's stiffness, which acts as they do, is
    known by order of magnitude only."""
    stated, stages = config.tolerance, len(config.drive.stage)
    found = {}
    for n in range(1, stages + 1):
        free = any(f"free_length_m{which}" in stated for which in ("", f".{n}"))
        stiffness = max(stated.get(f"EA_N{which}", 0.0) for which in ("", f".{n}"))
        if not free and stiffness < 1.0:
            found["free_length_m" if stages == 1 else f"free_length_m.{n}"] = BY_TAPE
    return found


def _torque_zero(config: JointConfig, evidence: Sequence[Evidence]) -> dict[str, float]:
    """How well the zero of a joint's torque sensor without a tolerance is known [N m], where `[session] own` names it
    and it is read."""
    if TORQUE_ZERO not in config.session_own or TORQUE_ZERO in config.tolerance:
        return {}
    read = [e.columns[c] for e in evidence if (c := load_channel(config, e.columns)) not in (None, MOTOR)]
    largest = max((float(np.max(np.abs(r))) for r in read), default=0.0)
    return {TORQUE_ZERO: ZERO_OF_TORQUE * largest} if largest else {}


def _torque_gain(config: JointConfig, evidence: Sequence[Evidence]) -> dict[str, float]:
    """How well a joint's torque sensor without a tolerance agrees with what else reads force; none where nothing does,
    or where how much the drive yields is known by order of magnitude only."""
    read = {load_channel(config, e.columns) for e in evidence}
    beside = any(c != JOINT for c in read_by_all(config, evidence))
    if TORQUE_GAIN in config.tolerance or read != {"joint_torque_Nm"} or not beside:
        return {}
    return {} if vague_drive(of_drive(config)) else {TORQUE_GAIN: GAIN_OF_TORQUE}


def first_weights(config: JointConfig, evidence: Sequence[Evidence]) -> Weighing:
    """Weights before anything is known: a third of what a straight line by motor angle leaves of each output
    channel on the rows that count."""
    sigma = {}
    for c in read_by_all(config, evidence):
        counts = [(e, e.counted[c]) for e in evidence if e.counted[c].any()]
        y = np.concatenate([e.at_rows(c)[k] - e.at_rows(c)[k].mean() for e, k in counts])
        q = np.concatenate([e.at_rows("motor_position_rad")[k] for e, k in counts])
        A = np.column_stack((np.ones_like(q), q - q.mean()))
        left = y - A @ np.linalg.lstsq(A, y, rcond=None)[0] if c == JOINT else y
        sigma[c] = 0.3 * float(np.std(left)) + 1e-9
    return Weighing(sigma, {c: 0.3 * s for c, s in sigma.items()})


def _floor(evidence: Sequence[Evidence], channels: Sequence[str]) -> Weighing:
    sigma = {c: max(float(np.mean([e.noise_at_rows(c) for e in evidence])), 1e-9) for c in channels}
    return Weighing(sigma, {c: ZERO_FAINT * s for c, s in sigma.items()})


def noise_floors(fit: Fit, rng: np.random.Generator) -> tuple[float, float]:
    """RMS [rad] that noise alone leaves of a judged row and of a fine one: the joint encoder's own, and what noisy
    inputs do to the prediction (friction remembers noise: so it is simulated, noise put on the cleaned inputs and
    cleaned off again)."""
    problem = fit.problem
    moved = []
    base = problem.misfits(fit.x)[JOINT]
    for _ in range(REPLICAS):
        try:
            other = problem.with_evidence([_noise_replica(e, rng) for e in problem.evidence]).misfits(fit.x)[
                JOINT
            ]
        except InputError:
            continue
        moved += [np.std(a - b) ** 2 for a, b in zip(base, other, strict=True)]
    by_inputs = float(np.mean(moved)) if moved else 0.0
    judged = np.mean([e.noise_at_rows(JOINT) ** 2 for e in problem.evidence])
    fine = np.mean([e.noise_of_fine(JOINT) ** 2 for e in problem.evidence])
    # of readings without any noise: as good as none
    return float(np.sqrt(judged + by_inputs + NO_NOISE**2)), float(np.sqrt(fine + by_inputs + NO_NOISE**2))


def _noise_replica(e: Evidence, rng: np.random.Generator) -> Evidence:
    columns = dict(e.columns)
    for name in ("motor_position_rad", "joint_torque_Nm", MOTOR):
        sigma = e.noise.get(name, 0.0) / np.sqrt(e.group)
        if name in columns and sigma > 0.0 and name not in e.counted:
            noisy: FloatArray = columns[name] + sigma * rng.standard_normal(len(columns[name]))
            columns[name] = keep_corners(columns["time_s"], noisy, sigma)
    return replace(e, columns=columns)
