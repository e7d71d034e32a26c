"""What the compiled kernel works on, by name: records of the joint, its cables, their wraps. All numbers in SI units.

A joint's arrays are flat (`drive.py` finds the records in them): a snapshot is a copy, and a call from Python is cheap.
Every field takes 8 bytes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

OUT, IN = 0, 1  # the two drums of a cable: on the output pulley, on the input pulley
WET_NODES = 96  # grid nodes of a drum with viscous slip
PLAYS = 5  # plays of a span whose wires yield one after the other


def record(fields: list[Any]) -> np.dtype[Any]:
    """A record type whose fields are attributes, in compiled code and in Python alike."""
    return np.dtype((np.record, fields))


def floats(record: np.dtype[Any]) -> int:
    """Number of places that a record takes in a flat array."""
    return record.itemsize // 8


# How much there is of everything, and where it begins in the flat arrays.
SIZES = record(
    [
        ("circuits", "i8"),  # number of circuits in series
        ("cables", "i8"),
        ("stacks", "i8"),  # profiles: two wraps per cable, then one per guide
        ("terms", "i8"),
        ("capacity", "i8"),  # points that a profile has room for
        ("grids", "i8"),  # drums with viscous slip: all or none
        ("spans", "i8"),  # cables whose wires yield one after the other: all or none
        ("guides", "i8"),  # cables with a guide in their span: all or none
        # in `fixed`: circuits, then
        ("cables_at", "i8"),
        ("sensor_at", "i8"),  # behind the terms' parameters
        # in `memory`: states of the cables, then
        ("context_at", "i8"),
        ("filter_at", "i8"),  # the terms' own states follow
        ("grids_at", "i8"),
        ("plays_at", "i8"),
        ("steps_at", "i8"),  # all that a refused sample puts back lies before
        ("guides_at", "i8"),
        ("profiles_at", "i8"),
        ("spare_at", "i8"),  # room for an undo copy
    ]
)

# A circuit: one chain of cables (open) or two antagonistic ones (closed).
CIRCUIT = record(
    [
        ("first", "i8", (2,)),  # first cable of chain h, of chain l
        ("count", "i8"),  # cables in a chain
        ("chains", "i8"),  # 1 = open, 2 = closed
        ("ratio", "f8"),  # product of r/R
        ("share", "f8"),  # of the joint's moment that this circuit carries, N_ik of the thesis (5-22)
        ("radius", "f8"),  # of the output pulley
        ("slack", "f8"),  # tension below which a cable counts as slack
    ]
)

# A cable, what never changes; pairs are for its drums OUT and IN.
CABLE = record(
    [
        ("radius", "f8", (2,)),
        ("mu", "f8", (2,)),
        ("wrap", "f8", (2,)),  # wrap angle at position zero
        ("law", "i8", (2,)),  # its law tables: ELSEWHERE, ON_H, ON_L, IN_H, IN_L
        ("length", "f8"),  # of the free span
        ("EA", "f8"),
        ("T0", "f8"),
        ("scale", "f8"),  # tension over that of the chain's output cable
        ("weight", "f8"),  # rotation of the chain's output per stretch
        ("sign", "f8"),  # +1: +q_out winds it on (chain h), -1: chain l
        ("ratio", "f8"),  # r/R of its stage
        ("guide", "f8"),  # friction angle of a guide in the span, mu times wrap
        ("guide_length", "f8"),
        ("guide_place", "f8"),  # share of the free span between output drum and guide
        ("play_share", "f8"),  # of the span's compliance that follows through a play
        ("play_yield", "f8"),  # radius of that play, N
        ("play_time", "f8"),  # in which it yields, s
        ("play_spread", "f8"),  # of `PLAYS` radii about that one, over it; 0: one play
        ("play_grading", "f8"),  # power by which the radii grow from the least to the greatest; 1: evenly
        ("play_pressed", "f8"),  # share of a radius that grows with the tension
        ("viscous", "f8"),  # N s/m per rad
        ("viscous_on", "f8", (2,)),  # what of that each drum has
        ("merge", "f8"),  # error of v that merging of pieces may leave
        ("per_breaking", "f8"),  # 1/breaking force, 0 where none is stated
    ]
)

# The sensors' part: the load channel's gain and offset, the input filter's angular frequency (0 = off).
SENSOR = record(
    [
        ("gain", "f8"),
        ("offset", "f8"),
        ("cutoff", "f8"),
    ]
)

# A term of further physics: its compiled function, where its parameters lie in `fixed`, its state in `memory`, and what
# of that need not be kept for a refused sample (`effects.base.term`).
TERM = record(
    [
        ("address", "i8"),
        ("parameters_at", "i8"),
        ("state_at", "i8"),
        ("ring_at", "i8"),
        ("end_at", "i8"),
    ]
)

# A cable as it stands; `_try`: pending, of the solution at hand.
STATE = record(
    [
        ("tension", "f8"),  # at the output drum
        ("tension_in", "f8"),  # at the input drum
        ("stretch", "f8"),
        ("compliance", "f8"),  # its derivative by the tension, m/N
        ("shaft", "f8"),  # angle of the shaft at its output
        ("play", "f8"),  # N, of the free span's play
        ("play_try", "f8"),
        ("pretension", "f8"),  # factor on T0
        ("stiffness", "f8"),  # factor on EA
        ("offset", "f8"),  # length wound up between the drums
        ("error", "f8"),  # bound on the error of the stretch that merging made
        ("unloaded", "f8"),  # warm start of a closed circuit: T_l + share M/R, its tension without load,
        (
            "share",
            "f8",
        ),  # and the share of a load that eases it; with guides: of a stage's pull what follows before
        ("side", "f8"),  # with a guide: stretch of the input side,
        ("guide_end", "f8"),  # end values of the guide,
        ("guide_far", "f8"),
        ("guide_follow", "f8"),  # how far the near one followed the far one, to begin the next solution with,
        ("shaft_in", "f8"),  # input shaft
        ("side_try", "f8"),
        ("guide_try", "f8"),
        ("shaft_in_try", "f8"),
        ("miss", "f8"),  # what the solver's first guess will miss, as it missed last time
        ("miss_old", "f8"),
    ]
)

# A point of a tension profile, the first at the termination, the last where the cable leaves (`profile.py`).
POINT = record(
    [
        ("y", "f8"),  # angle from the termination, fixed to the drum
        ("v", "f8"),  # ln(T/T0)
        ("stretch", "f8"),  # integral of strain EA/T0 from the termination
        ("merged", "f8"),  # bound on the error of v that merging left in the piece below
        ("stretch_error", "f8"),  # integral of merged tau: bound on the error of stretch
        ("tau", "f8"),  # exp(v)
    ]
)

# A wrap's pending step (no state: every solution writes it anew).
STEP = record(
    [
        ("total", "f8"),  # integral of strain EA/T0 over the wrap
        ("kept", "f8"),  # last point of the profile that is kept,
        ("y", "f8"),  # and the point where the cone meets the profile
        ("v", "f8"),
        ("stretch", "f8"),
        ("stretch_error", "f8"),
        ("tau", "f8"),
        ("w", "f8"),  # wrap angle
        ("end_v", "f8"),  # v at the departure point
        ("end_tau", "f8"),
    ]
)

# A cable's guide as it was last evaluated, and the pull that its stage is tried with (no state; `stages.py`).
GUIDE = record(
    [
        ("by_tension", "f8"),  # derivative of the tension at the input drum by that at the output drum,
        ("by_in", "f8"),  # by the input shaft's angle, N/rad
        ("stretch_by_in", "f8"),  # of the cable's stretch by the input shaft's angle, m/rad,
        ("stretch_by_out", "f8"),  # by the output shaft's
        ("pull", "f8"),  # N, at the output drum
        ("step", "f8"),  # of it, by what the next stage's does not change
        ("low", "f8"),  # bracket of the pull
        ("high", "f8"),
    ]
)

# The causal filter of the inputs: 1 once started; value and slope of the motor angle and of the load.
FILTER = record(
    [
        ("started", "f8"),
        ("motor", "f8"),
        ("motor_slope", "f8"),
        ("load", "f8"),
        ("load_slope", "f8"),
    ]
)

# One of the plays of a free span: N; `_try`: pending.
PLAY = record(
    [
        ("rest", "f8"),
        ("rest_try", "f8"),
    ]
)

# A drum with viscous slip: T/T0 on a grid fixed to the drum; `_try`: pending.
GRID = record(
    [
        ("step", "f8"),  # rad between nodes
        ("count", "f8"),  # nodes in use
        ("angle", "f8"),  # wrap angle
        ("end", "f8"),  # T/T0 at the departure point
        ("count_try", "f8"),
        ("angle_try", "f8"),
        ("end_try", "f8"),
        ("time_try", "f8"),
        (
            "rate_try",
            "f8",
        ),  # rad^2 that stretch diffused in that step; negative: `upper` may be of other faces than slip now
        ("first_try", "f8"),  # the deepest node that moved; count_try if none did
        ("total_try", "f8"),  # integral of T/T0 - 1 over the nodes
        ("tau", "f8", (WET_NODES,)),
        ("tau_try", "f8", (WET_NODES,)),
        ("upper", "f8", (WET_NODES,)),  # elimination: upper diagonal,
        ("right", "f8", (WET_NODES,)),  # right-hand side, then the solution
    ]
)

OTHERS = 4  # further channels that terms can read

# What the terms of further physics read and add to.
CONTEXT = record(
    [
        # this sample's readings, and what is known of the last one's
        ("time", "f8"),
        ("dt", "f8"),  # since the last sample
        ("first", "f8"),  # 1 until a sample has been committed
        ("commit", "f8"),  # 1 while a solution is about to become the state
        ("motor", "f8"),  # angle of the input pulley
        ("motor_old", "f8"),
        ("joint", "f8"),  # angle of the output pulley, as solved so far
        ("joint_old", "f8"),
        ("joint_older", "f8"),
        ("load", "f8"),  # external moment on the output pulley
        ("load_old", "f8"),
        ("tension_h", "f8"),  # at the output pulley; NaN before the first solution
        ("tension_l", "f8"),  # NaN in an open circuit
        ("radius", "f8"),  # of the output pulley
        ("temperature", "f8"),  # degC; NaN if not measured
        ("motor_rate", "f8"),  # speed of the input pulley where it is known beside the samples, else NaN
        ("other", "f8", (OTHERS,)),  # further channels; NaN if not measured
        # what terms add to (sums start at 0, factors at 1)
        ("moment", "f8"),  # taken out of the load path at the output pulley
        ("moment_slope", "f8"),  # its derivative by the joint angle
        ("length_h", "f8"),  # of cable wound up between drums
        ("length_l", "f8"),
        ("pretension_h", "f8"),  # factor
        ("pretension_l", "f8"),
        ("stiffness_h", "f8"),  # factor
        ("stiffness_l", "f8"),
        ("reading", "f8"),  # of the joint encoder, beyond the joint's angle
        # the kernel's own
        ("compliance", "f8"),  # rad/(N m), of the last solution
        ("rigid", "f8"),  # product of r/R over all stages
        # terms add here too
        ("motor_moment", "f8"),  # between the motor's torque sensor and the cable
        ("stiffness_follows", "f8"),  # 1 once a term's factor of stiffness has followed the joint's angle
        ("lengths_follow", "f8"),  # 1 once a term's length has
        ("moment_follows", "f8"),  # 1 once a term's moment has
    ]
)
