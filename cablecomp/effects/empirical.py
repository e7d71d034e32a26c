"""Laws without a physical name: a curve over one channel, added to the joint position that is predicted."""

from __future__ import annotations

import math
from typing import Any, Final

from cablecomp.config import Empirical, JointConfig
from cablecomp.effects.compiled_term import term
from cablecomp.errors import InputError
from cablecomp.mechanics.change import Term
from cablecomp.mechanics.jit import njit
from cablecomp.mechanics.records import OTHERS

FORMS: Final = ("chebyshev", "fourier")
CHANNELS: Final = (
    "time_s",
    "motor_position_rad",
    "joint_position_rad",
    "joint_torque_Nm",
    "temperature_degC",
)
"""What a law may depend on, in the order of `_channel`; the channels other_<name> follow."""
_MOST: Final = 24


@njit
def _channel(c: Any, place: int) -> Any:
    if place == 0:
        return c.time
    if place == 1:
        return c.motor
    if place == 2:
        return c.joint
    if place == 3:
        return c.load
    if place == 4:
        return c.temperature
    return c.other[place - 5]


@term(parameters=("form", "channel", "centre", "half_width", "count", ("coefficients", _MOST)))
def _curve(c: Any, p: Any, s: Any) -> None:
    """p: place in `FORMS`, in `CHANNELS`, centre and half width of the channel, number of coefficients [rad] in use.

    Chebyshev: T_k(x) of x held within -1..1. Fourier: 1, sin πx, cos πx, sin 2πx, cos 2πx, ...
    """
    x = (_channel(c, int(p.channel)) - p.centre) / p.half_width
    if math.isnan(x):
        return
    coefficients = p.coefficients
    total = coefficients[0]
    if p.form == 0.0:
        x = min(max(x, -1.0), 1.0)
        before, now = 1.0, x
        for k in range(1, int(p.count)):
            total += coefficients[k] * now
            before, now = now, 2.0 * x * now - before
    else:
        for k in range(1, int(p.count)):
            angle = math.pi * ((k + 1) // 2) * x
            total += coefficients[k] * (math.sin(angle) if k % 2 == 1 else math.cos(angle))
    c.reading += total


def empirical_term(law: Empirical, config: JointConfig, others: list[str]) -> tuple[Term, ...]:
    """The term of one `[[empirical]]`; raises InputError for a form or a channel that cannot be had."""
    where = f"{config.name}: [[empirical]] `{law.id}`"
    if law.law not in FORMS:
        raise InputError(f"{where}: law '{law.law}' is unknown; {', '.join(FORMS)} are accepted")
    if len(law.coefficients_rad) > _MOST:
        raise InputError(f"{where}: {len(law.coefficients_rad)} coefficients; up to {_MOST} are accepted")
    known = (*CHANNELS, *others[:OTHERS])
    if law.of not in known:
        raise InputError(
            f"{where}: of '{law.of}'; {', '.join(CHANNELS)} or one of {OTHERS} channels other_<name> are accepted"
        )
    count = len(law.coefficients_rad)
    return _curve(
        form=FORMS.index(law.law),
        channel=known.index(law.of),
        centre=law.centre,
        half_width=law.half_width,
        count=count,
        coefficients=(*law.coefficients_rad, *([0.0] * (_MOST - count))),
    )
