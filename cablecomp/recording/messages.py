"""Recordings of messages (MCAP, ROS bags, CAN logs): what a message is, and its numbers by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

_MOST_DEPTH: Final = 6
_MOST_FIELDS: Final = 512
_MOST_ENTRIES: Final = 32
_PER_JOINT: Final = ("position", "velocity", "effort")


class Message(NamedTuple):
    """One message: topic, when it was logged and what its sender stamped (ns; None = not at all), its numbers."""

    topic: str
    logged_ns: int
    stamp_ns: int | None
    fields: dict[str, float]


@dataclass(frozen=True)
class MessageLog:
    """A recording of messages: `read` streams those of some topics (None = all) in the order of logging.

    `kind` names the format, `skipped` what topics hold that could not be read, topic -> why, `notes` what is odd.
    """

    kind: str
    read: Callable[[frozenset[str] | None], Iterator[tuple[Message, float]]]
    skipped: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def numbers(content: Any) -> dict[str, float]:
    """Every number in a message by its path (`wrench.torque.z`, `data[0]`).

    Arrays beside an array `name` of text (sensor_msgs/JointState, CRTK measured_js) go by those names:
    `position[elbow]`. Text is left out; true is 1; null is NaN; arrays of more than 32 numbers are left out.
    """
    found: dict[str, float] = {}
    _collect(content, "", 0, found)
    return found


def stamp_of(content: Any) -> int | None:
    """The sender's own time stamp [ns] (`header.stamp`, `stamp`, `timestamp`), None if there is none."""
    header = _get(content, "header")
    places = (_get(header, "stamp"), _get(content, "stamp"), _get(content, "timestamp"))
    stamp = next((place for place in places if place is not None), None)
    if stamp is None:
        return None
    seconds = next((v for n in ("sec", "secs", "seconds") if (v := _get(stamp, n)) is not None), None)
    rest = next((v for n in ("nanosec", "nsec", "nsecs", "nanos") if (v := _get(stamp, n)) is not None), 0)
    if not isinstance(seconds, int | float) or not isinstance(rest, int | float):
        return None
    if not (math.isfinite(seconds) and math.isfinite(rest)) or abs(seconds) > 1e11 or abs(rest) > 1e11:
        return None
    whole = int(seconds) * 1_000_000_000 + int(rest)
    return whole or None  # an unset stamp is zero


def _collect(value: Any, path: str, depth: int, found: dict[str, float]) -> None:
    if len(found) >= _MOST_FIELDS or depth > _MOST_DEPTH:
        return
    if value is None or isinstance(value, bool | int | float):
        found[path or "value"] = _number(value)
        return
    entries = _entries(value)
    if entries is not None:
        for k, entry in enumerate(entries):
            _collect(entry, f"{path}[{k}]", depth + 1, found)
        return
    names = _joint_names(value)
    for key, inner in _items(value):
        place = f"{path}.{key}" if path else key
        if names and key in _PER_JOINT:
            for name, entry in zip(names, _entries(inner) or (), strict=False):
                _collect(entry, f"{place}[{name}]", depth + 1, found)
        elif key != "header" or depth > 0:
            _collect(inner, place, depth + 1, found)


def _number(value: bool | int | float | None) -> float:
    try:
        return math.nan if value is None else float(value)
    except OverflowError:
        return math.inf


def _entries(value: Any) -> list[Any] | None:
    """A short array as a list; an empty list for a long one or one of text; None if it is no array."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return None
    return list(value) if len(value) <= _MOST_ENTRIES else []


def _joint_names(value: Any) -> list[str]:
    names = _get(value, "name")
    if isinstance(names, list | tuple) and names and all(isinstance(n, str) for n in names):
        return [str(n) for n in names[:_MOST_ENTRIES]]
    return []


def _items(value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [(str(k), v) for k, v in value.items()]
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is not None:
        return [(name, getattr(value, name)) for name in fields if not name.startswith("_")]
    return []


def _get(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, dict) else getattr(value, name, None)
