"""A joint by name: the records that lie in the kernel's flat arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

from cablecomp.mechanics.jit import inlined_kernel
from cablecomp.mechanics.profile import Floats, Ints, Points
from cablecomp.mechanics.records import (
    CABLE,
    CIRCUIT,
    CONTEXT,
    FILTER,
    GRID,
    POINT,
    SENSOR,
    SIZES,
    STATE,
    STEP,
    TERM,
    floats,
)

N_SIZES, N_SENSOR, N_CABLE = floats(SIZES), floats(SENSOR), floats(CABLE)
N_CONTEXT, N_FILTER, N_GRID = floats(CONTEXT), floats(FILTER), floats(GRID)


class Arrays(NamedTuple):
    """The flat arrays of one joint (`assemble.Model`), as compiled code and what it calls hand them on."""

    fixed: Floats
    layout: Ints
    memory: Floats
    heights: Ints
    laws: Floats


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
    profiles: Points  # [stack, point] (`profile.py`): the wraps, then the guides
    heights: Ints  # points in use, by stack


class Terms(NamedTuple):
    """Compiled terms, and the arrays that they work on."""

    calls: Any
    parameters: Floats
    memory: Floats


def named(fixed: Floats, layout: Ints, memory: Floats, heights: Ints) -> Drive:
    """The records in a joint's arrays (`assemble.Model`).

    Kernels that Python calls for every sample take the flat arrays one by one: a tuple of them (`Arrays`) would cost
    1.5 us a call to recognise. The law tables go beside them, as the compiler leaves out what a plain drive does not
    need by an argument that is None.
    """
    size = layout[:N_SIZES].view(SIZES)[0]
    return Drive(
        size,
        fixed[size.sensor_at : size.sensor_at + N_SENSOR].view(SENSOR)[0],
        memory[size.context_at : size.context_at + N_CONTEXT].view(CONTEXT)[0],
        memory[size.filter_at : size.filter_at + N_FILTER].view(FILTER)[0],
        fixed[: size.cables_at].view(CIRCUIT),
        fixed[size.cables_at : size.cables_at + size.cables * N_CABLE].view(CABLE),
        memory[: size.context_at].view(STATE),
        memory[size.steps_at : size.profiles_at].view(STEP),
        memory[size.grids_at : size.grids_at + size.grids * N_GRID].view(GRID),
        memory[size.profiles_at : size.spare_at].view(POINT).reshape((size.stacks, size.capacity)),
        heights,
    )


def _terms(fixed: Floats, layout: Ints, memory: Floats) -> Terms:
    return Terms(layout[N_SIZES:].view(TERM), fixed, memory)


drive = inlined_kernel(named)
terms_of = inlined_kernel(_terms)
