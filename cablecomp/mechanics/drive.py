"""A joint by name: the records that lie in the kernel's flat arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

from cablecomp.mechanics.flat import records
from cablecomp.mechanics.jit import inlined_kernel
from cablecomp.mechanics.profile import Floats, Ints, Points
from cablecomp.mechanics.records import (
    CABLE,
    CIRCUIT,
    CONTEXT,
    FILTER,
    GRID,
    GUIDE,
    PLAY,
    PLAYS,
    POINT,
    SENSOR,
    SIZES,
    STATE,
    STEP,
    TERM,
    floats,
)

N_SIZES = floats(SIZES)


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
    plays: Any  # [cable, play], where wires yield one after the other
    guides: Any  # by cable, where there are guides
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
    size = records(layout, 0, (1,), SIZES)[0]
    return Drive(
        size,
        records(fixed, size.sensor_at, (1,), SENSOR)[0],
        records(memory, size.context_at, (1,), CONTEXT)[0],
        records(memory, size.filter_at, (1,), FILTER)[0],
        records(fixed, 0, (size.circuits,), CIRCUIT),
        records(fixed, size.cables_at, (size.cables,), CABLE),
        records(memory, 0, (size.cables,), STATE),
        records(memory, size.steps_at, (2 * size.cables,), STEP),
        records(memory, size.grids_at, (size.grids,), GRID),
        records(memory, size.plays_at, (size.spans, PLAYS), PLAY),
        records(memory, size.guides_at, (size.guides,), GUIDE),
        records(memory, size.profiles_at, (size.stacks, size.capacity), POINT),
        heights,
    )


def _terms(fixed: Floats, layout: Ints, memory: Floats) -> Terms:
    size = records(layout, 0, (1,), SIZES)[0]
    return Terms(records(layout, N_SIZES, (size.terms,), TERM), fixed, memory)


drive = inlined_kernel(named)
terms_of = inlined_kernel(_terms)
