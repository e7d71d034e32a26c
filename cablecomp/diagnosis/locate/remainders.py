"""What a fit leaves of the joint angle, beside the covariates that it may follow and what calibration can do to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.locate.covariates import Covariates, covariates, join
from cablecomp.diagnosis.locate.series import Series, make_series
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.smoothing import FloatArray


def covariates_of(config: JointConfig, e: Evidence, left: FloatArray | None = None) -> Covariates:
    """Covariates on all fine rows, a condition's channel under the condition's name; `left`: what a fit leaves of the
    joint's angle [rad] there."""
    columns = {k: v for k, v in e.columns.items() if k != "motor_torque_Nm"}
    columns["joint_torque_Nm"] = np.broadcast_to(
        np.asarray(load_of(config, e.columns), dtype=np.float64), columns["time_s"].shape
    ).copy()
    found = covariates(columns, None if left is None else columns[JOINT] - left)
    called = {
        f"other:{c.removeprefix('other_')}": f"condition:{name}" for name, c in config.condition.items()
    }
    return replace(found, values={called.get(name, name): v for name, v in found.values.items()})


def series_of(fit: Fit, seen: Sequence[Covariates], floor_rad: float) -> Series:
    """What the fit leaves of the joint angle on counted rows, beside its covariates."""
    problem = fit.problem
    parts, kept = [], []
    for e, left, c in zip(problem.evidence, problem.left(fit.x), seen, strict=True):
        here = e.counted[JOINT]
        parts.append(left[here])
        kept.append(c.at(here))
    return make_series(np.concatenate(parts), floor_rad, join(kept))


def sensitivities(fit: Fit) -> FloatArray:
    """Derivative of the joint rows [rad] by the fit's parameters: what calibration can explain is not counted."""
    problem = fit.problem
    count = len(problem.owners(JOINT))
    weight = np.concatenate([e.weight[e.counted[JOINT]] for e in problem.evidence])
    rows = fit.J[:count] * (problem.weighing.sigma[JOINT] / weight)[:, None]
    own = np.stack([problem.owners(JOINT) == k for k in range(len(problem.evidence))], axis=1).astype(
        np.float64
    )
    return np.column_stack((rows, own)) if rows.shape[1] else own
