"""A joint by name: the records that lie in the kernel's flat arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

from cablecomp.mechanics.jit import inlined_kernel
from cablecomp.mechanics.profile import ROWS, Floats, Ints
from cablecomp.mechanics.records import (
    CABLE,
    CIRCUIT,
    CONTEXT,
    FILTER,
    GRID,
    SENSOR,
    SIZES,
    STATE,
    STEP,
    TERM,
    floats,
)

N_SIZES, N_SENSOR, N_CABLE = floats(SIZES), floats(SENSOR), floats(CABLE)
N_CONTEXT, N_FILTER, N_GRID = floats(CONTEXT), floats(FILTER), floats(GRID)


class Drive(NamedTuple):
    """Records of one joint, named as in `records.py`; they lie in its arrays, so writing to them writes there."""

    size: Any
    sensor: Any
    context: Any
    filter: Any
    circuits: Any
    cables: Any
    states: Any  # by cable
    steps: Any  # by wrap: 2c is cable c's drum OUT, 2c + 1 its drum IN
    grids: Any  # by wrap, where slip is viscous
    profiles: Floats  # [stack, row, point] (`profile.py`): the wraps, then the guides
    heights: Ints  # points in use, by stack


class Terms(NamedTuple):
    """Compiled terms, and the arrays that they work on."""

    calls: Any
    parameters: Floats
    memory: Floats


def named(P: Floats, I: Ints, S: Floats, J: Ints) -> Drive:
    """The records in a joint's arrays."""
    size = I[:N_SIZES].view(SIZES)[0]
    return Drive(
        size,
        P[size.sensor_at : size.sensor_at + N_SENSOR].view(SENSOR)[0],
        S[size.context_at : size.context_at + N_CONTEXT].view(CONTEXT)[0],
        S[size.filter_at : size.filter_at + N_FILTER].view(FILTER)[0],
        P[: size.cables_at].view(CIRCUIT),
        P[size.cables_at : size.cables_at + size.cables * N_CABLE].view(CABLE),
        S[: size.context_at].view(STATE),
        S[size.steps_at : size.profiles_at].view(STEP),
        S[size.grids_at : size.grids_at + size.grids * N_GRID].view(GRID),
        S[size.profiles_at : size.spare_at].reshape((size.stacks, ROWS, size.capacity)),
        J,
    )


def _terms(P: Floats, I: Ints, S: Floats) -> Terms:
    return Terms(I[N_SIZES:].view(TERM), P, S)


drive = inlined_kernel(named)
terms_of = inlined_kernel(_terms)
