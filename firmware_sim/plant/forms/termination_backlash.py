"""Backlash in other forms: a greased gap, a link that drags when unloaded, two clearances, three, a key on springs,
one that wedges in its taper, one that has worn its way where the joint mostly stands, one that works loose."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import JOINT_TORQUE, PATH, PULLEY, Q_OUT, TIME
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import worked
from firmware_sim.plant.records import Floats

_GAP = Parameter("gap_rad", "b, total clearance", low=0.0, high=0.5, neutral=0.0)
_Values = Mapping[str, float]


def _behind_pulley(added: Callable[[Floats, Floats, _Values], Floats]) -> Callable[[Build, _Values], None]:
    """Puts what a law adds to the joint's angle (of inputs, outputs, parameters) behind the pulley."""

    def change(build: Build, p: _Values) -> None:
        def shift(inputs: Floats, outputs: Floats) -> None:
            outputs[:, Q_OUT] += added(inputs, outputs, p)

        build.mounts.append(shift)

    return change


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


def _greased(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    return squeezed(inputs[:, TIME], outputs[:, PATH], p["gap_rad"], p["damping_Nms_per_rad"])


GREASED = form(
    "termination_backlash",
    "greased",
    "A gap full of grease: the key crosses it at the speed M/d, and lies on a flank only then.",
    (_GAP, Parameter("damping_Nms_per_rad", "d", low=1e-9)),
    ("load", "load_rate"),
    _behind_pulley(_greased),
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


def _dragging(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    return dragged(outputs[:, PATH], outputs[:, PULLEY], p["gap_rad"], p["drag_Nm"])


DRAGGING = form(
    "termination_backlash",
    "dragging_link",
    "A link that drags: while |M| is below its own friction it stands still in space and the pulley turns under it.",
    (_GAP, Parameter("drag_Nm", "the link's friction", low=0.0)),
    ("load", "motor_angle"),
    _behind_pulley(_dragging),
)


def _two(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    share, path = p["share"], outputs[:, PATH]
    return 0.5 * p["gap_rad"] * (share * np.sign(path) + (1.0 - share) * np.sign(path - p["preload_Nm"]))


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
    _behind_pulley(_two),
)


def _both_ways(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    share, path = p["share"], outputs[:, PATH]
    dogs = np.sign(path - p["up_Nm"]) + np.sign(path + p["down_Nm"])
    return 0.5 * p["gap_rad"] * (share * np.sign(path) + 0.5 * (1.0 - share) * dogs)


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
    _behind_pulley(_both_ways),
)


def _sprung(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    return 0.5 * p["gap_rad"] * np.clip(outputs[:, PATH] / p["closes_Nm"], -1.0, 1.0)


SPRUNG = form(
    "termination_backlash",
    "sprung",
    "A key that springs hold amid its gap: it moves with the load, + (b/2) M/M_c, until |M| = M_c closes the gap.",
    (_GAP, Parameter("closes_Nm", "M_c", low=1e-9)),
    ("load",),
    _behind_pulley(_sprung),
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


def _wedging(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    return 0.5 * p["gap_rad"] * wedged(outputs[:, PATH], p["holds_Nm"])


WEDGED = form(
    "termination_backlash",
    "wedged",
    "A key that wedges in its taper: it lies on a flank until the moment has turned over and exceeds M_w.",
    (_GAP, Parameter("holds_Nm", "M_w", low=0.0)),
    ("load", "load_direction"),
    _behind_pulley(_wedging),
)


def _worn(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    away = (outputs[:, PULLEY] - p["place_rad"]) / p["width_rad"]
    worn = 1.0 - p["share"] + p["share"] * np.exp(-(away**2))
    return 0.5 * p["gap_rad"] * worn * np.sign(outputs[:, PATH])


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
    _behind_pulley(_worn),
)


def _loosening(inputs: Floats, outputs: Floats, p: _Values) -> Floats:
    gone = worked(inputs[:, TIME], inputs[:, JOINT_TORQUE], p["time_s"], p["duration_s"])
    return 0.5 * p["gap_rad"] * (p["share"] + (1.0 - p["share"]) * gone) * np.sign(outputs[:, PATH])


LOOSENING = form(
    "termination_backlash",
    "loosening",
    "A set screw that the load works loose: the clearance grows from s b to b as the load comes and goes for a while.",
    (
        _GAP,
        Parameter("share", "s, of the gap that is there before", 0.1, 0.0, 1.0),
        Parameter("time_s", "when it begins"),
        Parameter("duration_s", "how long", 15.0, 0.0),
    ),
    ("load", "time"),
    _behind_pulley(_loosening),
)

KINDS: tuple[EffectKind, ...] = (GREASED, DRAGGING, TWO, BOTH_WAYS, SPRUNG, WEDGED, WORN, LOOSENING)
