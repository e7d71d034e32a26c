"""Jaw of a da Vinci instrument on a bench: how its recordings are split, what is fitted, what is left over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from math import log, radians
from typing import Final

import numpy as np
import recordings as files

from cablecomp.config import JointConfig, load_joint
from cablecomp.identification.baselines import BASELINES
from cablecomp.identification.path_fit import (
    JOINT,
    MOTOR,
    Channel,
    PathFit,
    Unknown,
    fit_path,
    misfit_of,
)
from cablecomp.identification.path_selection import effect_unknowns, loop_of, stage_unknowns
from cablecomp.identification.transmission_path import (
    SHARE,
    STIFFENING,
    ZERO_EA,
    PathRecording,
    after_first_reversal,
    by_travel,
    with_path_effects,
)
from cablecomp.signal.smoothing import FloatArray, group_means

FOUND: Final = ("routing_friction", "nonlinear_cable", "bearing_friction")
"""What `select_effects` finds missing from Snow's drive."""
SCALE: Final[Mapping[Channel, float]] = {JOINT: radians(0.3), MOTOR: 0.006}
PITCHES: Final = ("Pitch_1", "Pitch_3", "Pitch_5")
LOADS: Final = "01234"
FITTED: Final = "1"
"""Frequency that is fitted (0.2 Hz); judged are all five, 0.1 to 0.5 Hz."""
_PRETENSION: Final = "pretension_N"
_HALF_WAVES: Final = 8


def of_session(session: str) -> list[str]:
    """Recordings of a session ("L_4", "L_2", "Pitch_1"...), as session/number."""
    found = sorted((files.folder("davinci-jaw") / _folder(session)).glob("*.csv.gz"))
    return [f"{session}/{p.name.removesuffix('.csv.gz')}" for p in found]


def straight() -> list[str]:
    """Loads <= 50 % of L_4 and L_2, all frequencies."""
    return [*of_session("L_4"), *of_session("L_2")]


def fitted(names: Sequence[str]) -> list[str]:
    """Those of one frequency."""
    return [n for n in names if n[-2] == FITTED]


def config() -> JointConfig:
    """What is known of the jaw's drive: orders of magnitude."""
    return load_joint(files.CONFIGS / "davinci-jaw.toml")


@cache
def recording(name: str, thin: bool = True) -> PathRecording:
    """One recording from its first reversal on: `thin` for fits (a row per 1.5° of the first swings), else
    50 Hz."""
    session, number = name.split("/")
    columns = files.read(files.folder("davinci-jaw") / _folder(session) / f"{number}.csv.gz")
    if thin:
        columns = by_travel(columns, 20, radians(1.5), swings=4)
    else:
        columns = {k: group_means(v, 20) for k, v in columns.items()}
    own = {f"{_PRETENSION}[{session}]": _PRETENSION}
    return PathRecording(name, session, columns, after_first_reversal(columns), own=own)


def whole(names: Sequence[str]) -> list[PathRecording]:
    """The recordings as they are judged."""
    return [recording(n, thin=False) for n in names]


def fit(names: Sequence[str], effects: Sequence[str] = FOUND, iterations: int = 25) -> PathFit:
    """Drive and effects from the configuration's orders of magnitude, on joint angle and motor torque.

    Every session has a pretension and an encoder zero of its own; the rest is the instrument's. The cable's
    law is EA(T) = EA_0 + b T, so that it stays that cable's when the pretension is another.
    """
    parts = [recording(n) for n in names]
    joint, loop = config(), loop_of(parts)
    stage = joint.drive.stage[0]
    free = {u.name: u for u in stage_unknowns(joint, loop)}
    unknowns = [u for name, u in free.items() if name not in ("EA_N", _PRETENSION)]
    sessions = dict.fromkeys(r.session for r in parts)
    unknowns += [replace(free[_PRETENSION], name=f"{_PRETENSION}[{s}]") for s in sessions]
    if "nonlinear_cable" in effects:
        unknowns.append(Unknown(ZERO_EA, 0.3 * stage.EA_N, 0.003 * stage.EA_N, 30.0 * stage.EA_N, 2.3))
        unknowns.append(Unknown(STIFFENING, 300.0, 3.0, 3e4, 2.3))
    else:
        unknowns.append(free["EA_N"])
    if "routing_friction" in effects:
        unknowns.append(Unknown(SHARE, 0.2, 0.005, 0.95, 2.3))
    given: dict[str, dict[str, float]] = {}
    for effect in effects:
        mine = [u for u in effect_unknowns(effect, joint, loop) if not u.name.endswith("arc_length_m")]
        given[effect] = {u.name.rsplit(".", 1)[1]: u.start for u in mine}
        unknowns += [] if effect == "nonlinear_cable" else mine
    if "bearing_friction" in effects:
        given["bearing_friction"]["load_coefficient"] = 0.0
    if "routing_friction" in effects:
        given["routing_friction"]["arc_length_m"] = 0.2 * stage.free_length_m
    model = with_path_effects(joint, given)
    return fit_path(model, parts, unknowns, scale=SCALE, iterations=iterations, weigh=False)


@cache
def without_load(level: str, effects: tuple[str, ...] = FOUND) -> tuple[PathFit, dict[str, FloatArray]]:
    """Fit without one load, and the misfit of that load's recordings, all frequencies; zeros from the fit."""
    left_out = [n for n in straight() if n[-1] == level]
    found = fit([n for n in fitted(straight()) if n[-1] != level], effects)
    return found, misfit_of(found, whole(left_out))


@cache
def loads_left_out(
    effects: tuple[str, ...] = FOUND, law: bool = False, levels: str = LOADS
) -> dict[str, FloatArray]:
    """Every load of `levels` left out once; with `law`, what the fit leaves of the other loads by motor angle is taken
    off."""
    found: dict[str, FloatArray] = {}
    for level in levels:
        model, misfits = without_load(level, effects)
        if law:
            train = [n for n in fitted(straight()) if n[-1] != level]
            misfits = _less_law(model, train, misfits)
        found |= misfits
    return found


def pitch_split(session: str) -> tuple[list[str], list[str], list[str]]:
    """What is used when a wrist pitch is left out: the two others to learn the drive from, its own lightest
    load to show its pretension, and its other loads to be judged."""
    mine = of_session(session)
    return [n for p in PITCHES if p != session for n in of_session(p)], mine[:1], mine[1:]


@cache
def pitch_left_out(session: str, effects: tuple[str, ...] = FOUND) -> dict[str, FloatArray]:
    """Misfit of a wrist pitch's loads by `pitch_split`; the encoder's zero is the session's.

    The wrist's turn changes the cables' way and so their pretension: that one number is fitted to the
    lightest load, starting from the other pitches' (geometric mean, known within a factor of two).
    """
    others, lightest, judged = pitch_split(session)
    drive = fit(others, effects)
    name, usual = f"{_PRETENSION}[{session}]", _usual_pretension(drive)
    free = Unknown(name, usual, 0.05 * usual, 20.0 * usual, log(2.0))
    parts = [recording(n) for n in lightest]
    again = fit_path(drive.config, parts, [free], fixed=drive.values, scale=SCALE, weigh=False)
    return misfit_of(again, whole(judged), zero="session")


def pitch_unseen(model: PathFit, session: str) -> dict[str, FloatArray]:
    """Misfit of a wrist pitch by a fit that saw no pitch at all; the encoder's zero is the session's, the
    pretension the mean (geometric) of the fitted sessions'."""
    values = {**model.values, f"{_PRETENSION}[{session}]": _usual_pretension(model)}
    return misfit_of(replace(model, values=values), whole(of_session(session)), zero="session")


def baseline(
    kind: str, train: Sequence[str], test: Sequence[str], motor_torque: bool = False
) -> dict[str, FloatArray]:
    """Misfit on `test` of a baseline fitted to `train`: of motor angle and joint torque, as our drive is, or
    of the motor's torque too.

    The encoder's zero is one per session: from the fit, or for a wrist pitch its mean misfit.
    """
    sessions = sorted({n.split("/")[0] for n in train})

    def given(name: str) -> dict[str, FloatArray]:
        r = recording(name, thin=False)
        columns = {k: v[r.counted] for k, v in r.columns.items() if motor_torque or k != MOTOR}
        return {**columns, **{f"other_{s}": np.full(r.rows, float(r.session == s)) for s in sessions[1:]}}

    extra = tuple(f"other_{s}" for s in sessions[1:])
    model = BASELINES[kind]([given(n) for n in train], extra)
    found = {n: given(n)[JOINT] - model.predict(given(n)) for n in test}
    pitched = {n: m for n, m in found.items() if n.startswith("Pitch")}
    if pitched:
        mean = float(np.mean(np.concatenate(list(pitched.values()))))
        found |= {n: m - mean for n, m in pitched.items()}
    return found


def baseline_pitch(kind: str, session: str, motor_torque: bool = False) -> dict[str, FloatArray]:
    """A wrist pitch left out, with the same recordings to learn from."""
    others, lightest, judged = pitch_split(session)
    return baseline(kind, [*others, *lightest], judged, motor_torque)


def baseline_loads(kind: str, motor_torque: bool = False) -> dict[str, FloatArray]:
    """Every load left out once; learnt from all frequencies of the others."""
    found: dict[str, FloatArray] = {}
    for level in LOADS:
        train = [n for n in straight() if n[-1] != level]
        found |= baseline(kind, train, [n for n in straight() if n[-1] == level], motor_torque)
    return found


def _usual_pretension(model: PathFit) -> float:
    """Geometric mean over the sessions of a fit [N]."""
    own = [v for k, v in model.values.items() if k.startswith(f"{_PRETENSION}[")]
    return float(np.exp(np.mean(np.log(own))))


def _less_law(
    model: PathFit, train: Sequence[str], misfits: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Take off a cosine series of the motor's angle over the stroke, per session, fitted to what the model
    leaves of `train`: a law without memory that no effect of the catalogue is."""
    left = misfit_of(model, [recording(n) for n in train])
    weights: dict[str, tuple[FloatArray, float, float]] = {}
    for session in {n.split("/")[0] for n in train}:
        mine = [recording(n) for n in train if n.startswith(f"{session}/")]
        motor = np.concatenate([r.columns["motor_position_rad"][r.counted] for r in mine])
        low, span = float(motor.min()), float(np.ptp(motor))
        series = np.linalg.lstsq(
            _waves(motor, low, span), np.concatenate([left[r.name] for r in mine]), rcond=None
        )[0]
        weights[session] = (series, low, span)
    found = {}
    for name, misfit in misfits.items():
        r = recording(name, thin=False)
        series, low, span = weights[r.session]
        found[name] = misfit - _waves(r.columns["motor_position_rad"][r.counted], low, span) @ series
    return found


def _waves(motor: FloatArray, low: float, span: float) -> FloatArray:
    place = np.clip((motor - low) / span, 0.0, 1.0)
    return np.cos(np.pi * np.outer(place, np.arange(1, _HALF_WAVES + 1)))


def _folder(session: str) -> str:
    return f"Tool_4_Maryland_{session}" if session.startswith("L_") else f"Tool_4_Maryland_L_{session}"
