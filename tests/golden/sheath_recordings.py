"""Surgical manipulator with tendons in a sheath: one drive for all bends of the sheath, and what it leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from math import radians
from typing import Final

import numpy as np
import recordings as files

from cablecomp.config import load_joint
from cablecomp.identification.baselines import BASELINES
from cablecomp.identification.path_fit import JOINT, Channel, PathFit, Unknown, fit_path, misfit_of
from cablecomp.identification.path_selection import stage_unknowns
from cablecomp.identification.transmission_path import BEND, PathRecording, by_travel, with_path_effects
from cablecomp.signal.smoothing import FloatArray

BENDS: Final = (0, 60, 120, 180, 240)
SCALE: Final[Mapping[Channel, float]] = {JOINT: radians(2.0)}
_REST: Final = "effect.gravity_load.phase_rad"


@cache
def recording(bend_deg: int, thin: bool = True) -> PathRecording:
    """One recording, whole: `thin` for fits (a row per 2° of the motor), else 40 Hz.

    The encoder starts every recording at zero wherever friction holds the tip, so each has a zero of its
    own.
    """
    columns = files.read(files.folder("tendon-sheath") / f"sheath_{bend_deg:03d}.csv.gz")
    bend = float(np.median(columns["other_sheath_angle_rad"]))
    kept = {k: columns[k] for k in ("time_s", "motor_position_rad", JOINT)}
    if thin:
        kept = by_travel(kept, 1, radians(2.0))
    name = str(bend_deg)
    return PathRecording(name, name, kept, np.ones(len(kept["time_s"]), dtype=bool), bend)


def fit(bends: Sequence[int], iterations: int = 30) -> PathFit:
    """One drive for all these bends: sheath friction growing with the bend, friction on the drums, a tip
    with friction and a restoring moment."""
    config = load_joint(files.CONFIGS / "tendon-sheath.toml")
    moment = config.drive.stage[0].output_radius_m * config.drive.stage[0].pretension_N
    starts = {
        "effect.routing_friction.mu_angle": 0.3,
        "effect.routing_friction.arc_length_m": 0.05,
        "effect.bearing_friction.torque_Nm": 0.05 * moment,
        "effect.bearing_friction.presliding_rad": 0.1,
        "effect.gravity_load.moment_Nm": 0.2 * moment,
        BEND: 0.15,
    }
    unknowns = [*stage_unknowns(config), *(Unknown(k, v, 1e-3 * v, 20.0 * v, 2.3) for k, v in starts.items())]
    # Started high: from little friction on the drums the fit ends in a shallower valley.
    unknowns += [Unknown(k, 0.5, 0.005, 2.0, 2.3) for k in ("mu_output", "mu_input")]
    unknowns.append(Unknown(_REST, 0.3, -3.0, 3.0, logarithmic=False))
    given: dict[str, dict[str, float]] = {
        "gravity_load": {"phase_rad": 0.0},
        "bearing_friction": {"load_coefficient": 0.0},
    }
    for name, value in starts.items():
        if name != BEND:
            _, effect, parameter = name.split(".")
            given.setdefault(effect, {})[parameter] = value
    joint = with_path_effects(config, given)
    parts = [recording(b) for b in bends]
    return fit_path(joint, parts, unknowns, scale=SCALE, iterations=iterations, weigh=False)


@cache
def all_bends() -> dict[str, FloatArray]:
    """Misfit of one model fitted to all bends."""
    return misfit_of(fit(BENDS), _whole(BENDS), zero="recording")


@cache
def without(bend_deg: int) -> dict[str, FloatArray]:
    """Misfit of one bend by a fit to the others; only the encoder's zero is taken from it."""
    return misfit_of(fit([b for b in BENDS if b != bend_deg]), _whole([bend_deg]), zero="recording")


def bends_left_out(bends: Sequence[int] = BENDS) -> dict[str, FloatArray]:
    """Each of `bends` left out once."""
    found: dict[str, FloatArray] = {}
    for bend in bends:
        found |= without(bend)
    return found


def baseline(kind: str, train: Sequence[int], test: Sequence[int]) -> dict[str, FloatArray]:
    """Misfit of a baseline that sees motor angle and sheath angle, the encoder's zero taken off likewise."""
    columns = {r.name: {**r.columns, "other_bend": np.full(r.rows, r.bend_rad)} for r in _whole(BENDS)}
    extra = ("other_bend",) if len(train) > 1 else ()
    model = BASELINES[kind]([columns[str(b)] for b in train], extra)
    found = {str(b): columns[str(b)][JOINT] - model.predict(columns[str(b)]) for b in test}
    return files.own_zero(found)


def baseline_left_out(kind: str) -> dict[str, FloatArray]:
    """Every bend left out once."""
    found: dict[str, FloatArray] = {}
    for bend in BENDS:
        found |= baseline(kind, [b for b in BENDS if b != bend], [bend])
    return found


def _whole(bends: Sequence[int]) -> list[PathRecording]:
    return [recording(b, thin=False) for b in bends]
