"""What the name of a foreign column says: quantity, side of the drive, unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

from cablecomp.recording.channels import QUANTITIES
from cablecomp.units import UNITS, Unit, plain_signs, unit_named


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
_COUNTED: Final = _set("count counts cnt cnts tick ticks lsb inc incr increments bit bits")
"""What an encoder may read instead of a unit."""
_TOLD: Final = frozenset().union(*_WORDS.values(), *_SIDES.values(), _ASKED, _MADE)
_IN_MESSAGE = re.compile(r"[./]\w+\[[^\]]*\]$")
"""A field of a message, with the name or the number of what it belongs to (`/joint_states.position[wrist]`)."""
_PREFIX: Final = "(?:da|[GMkhdcmunp])?"
_FORCE: Final = rf"(?:{_PREFIX}N|[mk]?gf?|[mk]p|lbs?f?|ozf?|kips?|dyn)"
_ARM: Final = rf"(?:{_PREFIX}m|ft|in|inch|feet|foot)"
_ANGLE: Final = r"(?:[a-z]{0,2}(?:rad|deg|gon)|°)"
_SYMBOL: Final = (
    rf"(?:{_FORCE}|{_ARM}|{_FORCE}{_ARM}|{_ARM}{_FORCE}|{_ANGLE}|{_PREFIX}(?:s|A|V|W|Hz|Pa|bar)|K|°?C|°?F|[pk]si"
    r"|(?:m|u|n)?secs?|mins?|hr?s?|revs?|Apk|App|kp)"
)
_SPELT_OUT: Final = (
    r"(?:(?:milli|micro|nano|centi|deci|kilo|mega)?(?:newton|met(?:er|re)|gram|pound|ounce|second|degree|radian"
    r"|volt|amp|ampere|watt|gradian|grad|gon|pond)s?|inch(?:es)?|foot|feet|minutes?|hours?|days?|weeks?|years?"
    r"|turns?|cycles?|revolutions?|force|pct)"
)
_PIECE: Final = rf"(?:{_SYMBOL}|{_SPELT_OUT})(?:\^-?[1-4]|[²³]|(?<=[a-z])-[1-4])?"
_LIKE_A_UNIT: Final = re.compile(
    rf"(?:1 ?/ ?)?{_PIECE}(?: ?[ ·./_-] ?{_PIECE})*|1 ?0*\s?{_PREFIX}s|%.*|percent.*|\d+ ?bits?"
)
"""Text made of pieces of units, with powers of ten and of themselves (`kNcm`, `ft-lb`, `100ns`, `deg/h`)."""
_ALONE: Final = _set("dyn foot feet force")
"""Pieces of units that alone mean something else: a kind of model, of limb, of quantity."""
_ENDS_LIKE_A_UNIT: Final = re.compile(
    rf"{_PREFIX}N{_ARM}|(?:{_FORCE})[.·-]?{_ARM}|{_ARM}[.·-]?(?:{_FORCE})|{_ANGLE}|lbs?|oz|kg|daN|days?|weeks?|%"
)
"""Of such text, what is none where nothing but its place at the end of a name says so."""
_FURTHER: Final = re.compile(r"\s*[,;].*|\s+(?:since|from|after)\s.*")
"""What may stand behind a unit in brackets."""
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
    """A reading of a column's name: the channel that it may be, how well it fits (0..1), the unit it states.

    `unknown`: what stands where a unit does, and is none that is known; `counted`: an encoder's counts stand there.
    """

    channel: str
    fit: float
    unit: str | None
    unknown: str | None = None
    counted: bool = False


def read_name(column: str) -> list[NameReading]:
    """The channels that a column may be by its name, best first; none if the name tells nothing."""
    bare, unit, unknown = _unit(column)
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
            counted = quantity == "position" and bool(_words(unknown or "") & _COUNTED)
            odd = None if counted else unknown
            found.append(NameReading(channel, min(fit, 1.0), unit, odd, counted))
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


def _unit(column: str) -> tuple[str, str | None, str | None]:
    """The name without its unit, the unit, in brackets at the end or as the last part, and one that is not known."""
    match = _BRACKETS.search(column)
    if match and not _IN_MESSAGE.search(column):
        text, head = match[1], column[: match.start()]
        first = _FURTHER.sub("", text)
        ways = [
            w
            for way in (text, first, first.removeprefix("in ").strip())
            for w in (way, way.lower() if len(way) > 1 else way)
        ]
        known = next((unit for unit in ways if _known(unit, UNITS)), None)
        if known is not None:
            return head, known, None
        if _like_a_unit(text):
            return head, None, text
        if head.strip():  # a remark; the unit may stand before it
            stem, unit, unknown = _unit(head.rstrip())
            return f"{stem} {text}", unit, unknown
    for separator in ("_", ".", "-", " ", "/"):
        head, found, last = column.rpartition(separator)
        if not found or not head:
            continue
        two = head.rpartition(separator)
        both = f"{two[2]}_{last}"
        if two[1] and two[0] and _known(both) and (separator not in "_ " or _may_be(two[0], both, last)):
            return two[0], both, None
        if _known(last) and last not in ("m", "h", "l", "in", "min", "F", "C", "K"):
            return head.removesuffix(" in") if separator == " " else head, last, None
    return _ends_oddly(column)


def _may_be(stem: str, both: str, last: str) -> bool:
    """Whether two parts are one unit: not where the name's quantity has another (`force_in_lbf`)."""
    quantities = {q for q, known in _WORDS.items() if _words(stem) & known}
    alone = _known(last) or _ENDS_LIKE_A_UNIT.fullmatch(last)
    return not alone or not quantities or not quantities.isdisjoint(_by_unit(both))


def _ends_oddly(column: str) -> tuple[str, None, str | None]:
    """A name that ends in what looks like a unit (`torque_kNcm`, `position/cycles`) and is none that is known."""
    *before, last = re.split(r"[_ /]", column)
    head = column[: len(column) - len(last) - 1]
    behind = "/" in column and "/" not in head and last.lower() not in _TOLD and _like_a_unit(last)
    told = any(_words(head) & known for known in _WORDS.values())
    if before and told and (behind or _ENDS_LIKE_A_UNIT.fullmatch(plain_signs(last))):
        return head, None, last
    return column, None, None


def _like_a_unit(text: str) -> bool:
    """Whether text where a unit may stand is made of pieces of units, or counts; else it is a remark."""
    plain = plain_signs(text)
    if plain in _ALONE:
        return False
    counts = re.split(r"[ _]", plain.lower())[-1] in _COUNTED
    return counts or any(
        _LIKE_A_UNIT.fullmatch(t) for t in (plain, plain.lower() if len(plain) > 2 else plain)
    )


def _known(unit: str, tables: Mapping[str, Mapping[str, Unit]] = QUANTITIES) -> bool:
    return any(unit_named(unit, table) is not None for table in tables.values())


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
