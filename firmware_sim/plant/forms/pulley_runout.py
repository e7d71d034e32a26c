"""A pulley out of true in other forms: oval, the input pulley, an encoder off its centre, an idler."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import MOTOR_ANGLE, Q_OUT, RELEASED_H
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import Floats

_ECCENTRIC = Parameter("eccentricity_m", "e", low=-0.01, high=0.01, neutral=0.0)
_PHASE = Parameter("phase_rad", "φ", 0.0)


def _oval(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        if c["shaft_out"] == build.output:
            c["runout_m"], c["runout_phase"], c["runout_order"] = p["eccentricity_m"], p["phase_rad"], 2.0


OVAL = form(
    "pulley_runout",
    "oval",
    "The output pulley is oval: it winds R q + e (sin(2q + φ) − sin φ), with that lever arm.",
    (_ECCENTRIC, _PHASE),
    ("joint_angle", "motor_angle"),
    _oval,
)


def _input(build: Build, p: Mapping[str, float]) -> None:
    for c in build.cables:
        if c["shaft_in"] == 0:
            c["in_runout_m"], c["in_runout_phase"] = p["eccentricity_m"], p["phase_rad"]


INPUT_PULLEY = form(
    "pulley_runout",
    "input_pulley",
    "The input pulley runs out of true: it winds r q + e (sin(q + φ) − sin φ).",
    (_ECCENTRIC, _PHASE),
    ("motor_angle", "joint_angle"),
    _input,
)


def _encoder(build: Build, p: Mapping[str, float]) -> None:
    def read(inputs: Floats, outputs: Floats) -> None:
        q = outputs[:, Q_OUT]
        wave = np.sin(q + p["phase_rad"]) + p["second"] * np.sin(2.0 * q + p["second_phase_rad"])
        outputs[:, Q_OUT] = q + p["amplitude_rad"] * wave

    build.encoders.append(read)


ENCODER = form(
    "pulley_runout",
    "encoder_disc",
    "The joint encoder's disc sits off centre and out of flat: + a (sin(q + φ) + s sin(2q + ψ)).",
    (
        Parameter("amplitude_rad", "a", low=-0.5, high=0.5, neutral=0.0),
        _PHASE,
        Parameter("second", "s", 0.3, -1.0, 1.0),
        Parameter("second_phase_rad", "ψ", 0.0),
    ),
    ("joint_angle", "motor_angle"),
    _encoder,
)


def _idler(build: Build, p: Mapping[str, float]) -> None:
    passes = build.config.ratio * build.stages[-1].output_radius_m  # m of cable per rad of the motor

    def fill(inputs: Floats) -> None:
        turned = passes / p["idler_radius_m"] * inputs[:, MOTOR_ANGLE] + p["phase_rad"]
        inputs[:, RELEASED_H] -= p["eccentricity_m"] * (np.sin(turned) - np.sin(p["phase_rad"]))

    build.schedules.append(fill)


IDLER = form(
    "pulley_runout",
    "idler",
    "An idler in the path of cable h runs out of true: that path is longer by e (sin(r q_in/r_i + φ) − sin φ), r_i the "
    "idler's radius.",
    (_ECCENTRIC, _PHASE, Parameter("idler_radius_m", "r_i", 0.02, 1e-4)),
    ("motor_angle", "joint_angle"),
    _idler,
)

KINDS: tuple[EffectKind, ...] = (OVAL, INPUT_PULLEY, ENCODER, IDLER)
