"""What the compiled plant works on: node arrays and records of cables, shafts, couplings, surroundings."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firmware_sim.plant.columns import N_INPUTS

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]
Words = NDArray[np.int64]

FREE, OUT, IN, GUIDE = 0, 1, 2, 3  # where a node lies: span, output drum, input drum, fixed guide

# One cable from its termination on the output drum (path coordinate 0) to that on the input drum.
CABLE = np.dtype(
    [
        ("index", "i8"),  # among the cables
        ("first", "i8"),  # index of the first node
        ("count", "i8"),  # number of nodes
        ("shaft_out", "i8"),
        ("shaft_in", "i8"),
        ("side", "i8"),  # 0: cable h, 1: cable l
        ("sign", "f8"),  # +1: +q_out winds it on (cable h), -1: cable l
        # geometry
        ("R", "f8"),
        ("r", "f8"),
        ("wrap_out", "f8"),  # rad at position zero
        ("wrap_in", "f8"),
        ("free_m", "f8"),
        ("runout_m", "f8"),  # eccentricity of the output pulley
        ("runout_phase", "f8"),
        ("runout_order", "f8"),  # periods per turn
        ("in_runout_m", "f8"),
        ("in_runout_phase", "f8"),
        ("climb_m_per_rad", "f8"),  # growth of the output radius with angle,
        ("climb_beyond", "i8"),  # 1: beyond `climb_from` alone
        ("climb_from", "f8"),  # rad
        # cable
        ("EA", "f8"),
        ("EA_whole", "f8"),  # before any wire broke
        ("T0", "f8"),
        ("stiffening", "f8"),
        ("tabled", "i8"),  # 1: tension by `Drive.tensile`
        ("slack_ratio", "f8"),  # stiffness of a slack element over EA (regularisation)
        # friction
        ("mu_out", "f8"),
        ("mu_in", "f8"),
        ("guide_mu_per_m", "f8"),
        ("guide_arc_m", "f8"),  # of all guides
        ("guide_count", "i8"),
        (
            "guide_first",
            "f8",
        ),  # share of the free length before the first guide; the rest is shared out evenly
        ("viscous_out", "f8"),  # N s/m per metre of arc
        ("viscous_in", "f8"),
        ("viscous_guide", "f8"),
        ("guide_hold_N", "f8"),  # friction of all guides that the tension does not add to
        ("drag_exponent", "f8"),  # viscous force grows with this power of the slip speed (0: as its arsinh),
        ("drag_speed", "f8"),  # m/s, and is the linear one at this speed
        ("strengthening", "f8"),  # Coulomb force grows by this times arsinh of slip speed over `drag_speed`
        ("pressure_exponent", "f8"),
        ("pressure_kind", "i8"),  # which law of contact pressure
        ("pressure_floor", "f8"),
        ("groove_amplitude", "f8"),
        ("groove_phase", "f8"),
        ("grooved", "i8"),  # 1: factors by place on either drum in `Drive.grooves`
        ("grain", "f8"),  # how much more of that is felt sliding towards the input than the other way
        ("mu_scale", "f8"),  # time-varying factor on every coefficient,
        ("guide_scale", "f8"),  # and on those of guides
        # length budget
        ("plays", "i8"),  # slots of `Drive.plays` in use
        ("released_m", "f8"),  # length let go into the free span
        ("overload_N", "f8"),  # tension above which the clamp creeps,
        ("overload_rate", "f8"),  # m/(N s)
        ("crept_m", "f8"),  # state
        ("end_shift_m", "f8"),  # displacement of the output termination towards the span
        ("eigenstrain", "f8"),  # thermal strain and creep
        ("force_tol", "f8"),  # N, below which forces count as equal (rounding of positions)
        # state of the present step
        ("A", "f8"),  # m, arc on the output drum
        ("Y", "f8"),  # m, whole path
        ("A_old", "f8"),
        ("Y_old", "f8"),
        ("ext", "f8"),  # m, extension of the lumped element
        ("ext_new", "f8"),
        ("lead_out", "f8"),  # m/rad, dA/dq_out
        ("lead_in", "f8"),
        ("i_out", "i8"),  # last node that touches the output drum
        ("i_in", "i8"),  # first node that touches the input drum
        ("T_out", "f8"),
        ("T_in", "f8"),
        ("dT_out", "f8"),  # change of T_out by the solve alone, then per dY, per dA
        ("dT_out_dY", "f8"),
        ("dT_out_dA", "f8"),
        ("dT_in", "f8"),
        ("dT_in_dY", "f8"),
        ("dT_in_dA", "f8"),
    ]
)

SHAFT = np.dtype(
    [
        ("q", "f8"),
        ("q_1", "f8"),  # previous step
        ("q_2", "f8"),
        ("v", "f8"),
        ("v_1", "f8"),
        ("v_2", "f8"),
        ("a", "f8"),
        ("prescribed", "i8"),
        ("inertia", "f8"),
        ("viscous", "f8"),
        ("coulomb_Nm", "f8"),
        ("coulomb_more_Nm", "f8"),  # what that gains at present
        ("friction_kind", "i8"),  # 0: spring that yields, 1: Dahl, 2: LuGre
        ("coulomb_skew", "f8"),  # more friction turning forward than backward, over their mean
        ("stribeck_gain", "f8"),  # static over sliding friction, less one
        ("stribeck_speed", "f8"),  # rad/s
        ("bristle_damping", "f8"),  # N·m·s/rad
        ("load_coefficient", "f8"),  # friction torque per N·m of radial cable load R (T_h + T_l)
        ("presliding", "f8"),  # rad
        ("bristle", "f8"),  # rad, anchor of the presliding spring
        ("bearing_mode", "i8"),
        ("bearing_limit", "f8"),
        ("gravity_Nm", "f8"),
        ("gravity_phase", "f8"),
        ("gravity_second", "f8"),  # second harmonic over the first
        ("gravity_second_phase", "f8"),
        ("tilt", "f8"),  # rad, turn of the weight's direction at present
        ("lean", "f8"),  # share of the weight that does not turn the shaft at present
        ("inertia_swing", "f8"),  # J (1 + swing cos(q − phase))
        ("inertia_phase", "f8"),
        ("spring_Nm", "f8"),  # saturation torque of a parallel spring
        ("spring_rate", "f8"),  # N·m/rad
        ("wall_stiffness", "f8"),
        ("wall_loss", "f8"),  # s/rad
        ("wall_at", "f8"),
        ("preload_Nm", "f8"),  # constant torque along +q, scaled by the pretension factor
        ("external_Nm", "f8"),
        ("load_Nm", "f8"),  # result: torque that reaches the cables, bearing friction not yet taken off
        ("contact_Nm", "f8"),
        ("cable_Nm", "f8"),  # result: torque of all cables on the shaft
        ("radial_Nm", "f8"),  # result: sum of R T over the shaft's cables
    ]
)

COUPLING = np.dtype(
    [
        ("a", "i8"),
        ("b", "i8"),
        ("stiffness", "f8"),
        ("damping", "f8"),
        ("gap", "f8"),  # rad, total clearance
        ("flank_loss", "f8"),  # s/rad, of flanks with clearance
        ("torque_Nm", "f8"),  # result: on shaft a, along +q
    ]
)

# Effects that follow time, temperature or another channel, and the time stepper's own memory.
SURROUND = np.dtype(
    [
        ("load_shaft", "i8"),  # where the external moment acts
        ("output_shaft", "i8"),
        ("start_s", "f8"),
        ("relax_fraction", "f8"),
        ("relax_time_s", "f8"),
        ("thermal_per_K", "f8"),
        ("thermal_ref", "f8"),
        ("mu_per_K", "f8"),
        ("mu_ref", "f8"),
        ("slip_m", "f8"),
        ("slip_time_s", "f8"),
        ("slip_behind_wrap", "f8"),
        ("break_fraction", "f8"),
        ("break_time_s", "f8"),
        ("crosstalk", "f8"),
        ("ageing_gain", "f8"),
        ("ageing_count", "f8"),
        ("reversals", "f8"),
        ("load_direction", "f8"),
        ("load_turn", "f8"),
        ("h_prev", "f8"),
        ("iterations", "i8"),
        ("failures", "i8"),
        ("is_open", "i8"),
    ]
)


# A stretch of a cable's free span that follows the tension through a play: (compliance · (play − zero)), or less and
# less of it, never more than compliance · seats.
PLAY = np.dtype(
    [
        ("compliance", "f8"),  # m/N
        ("radius", "f8"),  # N
        ("share", "f8"),  # of the tension, adds to the radius
        ("time_s", "f8"),  # how long it takes to yield
        ("rounded", "i8"),  # 1: it yields little by little, as Bouc and Wen have it
        ("seats", "f8"),  # N; 0: it goes on in proportion
        ("value", "f8"),  # N, state
        ("zero", "f8"),  # N
        ("tension", "f8"),  # N, state of one that is rounded
    ]
)
PLAYS = 6  # slots per cable

GROOVE_LOW, GROOVE_STEP, GROOVE_POINTS = -60.0, 0.05, 2401  # rad of joint or motor angle
TENSILE_LOW, TENSILE_STEP, TENSILE_POINTS = -2.0, 0.02, 601  # strain over that of the pretension


class Nodes(NamedTuple):
    """Per-node and per-element arrays, all cables one after another; element e joins nodes e and e+1."""

    y: Floats  # m, path coordinate from the output termination
    old: Floats  # m, at the start of the step
    l0: Floats  # m, unstressed length of element e
    tension: Floats  # N, of element e
    slope: Floats  # N/m, dT/dy of element e
    grip: Floats  # friction force over mean tension at which the node slides
    drag: Floats  # N/m, viscous force per slip of this step
    alpha: Floats  # solution: change of y by itself,
    beta: Floats  # per change of path length,
    gamma: Floats  # per change of arc on the output drum
    upper: Floats  # elimination work space
    burr: Floats  # share by which the grip differs with the direction of sliding
    hold: Floats  # N, friction that the tension does not add to
    mode: Codes  # -1, +1: slides that way; 0: sticks
    where: Codes  # FREE, OUT, IN, GUIDE
    saved_mode: Codes
    kept: Codes  # where, while contacts are kept


class Drive(NamedTuple):
    """Everything that one joint consists of, parameters and state; records are numpy structured arrays."""

    cables: Any
    shafts: Any
    couplings: Any
    surround: Any
    nodes: Nodes
    plays: Any  # (cables, PLAYS)
    grooves: Floats  # (2 cables, GROOVE_POINTS): factor of mu on the output drum, then on the input drum
    tensile: Floats  # (2, TENSILE_POINTS): T/T0 and its slope over strain · EA/T0
    words: tuple[Words, ...]  # all records and the nodes' y, word by word: copied as they lie
    saved: tuple[Words, ...]
    matrix: Floats
    rhs: Floats
    between: Floats  # inputs between two samples


def allocate_nodes(total: int) -> Nodes:
    """Zeroed arrays for `total` nodes."""
    f = [np.zeros(total) for _ in range(13)]
    c = [np.zeros(total, dtype=np.int8) for _ in range(4)]
    return Nodes._make((*f, *c))


def make_drive(
    cables: Any,
    shafts: Any,
    couplings: Any,
    surround: Any,
    nodes: Nodes,
    plays: Any,
    grooves: Floats,
    tensile: Floats,
) -> Drive:
    """Bind records, tables and nodes, with room to step back to the start of a step."""
    n = len(shafts)
    words = tuple(
        part.view(np.int64).ravel() for part in (plays, cables, shafts, couplings, surround, nodes.y)
    )
    return Drive(
        cables,
        shafts,
        couplings,
        surround,
        nodes,
        plays,
        grooves,
        tensile,
        words,
        tuple(part.copy() for part in words),
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros(N_INPUTS),
    )
