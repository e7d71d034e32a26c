"""Backlash in other forms: a greased gap, a link that drags when unloaded, two clearances, three, a key on springs,
one that wedges in its taper, one that has worn its way where the joint mostly stands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import PATH, PULLEY, Q_OUT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.records import Floats

_GAP = Parameter("gap_rad", "b, total clearance", low=0.0, high=0.5, neutral=0.0)


def squeezed(time: Floats, path: Floats, gap: float, damping: float) -> Floats:
    """Where the key stands in a greased gap: d ẋ = M between −b/2 and +b/2, at first where M presses it."""
    half, x = 0.5 * gap, 0.5 * gap * float(np.sign(path[0]))
    result = np.empty_like(path)
    result[0] = x
    way = 0.5 * (path[1:] + path[:-1]) * np.diff(time) / damping
    for k, step in enumerate(way.tolist(), start=1):
        x = min(max(x + step, -half), half)
        result[k] = x
    return result


def _greased(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += squeezed(
            inputs[:, TIME], outputs[:, PATH], p["gap_rad"], p["damping_Nms_per_rad"]
        )

    build.mounts.append(shift)


GREASED = form(
    "termination_backlash",
    "greased",
    "A gap full of grease: the key crosses it at the speed M/d, and lies on a flank only then.",
    (_GAP, Parameter("damping_Nms_per_rad", "d", low=1e-9)),
    ("load", "load_rate"),
    _greased,
)


def dragged(path: Floats, pulley: Floats, gap: float, drag: float) -> Floats:
    """Where a link stands in its gap that friction holds still while |M| is less than that."""
    half, x = 0.5 * gap, 0.5 * gap * float(np.sign(path[0]))
    result = np.empty_like(path)
    turns = np.concatenate([[0.0], np.diff(pulley)])
    for k, (m, turn) in enumerate(zip(path.tolist(), turns.tolist(), strict=True)):
        x = min(max(x - turn, -half), half) if abs(m) < drag else (half if m > 0.0 else -half)
        result[k] = x
    return result


def _dragging(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += dragged(outputs[:, PATH], outputs[:, PULLEY], p["gap_rad"], p["drag_Nm"])

    build.mounts.append(shift)


DRAGGING = form(
    "termination_backlash",
    "dragging_link",
    "A link that drags: while |M| is below its own friction it stands still in space and the pulley turns under it.",
    (_GAP, Parameter("drag_Nm", "the link's friction", low=0.0)),
    ("load", "motor_angle"),
    _dragging,
)


def _two(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        first = 0.5 * p["gap_rad"] * p["share"]
        second = 0.5 * p["gap_rad"] * (1.0 - p["share"])
        path = outputs[:, PATH]
        outputs[:, Q_OUT] += first * np.sign(path) + second * np.sign(path - p["preload_Nm"])

    build.mounts.append(shift)


TWO = form(
    "termination_backlash",
    "two_clearances",
    "Two clearances in a row, one of them preloaded by a spring washer: it opens not at M = 0, but at M_p.",
    (
        _GAP,
        Parameter("share", "of the gap that opens at zero", 0.5, 0.0, 1.0),
        Parameter("preload_Nm", "M_p", 0.0),
    ),
    ("load",),
    _two,
)


def _both_ways(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        rest, path = 1.0 - p["share"], outputs[:, PATH]
        dogs = np.sign(path - p["up_Nm"]) + np.sign(path + p["down_Nm"])
        outputs[:, Q_OUT] += 0.5 * p["gap_rad"] * (p["share"] * np.sign(path) + 0.5 * rest * dogs)

    build.mounts.append(shift)


BOTH_WAYS = form(
    "termination_backlash",
    "both_ways",
    "A coupling with a sprung dog for either way beside its key: one gap opens at zero, half of the others' at M_u, "
    "half at −M_d.",
    (
        _GAP,
        Parameter("share", "of the gap that opens at zero", 0.4, 0.0, 1.0),
        Parameter("up_Nm", "M_u", 0.0, 0.0),
        Parameter("down_Nm", "M_d", 0.0, 0.0),
    ),
    ("load",),
    _both_ways,
)


def _sprung(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += 0.5 * p["gap_rad"] * np.clip(outputs[:, PATH] / p["closes_Nm"], -1.0, 1.0)

    build.mounts.append(shift)


SPRUNG = form(
    "termination_backlash",
    "sprung",
    "A key that springs hold amid its gap: it moves with the load, + (b/2) M/M_c, until |M| = M_c closes the gap.",
    (_GAP, Parameter("closes_Nm", "M_c", low=1e-9)),
    ("load",),
    _sprung,
)


def wedged(path: Floats, holds: float) -> Floats:
    """The flank (1, -1) on which a key lies that wedges: it comes loose where the moment pulls it by more than `holds`
    the other way."""
    result = np.empty_like(path)
    flank = 1.0 if path[0] > 0.0 else -1.0
    for k, m in enumerate(path.tolist()):
        if flank * m < -holds:
            flank = -flank
        result[k] = flank
    return result


def _wedging(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += 0.5 * p["gap_rad"] * wedged(outputs[:, PATH], p["holds_Nm"])

    build.mounts.append(shift)


WEDGED = form(
    "termination_backlash",
    "wedged",
    "A key that wedges in its taper: it lies on a flank until the moment has turned over and exceeds M_w.",
    (_GAP, Parameter("holds_Nm", "M_w", low=0.0)),
    ("load", "load_direction"),
    _wedging,
)


def _worn(build: Build, p: Mapping[str, float]) -> None:
    def shift(inputs: Floats, outputs: Floats) -> None:
        away = (outputs[:, PULLEY] - p["place_rad"]) / p["width_rad"]
        worn = 1.0 - p["share"] + p["share"] * np.exp(-(away**2))
        outputs[:, Q_OUT] += 0.5 * p["gap_rad"] * worn * np.sign(outputs[:, PATH])

    build.mounts.append(shift)


WORN = form(
    "termination_backlash",
    "worn",
    "A toothed joint whose clearance is widest where it has worn most: b (1 − s + s exp(−((q − p)/w)²)).",
    (
        _GAP,
        Parameter("share", "s, of the gap that is wear", 0.7, 0.0, 1.0),
        Parameter("place_rad", "p", 0.0),
        Parameter("width_rad", "w", 0.5, 1e-3),
    ),
    ("load", "joint_angle"),
    _worn,
)

KINDS: tuple[EffectKind, ...] = (GREASED, DRAGGING, TWO, BOTH_WAYS, SPRUNG, WEDGED, WORN)
