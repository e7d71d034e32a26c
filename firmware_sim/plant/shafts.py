"""Compiled torques on shafts: inertia, friction with presliding, gravity, wall, spring, couplings.

Each returns a torque along +q; `_slope` holds its derivative by q within the implicit step. Velocity and
acceleration come from the two-step backward differentiation formula: v = (b0 q + b1 q₋₁ + b2 q₋₂)/h.
"""

from __future__ import annotations

import math
from typing import Any

from firmware_sim.plant.jit import part


@part
def bdf(h: float, h_prev: float) -> tuple[float, float, float]:
    """Weights b0, b1, b2 of the variable-step two-step formula; one-step where the step grew too fast or is
    the first."""
    if h_prev <= 0.0 or h > 2.0 * h_prev:
        return 1.0, -1.0, 0.0
    w = h / h_prev
    return (1.0 + 2.0 * w) / (1.0 + w), -(1.0 + w), w * w / (1.0 + w)


@part
def set_rates(s: Any, h: float, b0: float, b1: float, b2: float) -> None:
    """Velocity and acceleration of a shaft from its angle."""
    s.v = (b0 * s.q + b1 * s.q_1 + b2 * s.q_2) / h
    s.a = (b0 * s.v + b1 * s.v_1 + b2 * s.v_2) / h


@part
def shaft_torque(s: Any, preload_factor: float) -> float:
    """Torque on a shaft without cables, couplings and bearing: τ_ext − J a − D v − m g l sin(q + φ) −
    spring − wall, J = J0 (1 + w cos(q − ψ)) with the torque ½ J′ v² besides.

    Stores in `load_Nm` what reaches the cables, viscous bearing drag included, and the wall's in
    `contact_Nm`.
    """
    torque: float = s.external_Nm + s.preload_Nm * (preload_factor - 1.0)
    torque -= s.inertia * s.a + s.viscous * s.v
    if s.inertia_swing != 0.0:
        place = s.q - s.inertia_phase
        swing = s.inertia * s.inertia_swing
        torque -= swing * (math.cos(place) * s.a - 0.5 * math.sin(place) * s.v * s.v)
    torque -= s.gravity_Nm * (1.0 - s.lean) * math.sin(s.q + s.gravity_phase + s.tilt)
    if s.gravity_second != 0.0:
        torque -= s.gravity_Nm * s.gravity_second * math.sin(2.0 * s.q + s.gravity_second_phase)
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


@part
def shaft_slope(s: Any, rate: float) -> float:
    """−dτ/dq of `shaft_torque`, with rate = dv/dq; gravity counts only where it stabilises."""
    inertia = s.inertia * (1.0 + s.inertia_swing * math.cos(s.q - s.inertia_phase))
    slope: float = inertia * rate * rate + s.viscous * rate
    slope += s.gravity_Nm * (1.0 - s.lean) * math.cos(s.q + s.gravity_phase + s.tilt)
    if s.gravity_second != 0.0:
        slope += 2.0 * s.gravity_Nm * s.gravity_second * math.cos(2.0 * s.q + s.gravity_second_phase)
    if s.spring_Nm > 0.0:
        slope += s.spring_rate / math.cosh(s.spring_rate * s.q / s.spring_Nm) ** 2
    if s.contact_Nm < 0.0:
        gain = 1.0 + s.wall_loss * s.v
        slope += s.wall_stiffness * (gain + (s.q - s.wall_at) * s.wall_loss * rate)
    return slope


@part
def bearing_limit(s: Any, way: float) -> float:
    """τ_b = (coulomb + what it gains + load_coefficient Σ R T) (1 + skew · way), way the sign of turning."""
    both: float = s.coulomb_Nm + s.coulomb_more_Nm + s.load_coefficient * max(s.radial_Nm, 0.0)
    limit: float = both * (1.0 + s.coulomb_skew * way)
    return limit


@part
def bristle_stretch(s: Any) -> float:
    """Where the bristles of Dahl's and LuGre's law stand at the end of the step, rad; s.bristle is their stretch at
    its beginning.

    Dahl: dz = dq − |dq| z/z0, solved exactly; LuGre: the same with z0 (1 + gain e^(−(v/v_s)²)), solved implicitly.
    """
    turn = s.q - s.q_1
    way = math.copysign(1.0, turn)
    if s.friction_kind == 1:
        end = way * s.presliding
        dahl: float = end + (s.bristle - end) * math.exp(-abs(turn) / s.presliding)
        return dahl
    reach = s.presliding * (1.0 + s.stribeck_gain * math.exp(-((s.v / s.stribeck_speed) ** 2)))
    lugre: float = (s.bristle + turn) / (1.0 + abs(turn) / reach)
    return lugre


@part
def bearing_torque(s: Any, h: float) -> float:
    """Bearing friction on the shaft: a spring that yields at τ_b (presliding), or bristles stretched by z: τ_b z/z0
    + damping · ż."""
    limit = bearing_limit(s, 0.0)
    s.bearing_limit = limit
    if limit <= 0.0:
        return 0.0
    if s.friction_kind != 0:
        z = bristle_stretch(s)
        held = bearing_limit(s, math.copysign(1.0, z)) * z / s.presliding
        return -float(held + s.bristle_damping * (z - s.bristle) / h)
    stretch = (s.q - s.bristle) / s.presliding
    limit = bearing_limit(s, math.copysign(1.0, stretch))
    if s.bearing_mode == 0:
        return -float(limit * stretch)
    return -float(limit * s.bearing_mode)


@part
def bearing_slope(s: Any, h: float) -> float:
    """−dτ/dq of `bearing_torque`; what LuGre's law loses with speed is left out."""
    if s.bearing_limit <= 0.0:
        return 0.0
    turn = s.q - s.q_1
    way = math.copysign(1.0, turn)
    if s.friction_kind == 1:
        rate = max(1.0 - way * s.bristle / s.presliding, 0.0) * math.exp(-abs(turn) / s.presliding)
        dahl: float = rate * (s.bearing_limit / s.presliding)
        return dahl
    if s.friction_kind == 2:
        reach = s.presliding * (1.0 + s.stribeck_gain * math.exp(-((s.v / s.stribeck_speed) ** 2)))
        rate = max(1.0 - way * s.bristle / reach, 0.0) / (1.0 + abs(turn) / reach) ** 2
        lugre: float = rate * (s.bearing_limit / s.presliding + s.bristle_damping / h)
        return lugre
    if s.bearing_mode != 0:
        return 0.0
    slope: float = bearing_limit(s, math.copysign(1.0, s.q - s.bristle)) / s.presliding
    return slope


@part
def update_bearing(s: Any) -> int:
    """Let the presliding spring yield or take hold; returns 1 if that changed."""
    if s.bearing_limit <= 0.0 or s.friction_kind != 0:
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


@part
def settle_bearing(s: Any) -> None:
    """End of a step: drag the spring's anchor along where it yielded; keep the bristles' stretch."""
    if s.friction_kind != 0:
        s.bristle = bristle_stretch(s)
    elif s.bearing_limit > 0.0 and s.bearing_mode != 0:
        s.bristle = s.q - s.bearing_mode * s.presliding
    elif s.bearing_limit <= 0.0:
        s.bristle = s.q


@part
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


@part
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
