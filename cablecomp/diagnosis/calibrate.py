"""Calibration of the nominal drive: what is only nominally known, fitted to recordings within its tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.augmented import augmented_joint
from cablecomp.diagnosis.body import Body, Columns, Sessions, gather_body
from cablecomp.diagnosis.calibration import calibrate_drive
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.result import Value
from cablecomp.diagnosis.values import drive_values
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.least_squares import covariance, rms_left

UNTOLD = 0.9
"""Share of its prior's sd from which a parameter's own sd says that the recordings told nothing of it."""


@dataclass(frozen=True)
class Calibration:
    """`config`: the configuration with the fitted values and zeros; `values`: each with its sd and what was nominal;
    `rmse_rad`, `nominal_rmse_rad`: what is left with them and with the nominal ones, zeros taken off; `noise_rad`: what noise
    alone would leave; `warnings`: one line each."""

    config: JointConfig
    values: tuple[Value, ...]
    rmse_rad: float
    nominal_rmse_rad: float
    noise_rad: float
    warnings: tuple[str, ...]

    def __getitem__(self, name: str) -> Value:
        """The value of that name."""
        return next(v for v in self.values if v.name == name)


def calibrate(
    config: JointConfig, recordings: Mapping[str, Columns], seed: int = 0, sessions: Sessions | None = None
) -> Calibration:
    """Fit what `[tolerance]` frees, and the zeros, to all rows of the recordings (name or path -> canonical channels).

    Raises InputError for recordings that lack a channel or that the nominal joint cannot follow.
    """
    body = gather_body(config, recordings, sessions)
    drive = calibrate_drive(config, _everything(body), np.random.default_rng(seed))
    fit = drive.fit
    joint = augmented_joint(config, Model((), fit, fit.residual), (), body.names)
    warnings = [f"{name} ended on its bound: its value is not known" for name in fit.at_bound()]
    sd = np.sqrt(np.diag(covariance(fit)))
    for p, s in zip(fit.problem.parameters, sd, strict=True):
        if s > UNTOLD * p.sd:
            warnings.append(f"{p.name}: these recordings tell nothing of it; it stays near its nominal value")
    if drive.lost_rows:
        warnings.append(f"{drive.lost_rows} rows were given up to the history before the first sample")
    return Calibration(
        joint,
        drive_values(fit, config),
        rms_left(fit),
        rms_left(drive.nominal),
        drive.floor_rad,
        tuple(warnings),
    )


def _everything(body: Body) -> list[Evidence]:
    """All rows: a calibration keeps none for the end."""
    if body.final_by != "block":
        return [*body.used, *body.final]
    return [
        replace(u, counted={k: v | f.counted[k] for k, v in u.counted.items()})
        for u, f in zip(body.used, body.final, strict=True)
    ]
