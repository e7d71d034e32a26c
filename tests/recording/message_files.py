"""Recordings of messages for tests: bytes worked out from the formats' own specifications, not by our reader's
packages."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

JOINT_STATE = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
WRENCH = """\
std_msgs/Header header
geometry_msgs/Wrench wrench
================================================================================
MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


class Cdr:
    """Plain CDR, little endian (OMG DDS-XTYPES 1.3, 7.4.1): every primitive aligned to its size after the four
    bytes of encapsulation, strings with length and final zero, sequences with length."""

    def __init__(self) -> None:
        self.body = b""

    def put(self, code: str, *values: float) -> Cdr:
        size = struct.calcsize(code)
        for value in values:
            self.body += b"\0" * (-len(self.body) % size) + struct.pack(f"<{code}", value)
        return self

    def text(self, value: str) -> Cdr:
        data = value.encode() + b"\0"
        self.put("I", len(data))
        self.body += data
        return self

    def sequence(self, values: Iterable[float]) -> Cdr:
        values = list(values)
        return self.put("I", len(values)).put("d", *values) if values else self.put("I", 0)

    def header(self, stamp_ns: int, frame: str = "base") -> Cdr:
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9).text(frame)

    @property
    def data(self) -> bytes:
        return b"\0\1\0\0" + self.body


def joint_state(stamp_ns: int, names: list[str], position: list[float], effort: list[float]) -> bytes:
    out = Cdr().header(stamp_ns).put("I", len(names))
    for name in names:
        out.text(name)
    return out.sequence(position).sequence([]).sequence(effort).data


def wrench(stamp_ns: int, torque: tuple[float, float, float]) -> bytes:
    return Cdr().header(stamp_ns).put("d", 0.0, 0.0, 0.0, *torque).data


def write_messages(
    path: Path, channels: dict[str, tuple[str, str, str, bytes]], messages: Iterable[Any], **options: Any
) -> None:
    """Write MCAP: `channels` topic -> (message encoding, schema name, schema encoding, schema data), `messages`
    (topic, log time in ns, bytes or a JSON value)."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start()
        numbers = {}
        for topic, (encoding, name, kind, data) in channels.items():
            numbers[topic] = writer.register_channel(
                topic, encoding, writer.register_schema(name, kind, data)
            )
        for topic, logged, content in messages:
            data = content if isinstance(content, bytes) else json.dumps(content).encode()
            writer.add_message(numbers[topic], logged, data, logged)
        writer.finish()
