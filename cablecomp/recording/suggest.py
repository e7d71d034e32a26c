"""A mapping suggested from names, units and correlations; it is shown before it is used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cablecomp.recording.channels import CANONICAL, QUANTITIES
from cablecomp.recording.column_names import NameReading, read_name
from cablecomp.recording.inspection import whole_turns
from cablecomp.recording.mapping import ColumnMap, Source, column_of, joined_maps, meaning
from cablecomp.recording.table import FloatArray

_DEGREE: Final = 180.0 / np.pi
_COUNTS: Final = (
    500,
    512,
    1000,
    1024,
    2000,
    2048,
    4000,
    4096,
    8000,
    8192,
    10000,
    16384,
    20000,
    32768,
    40000,
    65536,
)
_STILL: Final = 0.3
"""How much less a column that never changes fits than its name says."""
_NEEDED: Final = ("time_s", "motor_position_rad", "joint_position_rad", "joint_torque_Nm")
_SURE: Final = 0.3
"""Least correlation from which on a sign is read off."""
_GEARED: Final = 2.0
"""Joints that move so many times what the drive's ratio allows, or less than its inverse, have another gear or unit:
what they give way is what does not follow the motor then."""
LOST: Final = 0.1
"""Share of the work at both ends that sensors of force that do not quite agree do not make."""


@dataclass
class Suggestion:
    """One channel's source, how sure (0..1), and why, in words; `unknown`: the unit its name states, if not known;
    `counted`: it states an encoder's counts."""

    channel: str
    source: Source
    sure: float
    why: list[str] = field(default_factory=list)
    unknown: str | None = None
    counted: bool = False


def suggest(
    columns: Mapping[str, FloatArray], ratio: float | None = None, units: Mapping[str, str] | None = None
) -> list[Suggestion]:
    """Suggest sources for channels, best known first, from columns of equal length (NaN = empty).

    `ratio`: joint angle per motor angle of the rigid drive, product of r/R, if the joint is known; `units`: those
    that the file states itself. Signs follow
    from what the drive allows: motor and joint turn together, the joint gives way to its load, the motor holds
    against it and does net work.
    """
    found = {s.channel: s for s in _by_names(columns, units or {})}
    values = {name: _filled(column) for name, column in columns.items()}
    _time(found, values)
    _angles(found, values, ratio)
    _torques(found, values, ratio)
    return [found[name] for name in (*CANONICAL, *(n for n in found if n not in CANONICAL)) if name in found]


def lost_share(
    motor_torque_Nm: FloatArray, motor_rad: FloatArray, load_Nm: FloatArray, joint_rad: FloatArray
) -> float:
    """Share (-1..1) of the work at both ends, int M dq - int tau dq, that friction takes if of two torques that
    disagree in sign the motor's is turned; what it does (< 0) if so, it takes with the load turned."""
    motor_J = float(np.trapezoid(motor_torque_Nm, motor_rad))
    load_J = float(np.trapezoid(load_Nm, joint_rad))
    return (load_J - motor_J) / max(abs(load_J) + abs(motor_J), 1e-300)


def as_mapping(suggestions: list[Suggestion], known: ColumnMap | None = None) -> ColumnMap:
    """The suggestions as a mapping; `time_s` means itself, also where it is made by joining messages.

    What is `known` holds over them. Columns taken by their names that state a unit which is not known are left out, as
    what they are in is not guessed: see `unknown_units`.
    """
    suggested = ColumnMap(
        schema=1,
        channel={
            s.channel: s.source
            for s in suggestions
            if s.unknown is None and s.source != Source(column="time_s", unit="s")
        },
    )
    return suggested if known is None else joined_maps(suggested, known)


def unknown_units(
    suggestions: list[Suggestion], known: ColumnMap | None = None
) -> tuple[list[str], list[str]]:
    """A line for each column that states a unit which is not known, and of which nothing else is `known`: those of
    channels without which nothing can be compared, and those that are left out."""
    channels = {} if known is None else known.channel
    mapped = {source.column for source in channels.values()}
    odd = [
        s for s in suggestions if s.unknown and s.source.column not in mapped and s.channel not in channels
    ]
    needed = [_unknown_unit(s) for s in odd if s.channel in _NEEDED]
    return needed, [f"left out: {_unknown_unit(s)}" for s in odd if s.channel not in _NEEDED]


def _unknown_unit(s: Suggestion) -> str:
    column = s.source.column
    quantity, table = next((q, t) for q, t in QUANTITIES.items() if s.channel == f"{q}_{next(iter(t))}")
    other = f", or leave it out by --map 'other_x={column}'" if s.channel in _NEEDED else ""
    return (
        f"column {column!r}: unit {s.unknown!r} is not known; accepted for {quantity} are {', '.join(table)}; "
        f"give it by --map '{s.channel}={column},unit=..,scale=..'{other}"
    )


def _by_names(columns: Mapping[str, FloatArray], units: Mapping[str, str]) -> list[Suggestion]:
    """Give each channel the column whose name fits best; each column once, and none without a reading."""
    offers: list[tuple[float, int, str, NameReading]] = []
    for k, name in enumerate(n for n, values in columns.items() if np.any(np.isfinite(values))):
        own = meaning(name)
        if own is not None and own.name in CANONICAL:
            offers.append((2.0, k, name, NameReading(own.name, 1.0, None)))
            continue
        stated = f"{name} [{units[name]}]" if name in units else name
        still = _STILL * (
            not np.nanmax(columns[name], initial=-np.inf) > np.nanmin(columns[name], initial=np.inf)
        )
        offers += [(r.fit - still, k, name, r) for r in read_name(stated) if r.fit > still]
    taken: dict[str, Suggestion] = {}
    used: set[str] = set()
    for fit, _, name, reading in sorted(offers, key=lambda offer: (-offer[0], offer[1])):
        if reading.channel in taken or name in used:
            continue
        used.add(name)
        taken[reading.channel] = _named(fit, name, reading)
    return list(taken.values())


def _named(fit: float, name: str, reading: NameReading) -> Suggestion:
    if fit > 1.0:
        own = meaning(name)
        assert own is not None
        unit = name.removeprefix(_quantity(own.name)).strip("_")
        return Suggestion(own.name, Source(column=name, unit=unit or None), 1.0, ["the name is a channel's"])
    source = Source(column=name, unit=reading.unit)
    stated = f", unit {reading.unit}" if reading.unit else ""
    why = [f"by name{stated}"]
    return Suggestion(reading.channel, source, reading.fit, why, reading.unknown, reading.counted)


def _quantity(channel: str) -> str:
    for unit in ("_rad_s", "_rad", "_Nm", "_degC", "_N", "_A", "_s"):
        if channel.endswith(unit):
            return channel.removesuffix(unit)
    return channel


def _time(found: dict[str, Suggestion], values: Mapping[str, FloatArray]) -> None:
    """The unit of time from the usual step: between 2 Hz and 2 MHz only one fits."""
    here = found.get("time_s")
    if here is None:
        rising = [n for n, v in values.items() if len(v) > 2 and np.all(np.diff(v) > 0.0)]
        if len(rising) != 1:
            return
        here = found["time_s"] = Suggestion(
            "time_s", Source(column=rising[0]), 0.5, ["the only column that rises"]
        )
        for other in [c for c, s in found.items() if c != "time_s" and s.source.column == rising[0]]:
            del found[other]
    time = values[here.source.column]
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if here.source.unit is None and step > 0.0:
        limits = (("s", 0.5), ("ms", 500.0), ("us", 5e5), ("ns", np.inf))
        unit = next(unit for unit, below in limits if step < below)
        _change(here, f"usual step {step:g}", unit=unit)
    if len(time) and abs(_in_si(here, time)[0]) > 1e6:
        _change(here, "counted from the first row", zero=float(time[0]))


def _angles(found: dict[str, Suggestion], values: Mapping[str, FloatArray], ratio: float | None) -> None:
    """Units and signs of the two angles, from their slope against each other and from their range."""
    for channel in ("motor_position_rad", "joint_position_rad"):
        here = found.get(channel)
        if here is None or here.source.unit is not None:
            continue
        raw = values[here.source.column]
        span = float(np.ptp(raw)) if len(raw) else 0.0
        if here.counted or (span > 200.0 and np.all(raw == np.round(raw))):
            what = "encoder counts" if here.counted else f"whole numbers over {span:g}: encoder counts"
            _change(
                here,
                f"{what}; how many per turn is a guess",
                counts_per_rev=4096.0,
            )
            here.sure = min(here.sure, 0.3)
        elif float(np.max(np.abs(raw), initial=0.0)) > 40.0:
            _change(here, f"values up to {np.max(np.abs(raw)):.3g}: degrees", unit="deg")
    motor, joint = found.get("motor_position_rad"), found.get("joint_position_rad")
    if motor is None or joint is None:
        return
    for here, other in ((motor, joint), (joint, motor)):
        bare = here.source.unit is None and here.source.counts_per_rev is None
        far = float(np.max(np.abs(values[here.source.column]), initial=0.0)) > 2.0 * np.pi
        if ratio is None and bare and far and other.source.unit == "deg":
            _change(here, "over a turn in radians, and the other angle is in degrees", unit="deg")
    turned, followed = (_unwrapped(_in_si(s, values[s.source.column])) for s in (motor, joint))
    slope, strength = _slope(turned, followed)
    if abs(strength) < _SURE:
        joint.why.append("hardly follows the motor: is it this column?")
        joint.sure = min(joint.sure, 0.2)
        return
    if slope < 0.0:
        _change(joint, f"turns against the motor (correlation {strength:.2f})", sign=-1)
    if ratio is not None:
        _scale(motor, joint, abs(slope) / ratio)


def _scale(motor: Suggestion, joint: Suggestion, off: float) -> None:
    """Mend what makes the slope of joint against motor `off` times the drive's ratio."""
    for here, factor in ((joint, off), (motor, 1.0 / off)):
        if here.source.counts_per_rev is not None:
            wanted = here.source.counts_per_rev * factor
            near = min(_COUNTS, key=lambda c: abs(np.log(c / wanted)))
            if abs(np.log(near / wanted)) < 0.03:
                _change(
                    here,
                    f"{near} per turn, by the other encoder and the drive's ratio",
                    counts_per_rev=float(near),
                )
                here.sure = 0.7
                return
        if here.source.unit is None and abs(np.log(factor / _DEGREE)) < 0.2:
            _change(here, "57 times too large for the drive's ratio: degrees", unit="deg")
            return
    if abs(np.log(off)) > 0.2:
        turned = [s.channel for s, f in ((joint, off), (motor, 1.0 / off)) if abs(np.log(f / _DEGREE)) < 0.2]
        asked = f"is {turned[0]} in degrees?" if turned else "is there a gear?"
        joint.why.append(f"moves {off:.3g} times what the drive's ratio allows: {asked}")


def _torques(found: dict[str, Suggestion], values: Mapping[str, FloatArray], ratio: float | None) -> None:
    """Signs of the torques, from how the joint gives way and from the motor's net work."""
    motor, joint = found.get("motor_position_rad"), found.get("joint_position_rad")
    load, effort = found.get("joint_torque_Nm"), found.get("motor_torque_Nm")
    q = None if motor is None else _in_si(motor, values[motor.source.column])
    bent = angle = None
    if q is not None and joint is not None:
        angle = _in_si(joint, values[joint.source.column])
        slope = _slope(q, angle)[0]
        if ratio is not None and ratio < _GEARED * abs(slope) < _GEARED**2 * ratio:
            slope = ratio
        bent = angle - slope * q
    if load is not None and bent is not None:
        _axis(found, values, bent)
    M = None if load is None else values[load.source.column]
    strength = 0.0
    if load is not None and M is not None and bent is not None:
        strength = _slope(bent, M)[1]
        if abs(strength) > _SURE:
            words = "the joint gives way" if strength > 0.0 else "the joint moves against it"
            _change(load, f"{words} (correlation {strength:.2f})", sign=1 if strength > 0.0 else -1)
    if effort is None or q is None:
        return
    torque = values[effort.source.column]
    against = None if M is None or load is None else _slope(load.source.sign * M, torque)[1]
    if against is not None and abs(against) > 2.0 * _SURE:
        words = "holds against the load" if against < 0.0 else "would help the load"
        if load is not None and angle is not None and against > 0.0 and abs(strength) <= _SURE:
            loaded = _in_si(load, values[load.source.column])
            if lost_share(_in_si(effort, torque), q, loaded, angle) < -LOST:
                _change(
                    load, f"else the motor {words} (correlation {against:.2f}) and friction do work", sign=-1
                )
                return
        _change(effort, f"{words} (correlation {against:.2f})", sign=1 if against < 0.0 else -1)
        return
    power = float(np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(q)))
    size = float(np.sum(np.abs(torque[1:] * np.diff(q))))
    if size > 0.0 and abs(power) > 0.2 * size:
        words = "does net work" if power > 0.0 else "would take work out of friction"
        _change(effort, words, sign=1 if power > 0.0 else -1)


def _axis(found: dict[str, Suggestion], values: Mapping[str, FloatArray], bent: FloatArray) -> None:
    """Of columns whose names fit the load alike (the axes of one sensor), the one that the joint gives way to."""
    load = found["joint_torque_Nm"]
    chosen = load.source.column
    if meaning(chosen) is not None:
        return

    def fit(name: str) -> float:
        return max((r.fit for r in read_name(name) if r.channel == load.channel), default=0.0)

    alike = [name for name in values if fit(name) >= fit(chosen) > 0.0]
    best = max(alike, key=lambda name: (abs(_slope(bent, values[name])[1]), name == chosen), default=chosen)
    if best != chosen:
        for channel in [c for c, s in found.items() if s.source.column == best]:
            del found[channel]
        chosen_by = next(r for r in read_name(best) if r.channel == load.channel)
        load.unknown = chosen_by.unknown
        _change(
            load, f"of {len(alike)} named so, what the joint follows most", column=best, unit=chosen_by.unit
        )


def _change(here: Suggestion, why: str, **changes: object) -> None:
    here.source = here.source.model_copy(update=changes)
    here.why.append(why)


def _in_si(here: Suggestion, raw: FloatArray) -> FloatArray:
    column = column_of(here.channel, here.source)
    return raw * column.factor + column.offset


def _unwrapped(angle_rad: FloatArray) -> FloatArray:
    """An angle without the jumps of an encoder that begins anew at each turn."""
    return np.unwrap(angle_rad) if len(whole_turns(angle_rad)) else angle_rad


def _slope(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of y on x, and their correlation; zero where either is constant."""
    x, y = x - x.mean(), y - y.mean()
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx <= 0.0 or yy <= 0.0:
        return 0.0, 0.0
    return xy / xx, xy / float(np.sqrt(xx * yy))


def _filled(column: FloatArray) -> FloatArray:
    """The column with the last value known in place of empty cells (zero before the first)."""
    known = np.isfinite(column)
    last = np.maximum.accumulate(np.where(known, np.arange(len(column)), -1))
    return np.where(last >= 0, column[np.maximum(last, 0)], 0.0)
