"""What the name of a foreign column says: quantity, side of the drive, unit."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from cablecomp.recording.channels import QUANTITIES
from cablecomp.units import unit_named


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_WORDS: Final = {
    "time": _set("time t stamp timestamp timestamps clock millis micros elapsed tick ticks"),
    "position": _set("pos position positions angle ang theta q enc encoder phi rotation qin qout qm qj"),
    "velocity": _set("vel velocity velocities speed omega qd dq qdot rate w"),
    "torque": _set("torque torques tau trq moment mom effort eff load taum tauj ft wrench"),
    "current": _set("current cur curr iq amps amp i"),
    "tension": _set("tension tens force pull"),
    "temperature": _set("temp temperature therm"),
}
_SIDES: Final = {
    "motor": _set("motor mot m act actuator drive spindle input in capstan servo qin qm taum iq"),
    "joint": _set(
        "joint jnt j link output out load jaw arm tip elbow knuckle wrist "
        "finger end external ext qout qj tauj ft sensor"
    ),
}
_BEGINS: Final = ("motor", "joint", "actuator", "output", "input", "link")
_ASKED: Final = _set("cmd command commanded des desired target ref reference setpoint goal sp want")
_MADE: Final = _set("err error residual raw filtered filt model predicted est estimate")
_SENSED: Final = _set("wrench ft")
_BRACKETS = re.compile(r"[\[(<{]\s*([^\])>}]+?)\s*[\])>}]\s*$")
_PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_CHANNELS: Final = {
    ("time", ""): "time_s",
    ("position", "motor"): "motor_position_rad",
    ("position", "joint"): "joint_position_rad",
    ("torque", "joint"): "joint_torque_Nm",
    ("torque", "motor"): "motor_torque_Nm",
    ("velocity", "motor"): "motor_velocity_rad_s",
    ("velocity", "joint"): "joint_velocity_rad_s",
    ("current", "motor"): "motor_current_A",
    ("tension", "h"): "tension_h_N",
    ("tension", "l"): "tension_l_N",
    ("temperature", ""): "temperature_degC",
}


class NameReading(NamedTuple):
    """A reading of a column's name: the channel that it may be, how well it fits (0..1), the unit it states."""

    channel: str
    fit: float
    unit: str | None


def read_name(column: str) -> list[NameReading]:
    """The channels that a column may be by its name, best first; none if the name tells nothing."""
    bare, unit = _unit(column)
    words = _words(bare)
    quantities = [q for q, known in _WORDS.items() if words & known]
    sides = [s for s, known in _SIDES.items() if words & known]
    if unit is not None and not quantities:
        quantities = _by_unit(unit)
    found = []
    for (quantity, side), channel in _CHANNELS.items():
        if quantity not in quantities or (unit is not None and not _fits(channel, unit)):
            continue
        fit = 0.5 + 0.2 * (unit is not None) + _side_fit(side, sides, words)
        fit -= 0.3 * bool(words & _ASKED) + 0.15 * bool(words & _MADE)
        if (
            words & _SENSED
        ):  # three forces and three torques of a sensor at the joint, on no cable and at no motor
            fit -= 0.3 * (channel != "joint_torque_Nm" or "force" in words)
        if quantity == "time" and len(quantities) > 1:
            fit -= 0.2
        if fit > 0.2:
            found.append(NameReading(channel, min(fit, 1.0), unit))
    return sorted(found, key=lambda reading: -reading.fit)


def _side_fit(side: str, sides: list[str], words: set[str]) -> float:
    if side in ("h", "l"):
        ends = {
            "h": {"h", "1", "a", "high", "upper", "agonist"},
            "l": {"l", "2", "b", "low", "lower", "antagonist"},
        }
        return 0.3 if words & ends[side] else -0.2
    if not side:
        return 0.3
    if side in sides:
        return 0.3 if len(sides) == 1 else 0.1
    return -0.25 if sides else -0.1


def _unit(column: str) -> tuple[str, str | None]:
    """The name without its unit, and the unit: in brackets at the end, or as the last part."""
    match = _BRACKETS.search(column)
    if match and _known(match[1]):
        return column[: match.start()], match[1]
    tail = column
    for separator in ("_", ".", "-", " ", "/"):
        head, found, last = tail.rpartition(separator)
        if not found or not head:
            continue
        two = head.rpartition(separator)
        if two[1] and two[0] and _known(f"{two[2]}_{last}"):
            return two[0], f"{two[2]}_{last}"
        if _known(last) and last not in ("m", "h", "l", "in", "min", "F", "C", "K"):
            return head, last
    return column, None


def _known(unit: str) -> bool:
    return any(unit_named(unit, table) is not None for table in QUANTITIES.values())


def _fits(channel: str, unit: str) -> bool:
    quantity = next(q for q, table in QUANTITIES.items() if channel == f"{q}_{next(iter(table))}")
    if unit_named(unit, QUANTITIES[quantity]) is not None:
        return True
    return quantity == "motor_torque" and unit_named(unit, QUANTITIES["motor_current"]) is not None


def _by_unit(unit: str) -> list[str]:
    kinds = {
        "time": "time",
        "motor_position": "position",
        "motor_velocity": "velocity",
        "motor_torque": "torque",
    }
    kinds |= {"motor_current": "current", "tension_h": "tension", "temperature": "temperature"}
    return [kind for quantity, kind in kinds.items() if unit_named(unit, QUANTITIES[quantity]) is not None]


def _words(name: str) -> set[str]:
    return {word for part in _PARTS.findall(name) for word in _apart(part.lower())}


def _apart(word: str) -> set[str]:
    """A word, or the side of the drive that it begins with and the rest (`motorpos`)."""
    sides = [s for s in _BEGINS if word.startswith(s) and len(word) > len(s)]
    return {sides[0], word.removeprefix(sides[0])} if sides else {word}
