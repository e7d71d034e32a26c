"""Known physics, one transformation of channels each: sized in shares of what the recordings themselves span."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

Floats = NDArray[np.float64]
Table = Mapping[str, Floats]
"""Channels of one recording by canonical names."""
Rng = np.random.Generator

TIME, MOTOR, JOINT, TORQUE = "time_s", "motor_position_rad", "joint_position_rad", "joint_torque_Nm"
WARMTH, NEIGHBOUR = "temperature_degC", "other_concealed"


@dataclass(frozen=True)
class Change:
    """What is put into one channel: added to it, one array per recording."""

    channel: str
    added: tuple[Floats, ...]
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class Physics:
    """One physics that can be concealed.

    `named`: ids under which the effects catalogue of a diagnosis may rightly name it; `shows_in`: covariates in
    which it shows; `calibrates`: it is no missing physics but a constant that is off. `shares`: sizes, of the
    joint's travel or of the torque's RMS about zero (a steady load is a load too), or seconds. `unit`, `per_unit`:
    the unit in which a size is shown, and how many of it a unit of `Change.numbers["size"]` is.
    """

    id: str
    words: str
    named: tuple[str, ...]
    shows_in: tuple[str, ...]
    shares: tuple[float, ...]
    unit: str
    per_unit: float
    make: Callable[[Rng, Sequence[Table], float], Change | None]
    calibrates: bool = False


def _spans(tables: Sequence[Table], channel: str) -> float:
    values = np.concatenate([t[channel] for t in tables])
    return float(np.nanmax(values) - np.nanmin(values))


def _scatter(parts: Sequence[Floats]) -> float:
    return float(np.nanstd(np.concatenate(parts)))


def _rms(parts: Sequence[Floats]) -> float:
    return float(np.sqrt(np.nanmean(np.square(np.concatenate(parts)))))


def _has(tables: Sequence[Table], channel: str) -> bool:
    return all(channel in t for t in tables) and _spans(tables, channel) > 0.0


def _late(rng: Rng, tables: Sequence[Table], delay_s: float) -> Change | None:
    """The joint's clock is late by whole samples where it can be, so that noise stays as it is."""
    added, lags = [], []
    for t in tables:
        step = float(np.median(np.diff(t[TIME])))
        lag = round(delay_s / step) * step if delay_s >= step else delay_s
        lags.append(lag)
        added.append(np.interp(t[TIME] - lag, t[TIME], t[JOINT]) - t[JOINT])
    return Change(JOINT, tuple(added), {"size": float(np.mean(lags))})


def _slip(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """The joint stands off from an instant on, in this recording and in those after it."""
    size = share * _spans(tables, JOINT) * float(rng.choice((-1.0, 1.0)))
    where = int(rng.integers(len(tables)))
    first, last = tables[where][TIME][0], tables[where][TIME][-1]
    instant = float(first + (last - first) * rng.uniform(0.3, 0.7))
    added = [
        np.zeros_like(t[TIME]) if k < where else np.where((k > where) | (t[TIME] >= instant), size, 0.0)
        for k, t in enumerate(tables)
    ]
    return Change(JOINT, tuple(added), {"size": abs(size), "instant_s": instant, "recording": float(where)})


def _unseen_torque(tables: Sequence[Table], parts: Sequence[Floats], share: float) -> Change | None:
    """A torque on the joint that its channel does not show; its scatter is `share` of the channel's RMS."""
    scatter = _scatter(parts)
    if not scatter > 0.0:
        return None
    size = share * _rms([t[TORQUE] for t in tables])
    return Change(TORQUE, tuple(size / scatter * p for p in parts), {"size": size})


def _neighbour(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    if not _has(tables, TORQUE):
        return None
    sign = float(rng.choice((-1.0, 1.0)))
    return _unseen_torque(tables, [sign * t[NEIGHBOUR] for t in tables], share)


def _frame(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """The neighbour moves the joint and loads no cable: its frame gives way, or this joint's cables pass its axis."""
    parts = [t[NEIGHBOUR] for t in tables]
    scatter = _scatter(parts)
    if not scatter > 0.0:
        return None
    size, way = share * _spans(tables, JOINT), float(rng.choice((-1.0, 1.0)))
    return Change(JOINT, tuple(way * size / scatter * p for p in parts), {"size": size})


def _weight(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """A weight that hangs, or stands, upright at an angle that the joint passes: one far from there would pull with a
    torque many times what it changes by."""
    if not _has(tables, TORQUE):
        return None
    angles = np.concatenate([t[JOINT] for t in tables])
    upright = float(rng.uniform(np.nanmin(angles), np.nanmax(angles)))
    way = float(rng.choice((-1.0, 1.0)))
    return _unseen_torque(
        tables, [way * np.sin(_bridged(t[TIME], t[TIME], t[JOINT]) - upright) for t in tables], share
    )


def _bridged(at: Floats, time: Floats, angle: Floats) -> Floats:
    """The angle at instants `at`, also where it was not read: what pulls at the joint shows in other channels too."""
    known = np.isfinite(angle)
    return np.asarray(np.interp(at, time[known], angle[known]))


def _inertia(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    if not _has(tables, TORQUE):
        return None
    return _unseen_torque(tables, [acceleration(t[TIME], t[JOINT]) for t in tables], share)


def acceleration(time: Floats, angle: Floats, over_s: float = 0.15) -> Floats:
    """Second derivative of an angle out of cubics fitted to windows of `over_s`, on an even clock in between."""
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    window = max(2 * round(0.5 * over_s / step) + 1, 7)
    if len(even) <= window:
        return np.zeros_like(time)
    smooth = savgol_filter(_bridged(even, time, angle), window, 3, deriv=2, delta=step)
    return np.asarray(np.interp(time, even, smooth))


def _friction(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """Dahl's friction along the measured angle: it builds up over a small turn and never quite stands."""
    if not _has(tables, TORQUE):
        return None
    turn = float(rng.uniform(0.005, 0.02)) * _spans(tables, JOINT)
    return _unseen_torque(tables, [dahl(t[JOINT], turn) for t in tables], share)


def dahl(angle: Floats, turn: float) -> Floats:
    """z with dz = (1 − z sgn dq) dq/turn: Dahl's friction over its limit, −1 … 1, exact over every step."""
    z, found, last = 0.0, np.empty_like(angle), float(angle[np.isfinite(angle)][0])
    for k, q in enumerate(angle):
        if np.isfinite(q):
            way = 1.0 if q > last else -1.0
            z = way + (z - way) * float(np.exp(-abs(q - last) / turn))
            last = float(q)
        found[k] = z
    return found


def _play(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """A link in its clearance: the load presses it to one flank, grease lets it there within some time."""
    if not _has(tables, TORQUE):
        return None
    gap = share * _spans(tables, JOINT)
    lag, drag = float(rng.uniform(0.01, 0.05)), 0.02 * _scatter([t[TORQUE] for t in tables])
    places = [_pressed(t[TIME], t[TORQUE], lag, drag) for t in tables]
    if not _scatter(places) > 0.1:
        return None
    return Change(JOINT, tuple(0.5 * gap * p for p in places), {"size": gap})


def _pressed(time: Floats, load: Floats, lag_s: float, drag: float) -> Floats:
    """−1 … 1: which flank the link lies at; it stays where the load is below `drag`."""
    place, found = float(np.sign(next(iter(load[np.isfinite(load)]), 0.0))), np.empty_like(time)
    steps = np.diff(time, prepend=time[0])
    for k, (torque, dt) in enumerate(zip(load, steps, strict=True)):
        if abs(torque) > drag:
            place += (float(np.sign(torque)) - place) * (1.0 - float(np.exp(-dt / lag_s)))
        found[k] = place
    return found


def _gain(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    if not _has(tables, TORQUE):
        return None
    way = float(rng.choice((-1.0, 1.0)))
    return Change(TORQUE, tuple(way * share * t[TORQUE] for t in tables), {"size": share})


def _drift(rng: Rng, tables: Sequence[Table], share: float) -> Change | None:
    """The joint's reading follows the temperature."""
    if not _has(tables, WARMTH):
        return None
    warmth = [t[WARMTH] for t in tables]
    size, middle = share * _spans(tables, JOINT), float(np.nanmean(np.concatenate(warmth)))
    per_K = size / _scatter(warmth) * float(rng.choice((-1.0, 1.0)))
    return Change(JOINT, tuple(per_K * (w - middle) for w in warmth), {"size": size, "per_K": per_K})


_TRAVEL = (0.0015, 0.003, 0.006, 0.012)
_TORQUE = (0.1, 0.2, 0.4, 0.8)
_DEG = 57.29577951308232

PHYSICS = (
    Physics("late", "joint channel late", ("clock_skew",), ("velocity",), (3e-3, 6e-3, 12e-3, 24e-3), "ms", 1e3, _late),
    Physics("slip", "clamp slips once", ("clamp_slip",), ("time",), _TRAVEL, "deg", _DEG, _slip),
    Physics("neighbour", "neighbour's torque", ("crosstalk",), ("other:concealed",), _TORQUE, "N m RMS", 1.0,
            _neighbour),
    Physics("frame", "neighbour moves the joint", ("crosstalk",), ("other:concealed",), _TRAVEL, "deg RMS", _DEG,
            _frame),
    Physics("weight", "weight unseen by the torque channel", ("gravity_load",), ("joint_angle", "motor_angle"), _TORQUE,
            "N m RMS", 1.0, _weight),
    Physics("inertia", "inertia unseen by the torque channel", ("inertial_load",), ("acceleration", "joint_angle"),
            _TORQUE, "N m RMS", 1.0, _inertia),
    Physics("friction", "friction of the joint's bearing", ("bearing_friction",), ("reversal", "velocity"), _TORQUE,
            "N m RMS", 1.0, _friction),
    Physics("play", "play of the joint's link", ("termination_backlash",), ("load", "load_direction"), _TRAVEL, "deg",
            _DEG, _play),
    Physics("drift", "joint reading drifts with temperature", (), ("temperature",), _TRAVEL, "deg RMS", _DEG, _drift),
    Physics("gain", "torque sensor's gain off", (), (), (0.025, 0.05, 0.1, 0.2), "%", 100.0, _gain, calibrates=True),
)  # fmt: skip
"""All that can be concealed; a size is found where one of `named` is new, else where `shows_in` (`calibrates`) is."""
