"""A first lag behind what goes straight from sample to sample."""

from __future__ import annotations

import math

from cablecomp.mechanics.jit import njit


@njit
def lagged(late: float, before: float, now: float, passed: float, lag: float) -> float:
    """What follows a reading by the lag [s], t_l dy/dt = x - y, after `passed` seconds > 0 in which that went straight
    from `before` to `now`; `late`: what followed before. Exact: y = x - s t_l + (y_0 - x_0 + s t_l) exp(-t/t_l), s the
    slope."""
    behind = lag * (now - before) / passed
    return now - behind + (late - before + behind) * math.exp(-passed / lag)
