"""Pretension that changes with time or temperature: what that does to the cable already on the drums.

Where cable sticks, a uniform strain (creep, thermal expansion) adds the same tension dT = T0 (f_new - f_old) everywhere:
the slopes dT/dy stay, and with them the moment. In units of the new T0 a point goes from tau to 1 + (tau - 1)/g, g = f_new/f_old:
nothing slips while tensions rise. When they fall, friction mu T no longer holds the slopes that stood at its limit;
those slip until they stand at the limit again, and a profile that keeps its shape in units of T0 is where they come to rest
(exact for slopes at the limit; level cable away from T0 is treated alike).
"""

from __future__ import annotations

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.cable import law_of
from cablecomp.mechanics.jit import njit
from cablecomp.mechanics.profile import Floats, Ints, V, accumulate
from cablecomp.mechanics.tables import tau_of_v, v_of_tau
from cablecomp.mechanics.viscous import W_END, W_HEAD, block_of

LEAST_TAU = 1e-6


@njit
def retension(P: Floats, I: Ints, S: Floats, J: Ints, L: Floats, G: Floats, c: int, factor: float) -> None:
    """Bring cable c's profiles to pretension T0 * factor."""
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    g = factor / S[q + o.Q_T0]
    if abs(g - 1.0) < 1e-9:
        return
    S[q + o.Q_T0] = factor
    if g < 1.0:
        return
    if I[o.NODES] > 0:
        for end in range(2):
            b = block_of(I, 2 * c + end)
            S[b + W_END] = _moved(S[b + W_END], g)
            for k in range(b + W_HEAD, b + W_HEAD + 2 * I[o.NODES]):
                S[k] = _moved(S[k], g)
    for end in range(2):
        _shift(G, J, L, law_of(P, p, end), 2 * c + end, g)
    if I[o.N_STACKS] > 2 * I[o.N_CABLES]:
        _shift(G, J, L, 2, 2 * I[o.N_CABLES] + c, g)
        arc = 2 * I[o.N_CABLES] + c
        S[q + o.Q_GUIDE_END] = G[arc, V, 0]


@njit
def _moved(tau: float, g: float) -> float:
    return max(1.0 + (tau - 1.0) / g, LEAST_TAU)


@njit
def _shift(G: Floats, J: Ints, L: Floats, law: int, stack: int, g: float) -> None:
    n = J[stack]
    for k in range(n):
        G[stack, V, k] = v_of_tau(L, law, _moved(tau_of_v(L, law, G[stack, V, k]), g))
    accumulate(G, L, law, stack, n)
