"""Viscous slip: where cable slides on a drum, friction takes mu T + c v per radian (v slip speed) instead of mu T.

The stretch then diffuses through the sliding zone: with displacement rate v(y), conservation gives
(R/EA) dT/dt = dv/dy and the slip law c v = shrink(dT/dy, mu T). Solved implicitly on a grid fixed to the drum by Newton's
method on a tridiagonal system; only the part that can move is solved. c = 0 is the plain law (other code: `profile.py`).
"""

from __future__ import annotations

from cablecomp.mechanics import layout as o
from cablecomp.mechanics.jit import kernel
from cablecomp.mechanics.profile import Floats, Ints, copy_floats

# one wrap's block: grid step, committed free nodes, wrap angle, end tension, the same pending, then four rows of nodes:
# committed, pending, two of scratch
W_STEP, W_COUNT, W_ANGLE, W_END, W_COUNT_TRY, W_ANGLE_TRY, W_END_TRY, W_TIME_TRY, W_HEAD = range(9)

STIFFEST = 1e3  # diffusion number per step beyond which slip is as good as quasi-static


@kernel
def block_of(I: Ints, wrap: int) -> int:
    """Where a wrap's grid lies in S."""
    return I[o.S_WET] + wrap * (W_HEAD + 4 * I[o.NODES])


@kernel
def viscous_fill(I: Ints, S: Floats, wrap: int, w: float, reach: float) -> None:
    """Start a wrap at uniform tension T0 with wrap angle w; the grid covers `reach` [rad]."""
    b = block_of(I, wrap)
    n = I[o.NODES]
    S[b + W_STEP] = reach / (n - 1)
    S[b + W_COUNT] = _free_nodes(w, S[b + W_STEP], n)
    S[b + W_ANGLE] = w
    S[b + W_END] = 1.0
    S[b + W_TIME_TRY] = -1e300
    S[b + W_HEAD : b + W_HEAD + 4 * n] = 1.0


@kernel
def _free_nodes(w: float, h: float, n: int) -> int:
    """Number of grid nodes well inside the wrap; the departure point itself is one node more."""
    return min(max(int((w - 0.3 * h) / h) + 1, 1), n)


@kernel
def viscous_eval(
    P: Floats, I: Ints, S: Floats, c: int, end: int, w: float, tau: float, mu: float
) -> tuple[float, float, float]:
    """Integral of tau - 1 over the wrap at end value tau, its derivatives by ln tau and by the wrap angle; kept as pending."""
    wrap = 2 * c + end
    b = block_of(I, wrap)
    p = o.CABLE * c + o.JOINT * I[o.N_CIRCUITS]
    q = I[o.S_CABLE] + o.CABLE_STATE * c
    h = S[b + W_STEP]
    n = I[o.NODES]
    count = _free_nodes(w, h, n)
    old, new = b + W_HEAD, b + W_HEAD + n
    before = int(S[b + W_COUNT])
    y_last = (before - 1) * h
    now = S[I[o.S_CONTEXT] + o.X_TIME]
    # a further evaluation within the same step starts from the last one's answer
    again = S[b + W_TIME_TRY] == now and int(S[b + W_COUNT_TRY]) == count
    S[b + W_TIME_TRY] = now
    for j in range(count):  # cable that arrived since: linear in between
        if j >= before:
            y = j * h
            w_old, t_old = S[b + W_ANGLE], S[b + W_END]
            if y <= w_old:
                S[old + j] = S[old + before - 1] + (y - y_last) / (w_old - y_last) * (
                    t_old - S[old + before - 1]
                )
            else:
                S[old + j] = t_old + (y - w_old) / (w - w_old) * (tau - t_old)
        if not again:
            S[new + j] = S[old + j]
    x = I[o.S_CONTEXT]
    dt = S[x + o.X_DT] if S[x + o.X_FIRST] == 0.0 else 1e9
    radius = P[p + o.R_OUT + end]
    rate = dt * P[p + o.EA] * S[q + o.Q_EA] / (radius * P[p + o.VISCOUS])
    rate = min(rate, STIFFEST * h * h)
    slope = _relax(S, old, new, n, count, h, w, tau, mu, rate)
    total = 0.0
    last = (count - 1) * h
    for j in range(count - 1):
        total += 0.5 * h * (S[new + j] + S[new + j + 1] - 2.0)
    total += 0.5 * (w - last) * (S[new + count - 1] + tau - 2.0)
    S[b + W_COUNT_TRY], S[b + W_ANGLE_TRY], S[b + W_END_TRY] = count, w, tau
    return total, slope * tau, tau - 1.0


@kernel
def _relax(
    S: Floats, old: int, new: int, size: int, n: int, h: float, w: float, tau: float, mu: float, rate: float
) -> float:
    """Implicit step of nodes 0..n-1 by Newton's method; returns the derivative of the integral by the end value."""
    gap = w - (n - 1) * h
    first = n
    for _ in range(60):
        first = _front(S, old, new, n, h, gap, tau, mu)
        if first == n:
            return 0.5 * gap
        if _newton(S, old, new, size, n, first, h, gap, tau, mu, rate, False) <= 1e-13:
            break
    # linear answer to a change of the end value
    _newton(S, old, new, size, n, first, h, gap, tau, mu, rate, True)
    answer = new + 2 * size
    slope = 0.5 * gap * (1.0 + S[answer + n - 1])
    for j in range(first, n - 1):
        slope += 0.5 * h * (S[answer + j] + S[answer + j + 1])
    if first > 0:
        slope += 0.5 * h * S[answer + first]
    return slope


@kernel
def _front(S: Floats, old: int, new: int, n: int, h: float, gap: float, tau: float, mu: float) -> int:
    """The deepest node that moves, or n if none does; deep cable may still creep while the cable outside of it sticks."""
    for j in range(n):
        right = tau if j == n - 1 else S[new + j + 1]
        slip, _, _ = _face(S[new + j], right, gap if j == n - 1 else h, mu)
        if slip != 0.0 or S[new + j] != S[old + j]:
            return j
    return n


@kernel
def _face(a: float, b: float, d: float, mu: float) -> tuple[float, float, float]:
    """Slip drive shrink((b - a)/d, mu (a + b)/2) and its derivatives by a and b."""
    g = (b - a) / d
    limit = mu * 0.5 * (a + b)
    if g > limit:
        return g - limit, -1.0 / d - 0.5 * mu, 1.0 / d - 0.5 * mu
    if g < -limit:
        return g + limit, -1.0 / d + 0.5 * mu, 1.0 / d + 0.5 * mu
    return 0.0, 0.0, 0.0


@kernel
def _row(
    S: Floats, old: int, new: int, n: int, j: int, h: float, gap: float, tau: float, mu: float, rate: float
) -> tuple[float, float, float, float]:
    """Residual of node j and its derivatives by nodes j - 1, j, j + 1."""
    size = 0.5 * h if j == 0 else h
    if j == n - 1:
        size = (0.0 if j == 0 else 0.5 * h) + 0.5 * gap
    k = rate / size
    right = tau if j == n - 1 else S[new + j + 1]
    out, out_a, out_b = _face(S[new + j], right, gap if j == n - 1 else h, mu)
    inner = inner_a = inner_b = 0.0
    if j > 0:
        inner, inner_a, inner_b = _face(S[new + j - 1], S[new + j], h, mu)
    residual = S[new + j] - S[old + j] - k * (out - inner)
    return residual, k * inner_a, 1.0 - k * (out_a - inner_b), -k * out_b


@kernel
def _newton(
    S: Floats, old: int, new: int, size: int, n: int, first: int, h: float, gap: float, tau: float, mu: float,
    rate: float, linear: bool,
) -> float:  # fmt: skip
    """One Newton step for nodes first..n-1 (Thomas algorithm), and its largest change.

    With `linear` nothing moves: the scratch row gets the nodes' derivatives by the end value instead.
    """
    upper, right = new + size, new + 2 * size
    for j in range(first, n):
        residual, below, own, above = _row(S, old, new, n, j, h, gap, tau, mu, rate)
        target = -residual
        if linear:
            target = -above if j == n - 1 else 0.0
        if j > first:
            own -= below * S[upper + j - 1]
            target -= below * S[right + j - 1]
        S[upper + j] = above / own
        S[right + j] = target / own
    largest = 0.0
    for j in range(n - 2, first - 1, -1):
        S[right + j] -= S[upper + j] * S[right + j + 1]
    if not linear:
        for j in range(first, n):
            largest = max(largest, abs(S[right + j]))
            S[new + j] = max(S[new + j] + S[right + j], 1e-9)
    return largest


@kernel
def viscous_commit(I: Ints, S: Floats, wrap: int) -> None:
    """Make the pending profile of a wrap its state."""
    b = block_of(I, wrap)
    n = I[o.NODES]
    S[b + W_COUNT], S[b + W_ANGLE], S[b + W_END] = S[b + W_COUNT_TRY], S[b + W_ANGLE_TRY], S[b + W_END_TRY]
    count = int(S[b + W_COUNT])
    copy_floats(S, b + W_HEAD + n, S, b + W_HEAD, count)
