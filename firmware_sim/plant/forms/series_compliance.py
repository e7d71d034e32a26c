"""Series compliance in other forms: a coupling that stiffens, and one that is softer one way."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import PATH, Q_OUT
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
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

KINDS: tuple[EffectKind, ...] = (STIFFENING, ONE_WAY)
