"""Series compliance in other forms: a coupling that stiffens, one that softens, one of two stages, a diaphragm,
one that is softer one way, one of rubber, a bushing that creeps over decades of time, a bracket that is softer one way
up than the other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import PATH, PULLEY, Q_OUT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import low_passed
from firmware_sim.plant.records import Floats

_SOFT = Parameter("compliance_rad_per_Nm", "c", low=0.0, neutral=0.0)


def _stiffening(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        knee = p["knee_Nm"]
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * knee * np.arcsinh(outputs[:, PATH] / knee)

    build.mounts.append(yields)


STIFFENING = form(
    "series_compliance",
    "stiffening",
    "A coupling that stiffens as it is loaded: + c M_k arsinh(M/M_k), whose slope falls from c on.",
    (_SOFT, Parameter("knee_Nm", "M_k", low=1e-9)),
    ("load",),
    _stiffening,
)


def _softening(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        path = outputs[:, PATH]
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * path * (1.0 + np.abs(path) / p["knee_Nm"])

    build.mounts.append(yields)


SOFTENING = form(
    "series_compliance",
    "softening",
    "A clamped seat that opens as it is loaded: + c M (1 + |M|/M_k), ever softer.",
    (_SOFT, Parameter("knee_Nm", "M_k", low=1e-9)),
    ("load",),
    _softening,
)


def _staged(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        path = outputs[:, PATH]
        beyond = path - np.clip(path, -p["knee_Nm"], p["knee_Nm"])
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * (path + (p["beyond"] - 1.0) * beyond)

    build.mounts.append(yields)


STAGED = form(
    "series_compliance",
    "staged",
    "A coupling of two stages: + c M up to |M| = M_k, and b c per moment beyond it (b < 1: lobes that close, b > 1: a "
    "seat that gapes).",
    (_SOFT, Parameter("knee_Nm", "M_k", low=1e-9), Parameter("beyond", "b", 3.0, 0.0)),
    ("load",),
    _staged,
)


def _diaphragm(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        way, slope = p["compliance_rad_per_Nm"] * p["knee_Nm"], 1.5 * np.sqrt(3.0)
        third = np.sinh(np.arcsinh(slope * outputs[:, PATH] / p["knee_Nm"]) / 3.0)
        outputs[:, Q_OUT] += 3.0 / slope * way * third

    build.mounts.append(yields)


DIAPHRAGM = form(
    "series_compliance",
    "diaphragm",
    "A diaphragm or disc coupling (Duffing's spring): + u with M = (u/c) (1 + (u/(c M_k))²), bent at first and "
    "stretched the more it turns.",
    (_SOFT, Parameter("knee_Nm", "M_k", low=1e-9)),
    ("load",),
    _diaphragm,
)


def _one_way(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        path = outputs[:, PATH]
        soft = np.where(path > 0.0, 1.0 + p["skew"], 1.0 - p["skew"])
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * soft * path

    build.mounts.append(yields)


ONE_WAY = form(
    "series_compliance",
    "one_way",
    "A mount that rests on a stop one way: + c (1 + s) M for M > 0, c (1 − s) M for M < 0.",
    (_SOFT, Parameter("skew", "s", 0.5, -1.0, 1.0)),
    ("load",),
    _one_way,
)


def _late(build: Build, p: Mapping[str, float], *times: float) -> None:
    """A share gives way late, in equal parts with these many times the lag."""

    def yields(inputs: Floats, outputs: Floats) -> None:
        path, time = outputs[:, PATH], inputs[:, TIME]
        slow = np.mean([low_passed(path, time, k * p["lag_s"]) for k in times], axis=0)
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * ((1.0 - p["share"]) * path + p["share"] * slow)

    build.mounts.append(yields)


def _rubber(build: Build, p: Mapping[str, float]) -> None:
    _late(build, p, 1.0)


RUBBER = form(
    "series_compliance",
    "rubber",
    "A coupling of rubber: part of it gives way at once, + c (1 − s) M, the rest in its own time, "
    "+ c s y with t_l ẏ = M − y.",
    (
        _SOFT,
        Parameter("share", "s, of what gives way late", 0.4, 0.0, 1.0),
        Parameter("lag_s", "t_l", 0.3, 0.0),
    ),
    ("load", "load_rate"),
    _rubber,
)


def _bushing(build: Build, p: Mapping[str, float]) -> None:
    _late(build, p, 1.0, 7.0, 49.0)


BUSHING = form(
    "series_compliance",
    "bushing",
    "A bushing of plastic that creeps: part of it gives way at once, + c (1 − s) M, the rest over decades of time, "
    "+ c s (y_1 + y_2 + y_3)/3 with t_k ẏ_k = M − y_k, t_k = t_1, 7 t_1, 49 t_1.",
    (
        _SOFT,
        Parameter("share", "s, of what gives way late", 0.5, 0.0, 1.0),
        Parameter("lag_s", "t_1", 0.1, 0.0),
    ),
    ("load", "load_rate"),
    _bushing,
)


def _anisotropic(build: Build, p: Mapping[str, float]) -> None:
    def yields(inputs: Floats, outputs: Floats) -> None:
        soft = 1.0 + p["swing"] * np.cos(2.0 * outputs[:, PULLEY] - p["phase_rad"])
        outputs[:, Q_OUT] += p["compliance_rad_per_Nm"] * soft * outputs[:, PATH]

    build.mounts.append(yields)


ANISOTROPIC = form(
    "series_compliance",
    "anisotropic",
    "A bearing bracket or a split hub that is softer across than along, as the load turns in it: "
    "+ c (1 + a cos(2q − φ)) M.",
    (_SOFT, Parameter("swing", "a", 0.6, -1.0, 1.0), Parameter("phase_rad", "φ", 0.0)),
    ("load", "joint_angle"),
    _anisotropic,
)

KINDS: tuple[EffectKind, ...] = (
    STIFFENING,
    SOFTENING,
    STAGED,
    DIAPHRAGM,
    ONE_WAY,
    RUBBER,
    BUSHING,
    ANISOTROPIC,
)
