"""What every state of a joint obeys: the laws that a committed step may never break, verified by other code than the kernel's.

For tests, for a snapshot that is taken up, and for whoever doubts a state; far too slow for the loop.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.profile import LEAST_WRAP, ROWS, B, C, D, E, Floats, Ints, V, Y, _piece_table
from cablecomp.mechanics.tables import groove
from cablecomp.mechanics.viscous import W_COUNT, W_END, W_HEAD

ROOM = 4  # points that a step may need beyond those it leaves behind
STEEP = 1e-9  # of v, by which rounding may pass the friction cone
RELATIVE = 1e-9  # of running integrals
AGREE_RAD = 1e-6  # between wrap angles and shafts


def heights_fit(model: Model, heights: NDArray[np.float64] | Ints) -> bool:
    """True if every profile has at least its two ends and fits its array with room for a step."""
    most = int(model.I[o.CAPACITY]) - ROOM
    return bool(np.all((heights >= 2) & (heights <= most) & (heights == np.floor(heights))))


def violations(model: Model, S: Floats, J: Ints) -> list[str]:
    """Every invariant of a joint's committed state that S, J break, in words; empty = sound.

    Profiles (`profile_violations`); wrap angles that agree with the shafts; finite scalars; positive tensions and factors.
    """
    found = profile_violations(model, S, J)
    if not heights_fit(model, J):
        return found
    return found + _scalar_violations(model, S) + _angle_violations(model, S, J)


def profile_violations(model: Model, S: Floats, J: Ints) -> list[str]:
    """The same for the profiles alone.

    Count between 2 and capacity - 4; angles from 0 on, rising; |dv| <= mu dsigma between neighbours (thesis 2-11); finite
    tensions; running integrals C = int e dy and B that belong to the points; error bounds D >= 0.
    """
    if not heights_fit(model, J):
        return [f"profile lengths {J.tolist()} in room for {int(model.I[o.CAPACITY])}"]
    stacks = int(model.I[o.N_STACKS])
    first = int(model.I[o.S_PROFILE])
    G = S[first : int(model.I[o.S_SPARE])].reshape(stacks, ROWS, -1)
    found = []
    for stack in range(stacks):
        found += [f"profile {stack}: {words}" for words in _profile(model, S, G[stack, :, : J[stack]], stack)]
    return found


def _profile(model: Model, S: Floats, rows: Floats, stack: int) -> list[str]:
    wraps = 2 * int(model.I[o.N_CABLES])
    p = int(model.I[o.N_CIRCUITS]) * o.JOINT + o.CABLE * (stack // 2 if stack < wraps else stack - wraps)
    guide = stack >= wraps
    if not np.all(np.isfinite(rows)):
        return ["a number is not finite"]
    y, v = rows[Y], rows[V]
    if y[0] != 0.0 or np.any(np.diff(y) <= 0.0):
        return [f"angles do not rise from 0: {y.tolist()}"]
    if np.any(rows[D] < 0.0) or (model.L is None and np.any(np.diff(rows[B]) < 0.0)):
        return ["a bound on the error of merging is negative"]
    if guide and abs(y[-1] - model.P[p + o.GUIDE]) > AGREE_RAD:
        return [f"its guide is {y[-1]} wide instead of {model.P[p + o.GUIDE]}"]
    law = 2 if guide else _law(model, p, stack % 2)
    mu = 1.0 if guide else float(model.P[p + o.MU_OUT + stack % 2])
    over = float(np.max(np.abs(np.diff(v)) - mu * np.diff(_sigma(model, law, y))))
    found = [f"is steeper than friction holds, by {over:g}"] if over > STEEP else []
    parts = _integrals(model, law, y, v)
    scale = RELATIVE * (float(np.sum(np.abs(parts))) + float(y[-1]))
    miss = float(np.max(np.abs(np.diff(rows[C]) - parts)))
    if rows[C, 0] != 0.0 or miss > scale:
        found.append(f"its running integral is off by {miss:g}")
    if (model.L is None or guide) and float(np.max(np.abs(rows[E] / np.exp(v) - 1.0))) > RELATIVE:
        found.append("its tensions are not exp(v)")
    return found


def _integrals(model: Model, law: int, y: Floats, v: Floats) -> Floats:
    """Integral of e over every piece; for a tabulated law by the kernel's own quadrature, which defines it."""
    dy, d = np.diff(y), np.diff(v)
    if model.L is None or model.L[0, 0, 0] == 0.0:
        small = np.abs(d) < 1e-9
        mean = np.where(small, 1.0 - 0.5 * d, -np.expm1(-d) / np.where(small, 1.0, d))
        return np.asarray(dy * (np.exp(v[1:]) * mean - 1.0))
    ends = zip(y[:-1].tolist(), v[:-1].tolist(), y[1:].tolist(), v[1:].tolist(), strict=True)
    return np.array([_piece_table(model.L, law, *piece)[0] for piece in ends])


def _sigma(model: Model, law: int, y: Floats) -> Floats:
    """Groove coordinate of the angles y."""
    return np.array([groove(model.L, law, float(a)) for a in y])


def _law(model: Model, p: int, end: int) -> int:
    if end == 1 or model.P[p + o.JOINT_DRUM] == 0.0:
        return 2
    return 0 if model.P[p + o.SIGN] > 0.0 else 1


def _scalar_violations(model: Model, S: Floats) -> list[str]:
    I = model.I
    found: list[str] = []
    for c in range(int(I[o.N_CABLES])):
        q = int(I[o.S_CABLE]) + o.CABLE_STATE * c
        if not np.all(np.isfinite(S[q : q + o.CABLE_STATE])):
            found.append(f"cable {c}: a number is not finite")
        for place, what in (
            (o.Q_TENSION, "tension"),
            (o.Q_TENSION_IN, "tension at the input drum"),
            (o.Q_T0, "pretension factor"),
            (o.Q_EA, "stiffness factor"),
        ):
            if not S[q + place] > 0.0:
                found.append(f"cable {c}: {what} {S[q + place]:g}")
    x = int(I[o.S_CONTEXT])
    needed = [
        o.X_TIME,
        o.X_MOTOR,
        o.X_MOTOR_OLD,
        o.X_JOINT,
        o.X_JOINT_OLD,
        o.X_LOAD,
        *range(o.X_MOMENT, o.CONTEXT),
    ]
    if not np.all(np.isfinite(S[[x + place for place in needed]])):
        found.append("the context holds a number that is not finite")
    if not np.all(np.isfinite(S[int(I[o.S_FILTER]) : int(I[o.S_MEET])])):
        found.append("the filter's, a term's or a grid's state is not finite")
    nodes = int(I[o.NODES])
    wraps = 2 * int(I[o.N_CABLES])
    # behind a guide the input drum has no use for its grid
    for wrap in range(0, wraps if nodes else 0, 1 if int(I[o.N_STACKS]) == wraps else 2):
        b = int(I[o.S_WET]) + wrap * (W_HEAD + 4 * nodes)
        if not (1.0 <= S[b + W_COUNT] <= nodes and S[b + W_END] > 0.0):
            found.append(f"grid {wrap}: {S[b + W_COUNT]:g} nodes, end tension {S[b + W_END]:g}")
        elif not np.all(S[b + W_HEAD : b + W_HEAD + int(S[b + W_COUNT])] > 0.0):
            found.append(f"grid {wrap}: a tension is not positive")
    return found


def _angle_violations(model: Model, S: Floats, J: Ints) -> list[str]:
    """Wraps that do not end where their shafts stand."""
    I, P = model.I, model.P
    found: list[str] = []
    x = int(I[o.S_CONTEXT])
    if S[x + o.X_FIRST] != 0.0 or I[o.NODES] > 0:
        return found
    first = int(I[o.S_PROFILE])
    G = S[first : int(I[o.S_SPARE])].reshape(int(I[o.N_STACKS]), ROWS, -1)
    last = int(I[o.N_CIRCUITS]) - 1
    h = o.HEADER + o.CIRCUIT * last
    for chain in range(1 + int(I[h + o.C_CLOSED])):
        c = int(I[h] if chain == 0 else I[h + o.C_FIRST_L]) + int(I[h + o.C_COUNT]) - 1
        p = int(I[o.N_CIRCUITS]) * o.JOINT + o.CABLE * c
        expected = P[p + o.W_OUT] + P[p + o.SIGN] * S[x + o.X_JOINT]
        _agree(found, 2 * c, float(G[2 * c, Y, J[2 * c] - 1]), float(expected))
        c = int(I[o.HEADER] if chain == 0 else I[o.HEADER + o.C_FIRST_L])
        p = int(I[o.N_CIRCUITS]) * o.JOINT + o.CABLE * c
        expected = P[p + o.W_IN] - P[p + o.SIGN] * S[x + o.X_MOTOR]
        _agree(found, 2 * c + 1, float(G[2 * c + 1, Y, J[2 * c + 1] - 1]), float(expected))
    return found


def _agree(found: list[str], stack: int, wrap: float, expected: float) -> None:
    if not wrap > LEAST_WRAP or not math.isclose(wrap, expected, rel_tol=0.0, abs_tol=AGREE_RAD):
        found.append(f"profile {stack}: ends at {wrap} rad, its shafts say {expected}")
