"""Compiled torques on shafts: inertia, friction with presliding, gravity, wall, spring, couplings.

Each returns a torque along +q; `_slope` holds its derivative by q within the implicit step. Velocity and
acceleration come from the two-step backward differentiation formula: v = (b0 q + b1 q₋₁ + b2 q₋₂)/h.
"""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.jit import njit


@njit
def bdf(h: float, h_prev: float) -> tuple[float, float, float]:
    """Weights b0, b1, b2 of the variable-step two-step formula; one-step where the step grew too fast or is
    the first."""
    if h_prev <= 0.0 or h > 2.0 * h_prev:
        return 1.0, -1.0, 0.0
    w = h / h_prev
    return (1.0 + 2.0 * w) / (1.0 + w), -(1.0 + w), w * w / (1.0 + w)


@njit
def set_rates(s: Any, h: float, b0: float, b1: float, b2: float) -> None:
    """Velocity and acceleration of a shaft from its angle."""
    s.v = (b0 * s.q + b1 * s.q_1 + b2 * s.q_2) / h
    s.a = (b0 * s.v + b1 * s.v_1 + b2 * s.v_2) / h


@njit
def shaft_torque(s: Any, preload_factor: float) -> float:
    """Torque on a shaft without cables, couplings and bearing: τ_ext − J a − D v − m g l sin(q + φ) −
    spring − wall.

    Stores in `load_Nm` what reaches the cables, viscous bearing drag included, and the wall's in
    `contact_Nm`.
    """
    torque: float = s.external_Nm + s.preload_Nm * (preload_factor - 1.0)
    torque -= s.inertia * s.a + s.viscous * s.v
    torque -= s.gravity_Nm * math.sin(s.q + s.gravity_phase)
    if s.spring_Nm > 0.0:
        torque -= s.spring_Nm * math.tanh(s.spring_rate * s.q / s.spring_Nm)
    s.contact_Nm = 0.0
    depth = s.q - s.wall_at
    if s.wall_stiffness > 0.0 and depth > 0.0:
        s.contact_Nm = -s.wall_stiffness * depth * max(1.0 + s.wall_loss * s.v, 0.0)
    torque += s.contact_Nm
    s.load_Nm = torque
    torque += s.preload_Nm
    return torque


@njit
def shaft_slope(s: Any, rate: float) -> float:
    """−dτ/dq of `shaft_torque`, with rate = dv/dq; gravity counts only where it stabilises."""
    slope: float = s.inertia * rate * rate + s.viscous * rate
    slope += s.gravity_Nm * math.cos(s.q + s.gravity_phase)
    if s.spring_Nm > 0.0:
        slope += s.spring_rate / math.cosh(s.spring_rate * s.q / s.spring_Nm) ** 2
    if s.contact_Nm < 0.0:
        gain = 1.0 + s.wall_loss * s.v
        slope += s.wall_stiffness * (gain + (s.q - s.wall_at) * s.wall_loss * rate)
    return slope


@njit
def bearing_torque(s: Any) -> float:
    """Bearing friction on the shaft: a spring that yields at τ_b = coulomb + load_coefficient Σ R T
    (presliding)."""
    limit: float = s.coulomb_Nm + s.load_coefficient * max(s.radial_Nm, 0.0)
    s.bearing_limit = limit
    if limit <= 0.0:
        return 0.0
    if s.bearing_mode == 0:
        return -limit * float((s.q - s.bristle) / s.presliding)
    return -limit * float(s.bearing_mode)


@njit
def bearing_slope(s: Any) -> float:
    """−dτ/dq of `bearing_torque`."""
    if s.bearing_limit <= 0.0 or s.bearing_mode != 0:
        return 0.0
    slope: float = s.bearing_limit / s.presliding
    return slope


@njit
def update_bearing(s: Any) -> int:
    """Let the presliding spring yield or take hold; returns 1 if that changed."""
    if s.bearing_limit <= 0.0:
        return 0
    stretch = (s.q - s.bristle) / s.presliding
    mode = s.bearing_mode
    if mode == 0:
        if stretch > 1.0 + 1e-9:
            s.bearing_mode = 1
        elif stretch < -1.0 - 1e-9:
            s.bearing_mode = -1
    elif mode * stretch < 1.0 - 1e-9:
        s.bearing_mode = 0
    return 1 if s.bearing_mode != mode else 0


@njit
def settle_bearing(s: Any) -> None:
    """End of a step: drag the spring's anchor along where it yielded."""
    if s.bearing_limit > 0.0 and s.bearing_mode != 0:
        s.bristle = s.q - s.bearing_mode * s.presliding
    elif s.bearing_limit <= 0.0:
        s.bristle = s.q


@njit
def coupling_torque(k: Any, twist: float, rate: float) -> float:
    """Torque on shaft a of a spring and damper that b turns by `twist`.

    With clearance the flanks press by k δ (1 + λ δ̇), δ their depth, which begins without a jump (Hunt,
    Crossley 1975), and never pull.
    """
    if k.gap <= 0.0:
        torque: float = k.stiffness * twist + k.damping * rate
        return torque
    depth = abs(twist) - 0.5 * k.gap
    if depth <= 0.0:
        return 0.0
    side = math.copysign(1.0, twist)
    pressed: float = side * k.stiffness * depth * max(1.0 + side * rate * k.flank_loss, 0.0)
    return pressed


@njit
def coupling_slope(k: Any, twist: float, rate: float, turn: float) -> float:
    """Derivative of `coupling_torque` by the twist, with turn = dv/dq."""
    if k.gap <= 0.0:
        slope: float = k.stiffness + k.damping * turn
        return slope
    depth = abs(twist) - 0.5 * k.gap
    gain = 1.0 + math.copysign(1.0, twist) * rate * k.flank_loss
    if depth <= 0.0 or gain <= 0.0:
        return 0.0
    pressed: float = k.stiffness * (gain + depth * k.flank_loss * turn)
    return pressed
