"""Laws without a physical name: a curve over one channel, added to the joint position that is predicted."""

from __future__ import annotations

import math
from typing import Any, Final

from cablecomp.config import Empirical, JointConfig
from cablecomp.effects.base import term
from cablecomp.errors import InputError
from cablecomp.mechanics.assemble import Term
from cablecomp.mechanics.layout import (
    OTHERS,
    X_JOINT,
    X_LOAD,
    X_MOTOR,
    X_OTHER,
    X_READING,
    X_TEMPERATURE,
    X_TIME,
)

FORMS: Final = ("chebyshev", "fourier")
_MOST: Final = 24
_PLACES: Final = {
    "time_s": X_TIME,
    "motor_position_rad": X_MOTOR,
    "joint_position_rad": X_JOINT,
    "joint_torque_Nm": X_LOAD,
    "temperature_degC": X_TEMPERATURE,
}


@term(parameters=5 + _MOST)
def _curve(c: Any, p: Any, s: Any) -> None:
    """p: form, place in the context, centre, half width, number of coefficients, coefficients [rad].

    Chebyshev: T_k(x) of x held within -1..1. Fourier: 1, sin πx, cos πx, sin 2πx, cos 2πx, ...
    """
    x = (c[int(p[1])] - p[2]) / p[3]
    if math.isnan(x):
        return
    count = int(p[4])
    if p[0] == 0.0:
        x = min(max(x, -1.0), 1.0)
        before, now = 1.0, x
        total = p[5]
        for k in range(1, count):
            total += p[5 + k] * now
            before, now = now, 2.0 * x * now - before
    else:
        total = p[5]
        for k in range(1, count):
            order = (k + 1) // 2
            total += p[5 + k] * (
                math.sin(math.pi * order * x) if k % 2 == 1 else math.cos(math.pi * order * x)
            )
    c[X_READING] += total


def empirical_term(law: Empirical, config: JointConfig, others: list[str]) -> tuple[Term, ...]:
    """The term of one `[[empirical]]`; raises InputError for a form or a channel that cannot be had."""
    where = f"{config.name}: [[empirical]] `{law.id}`"
    if law.law not in FORMS:
        raise InputError(f"{where}: law '{law.law}' is unknown; {', '.join(FORMS)} are accepted")
    if len(law.coefficients_rad) > _MOST:
        raise InputError(f"{where}: {len(law.coefficients_rad)} coefficients; up to {_MOST} are accepted")
    place = X_OTHER + others.index(law.of) if law.of in others else _PLACES.get(law.of)
    if place is None or place >= X_OTHER + OTHERS:
        raise InputError(
            f"{where}: of '{law.of}'; {', '.join(_PLACES)} or one of {OTHERS} channels other_<name> are accepted"
        )
    padded = (*law.coefficients_rad, *([0.0] * (_MOST - len(law.coefficients_rad))))
    head = (float(FORMS.index(law.law)), float(place), law.centre, law.half_width)
    return _curve(*head, float(len(law.coefficients_rad)), *padded)
