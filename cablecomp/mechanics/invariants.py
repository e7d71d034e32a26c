"""What every state of a joint obeys: the laws that a committed step may never break, verified by other code
than the kernel's.

For tests, for a snapshot that is taken up, and for whoever doubts a state; far too slow for the loop.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.drive import Drive
from cablecomp.mechanics.piece import piece
from cablecomp.mechanics.profile import LEAST_WRAP, Floats, Ints
from cablecomp.mechanics.records import IN, OUT, WET_NODES
from cablecomp.mechanics.tables import ELSEWHERE, HEAD, MODE, PLAIN, groove

ROOM = 4  # points that a step may need beyond those it leaves behind
STEEP = 1e-9  # of v, by which rounding may pass the friction cone
RELATIVE = 1e-9  # of running integrals
AGREE_RAD = 1e-6  # between wrap angles and shafts


def heights_fit(model: Model, heights: NDArray[np.float64] | Ints) -> bool:
    """True if every profile has at least its two ends and fits its array with room for a step."""
    most = int(model.named(model.memory, model.heights).size.capacity) - ROOM
    return bool(np.all((heights >= 2) & (heights <= most) & (heights == np.floor(heights))))


def violations(model: Model, memory: Floats, heights: Ints) -> list[str]:
    """Every invariant of a joint's committed state `memory`, `heights` breaks, in words; empty = sound.

    Profiles (`profile_violations`); wrap angles that agree with the shafts; finite scalars; positive tensions
    and factors.
    """
    found = profile_violations(model, memory, heights)
    if not heights_fit(model, heights):
        return found
    d = model.named(memory, heights)
    return found + _scalar_violations(d, memory) + _angle_violations(d)


def profile_violations(model: Model, memory: Floats, heights: Ints) -> list[str]:
    """The same for the profiles alone.

    Count between 2 and capacity - 4; angles from 0 on, rising; |dv| <= mu dsigma between neighbours (thesis
    2-11); finite tensions; running integrals of strain and of its error that belong to the points; error bounds >= 0.
    """
    d = model.named(memory, heights)
    if not heights_fit(model, heights):
        return [f"profile lengths {heights.tolist()} in room for {d.size.capacity}"]
    found = []
    for stack in range(d.size.stacks):
        found += [f"profile {stack}: {words}" for words in _profile(model, d, stack)]
    return found


def _profile(model: Model, d: Drive, stack: int) -> list[str]:
    points = d.profiles[stack, : d.heights[stack]]
    wraps = 2 * int(d.size.cables)
    guide = stack >= wraps
    cable, end = d.cables[stack - wraps if guide else stack // 2], stack % 2
    if not np.all(np.isfinite(points.view("f8"))):
        return ["a number is not finite"]
    y, v = points["y"], points["v"]
    if y[0] != 0.0 or np.any(np.diff(y) <= 0.0):
        return [f"angles do not rise from 0: {y.tolist()}"]
    if np.any(points["merged"] < 0.0) or (
        model.laws is None and np.any(np.diff(points["stretch_error"]) < 0.0)
    ):
        return ["a bound on the error of merging is negative"]
    if guide and abs(y[-1] - cable.guide) > AGREE_RAD:
        return [f"its guide is {y[-1]} wide instead of {cable.guide}"]
    law = ELSEWHERE if guide else int(cable.law[end])
    mu = 1.0 if guide else float(cable.mu[end])
    over = float(np.max(np.abs(np.diff(v)) - mu * np.diff(_sigma(model, law, y))))
    found = [f"is steeper than friction holds, by {over:g}"] if over > STEEP else []
    parts = _integrals(model, law, y, v)
    scale = RELATIVE * (float(np.sum(np.abs(parts))) + float(y[-1]))
    miss = float(np.max(np.abs(np.diff(points["stretch"]) - parts)))
    if points["stretch"][0] != 0.0 or miss > scale:
        found.append(f"its running integral is off by {miss:g}")
    if (model.laws is None or guide) and float(np.max(np.abs(points["tau"] / np.exp(v) - 1.0))) > RELATIVE:
        found.append("its tensions are not exp(v)")
    return found


def _integrals(model: Model, law: int, y: Floats, v: Floats) -> Floats:
    """Integral of e over every piece: in closed form for the plain law, else by the kernel's own quadrature,
    which defines it."""
    dy, d = np.diff(y), np.diff(v)
    if model.laws is None or model.laws[law, HEAD, MODE] == PLAIN:
        small = np.abs(d) < 1e-9
        mean = np.where(small, 1.0 - 0.5 * d, -np.expm1(-d) / np.where(small, 1.0, d))
        return np.asarray(dy * (np.exp(v[1:]) * mean - 1.0))
    ends = list(zip(y.tolist(), v.tolist(), np.exp(v).tolist(), strict=True))
    return np.array([piece(model.laws, law, *near, *far)[0] for near, far in pairwise(ends)])


def _sigma(model: Model, law: int, y: Floats) -> Floats:
    """Groove coordinate of the angles y."""
    return np.array([groove(model.laws, law, float(a)) for a in y])


def _scalar_violations(d: Drive, memory: Floats) -> list[str]:
    found: list[str] = []
    for c, state in enumerate(d.states):
        if not np.all(np.isfinite(state.tolist())):
            found.append(f"cable {c}: a number is not finite")
        for value, what in (
            (state.tension, "tension"),
            (state.tension_in, "tension at the input drum"),
            (state.pretension, "pretension factor"),
            (state.stiffness, "stiffness factor"),
        ):
            if not value > 0.0:
                found.append(f"cable {c}: {what} {value:g}")
    x = d.context
    # not what a recording may lack (tensions before the first solution, temperature, further channels)
    needed = [
        x.time,
        x.motor,
        x.motor_old,
        x.joint,
        x.joint_old,
        x.load,
        x.moment,
        x.moment_slope,
        x.length_h,
        x.length_l,
    ]
    needed += [x.pretension_h, x.pretension_l, x.stiffness_h, x.stiffness_l, x.reading, x.compliance, x.rigid]
    if not np.all(np.isfinite([*needed, x.motor_moment])):
        found.append("the context holds a number that is not finite")
    if not np.all(np.isfinite(memory[d.size.filter_at : d.size.steps_at])):
        found.append("the filter's, a term's or a grid's state is not finite")
    # behind a guide the input drum has no use for its grid
    guided = d.size.stacks > 2 * d.size.cables
    for wrap, grid in list(enumerate(d.grids))[:: 2 if guided else 1]:
        if not (1.0 <= grid.count <= WET_NODES and grid.end > 0.0):
            found.append(f"grid {wrap}: {grid.count:g} nodes, end tension {grid.end:g}")
        elif not np.all(grid.tau[: int(grid.count)] > 0.0):
            found.append(f"grid {wrap}: a tension is not positive")
    return found


def _angle_violations(d: Drive) -> list[str]:
    """Wraps that do not end where their shafts stand."""
    found: list[str] = []
    if d.context.first or d.size.grids > 0:
        return found
    begin, last = d.circuits[0], d.circuits[-1]
    for chain in range(last.chains):
        c = last.first[chain] + last.count - 1
        cable = d.cables[c]
        _agree(found, d, 2 * c + OUT, cable.wrap[OUT] + cable.sign * d.context.joint)
        c = begin.first[chain]
        cable = d.cables[c]
        _agree(found, d, 2 * c + IN, cable.wrap[IN] - cable.sign * d.context.motor)
    return found


def _agree(found: list[str], d: Drive, stack: int, expected: float) -> None:
    wrap = float(d.profiles[stack, d.heights[stack] - 1].y)
    if not wrap > LEAST_WRAP or not math.isclose(wrap, expected, rel_tol=0.0, abs_tol=AGREE_RAD):
        found.append(f"profile {stack}: ends at {wrap} rad, its shafts say {expected}")
