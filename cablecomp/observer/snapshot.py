"""A snapshot: magic, version, joint, the used part of the state, SHA-256. A power cycle loses no history."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.profile import Floats, Ints, Points
from cablecomp.mechanics.records import POINT, floats

MAGIC = b"CABLECMP"
VERSION = 2
State = tuple[Floats, Ints]


def pack(
    config: JointConfig, model: Model, states: Sequence[State], numbers: Sequence[Floats], last_time: float
) -> bytes:
    """Serialise the states (scalars whole, profiles as far as they are used) and further numbers."""
    parts = [
        MAGIC,
        struct.pack("<HH", VERSION, len(states)),
        _joint_key(config),
        struct.pack("<d", last_time),
    ]
    parts += [row.tobytes() for row in numbers]
    for memory, heights in states:
        d = model.named(memory, heights)
        parts += [heights.astype("<i8").tobytes(), memory[: d.size.steps_at].tobytes()]
        parts += [
            np.ascontiguousarray(_by_field(d.profiles[k, : heights[k]]).T).tobytes()
            for k in range(len(heights))
        ]
    body = b"".join(parts)
    return body + hashlib.sha256(body).digest()


def unpack(
    data: bytes, config: JointConfig, model: Model, states: Sequence[State], numbers: Sequence[Floats]
) -> float:
    """Fill the states from a snapshot and return the time of its last sample; after an InputError they may be
    half filled."""
    if not isinstance(data, bytes | bytearray | memoryview):
        raise InputError(f"snapshot: the bytes of Observer.snapshot are accepted, not {type(data).__name__}")
    body, digest = bytes(data[:-32]), bytes(data[-32:])
    if len(data) < 60 or not body.startswith(MAGIC):
        raise InputError(
            "snapshot: is none of ours (wrong first bytes); give a file written by Observer.save"
        )
    if hashlib.sha256(body).digest() != digest:
        raise InputError(
            "snapshot: its checksum does not fit, the file is damaged; start from a known state instead"
        )
    version, count = struct.unpack_from("<HH", body, 8)
    if version != VERSION:
        raise InputError(f"snapshot: has version {version}; this program reads version {VERSION}")
    if body[12:28] != _joint_key(config):
        raise InputError(
            f"snapshot: belongs to another joint configuration than `{config.name}`; use its own"
        )
    if count != len(states):
        raise InputError(
            f"snapshot: holds {count} histories, this observer {len(states)}; open it with the same `bounds`"
        )
    try:
        return _fill(body, model, states, numbers)
    except (ValueError, struct.error):
        raise InputError(
            "snapshot: holds more or less than its joint's state; start from a known state instead"
        ) from None


def _fill(body: bytes, model: Model, states: Sequence[State], numbers: Sequence[Floats]) -> float:
    (last_time,) = struct.unpack_from("<d", body, 28)
    place = 36
    for row in numbers:
        row[:] = np.frombuffer(body, "<f8", len(row), place)
        place += 8 * len(row)
    for memory, heights in states:
        d = model.named(memory, heights)
        small = int(d.size.steps_at)
        heights[:] = np.frombuffer(body, "<i8", len(heights), place)
        if heights.min() < 0 or heights.max() > d.size.capacity:
            raise ValueError("profile longer than its room")
        place += 8 * len(heights)
        memory[:small] = np.frombuffer(body, "<f8", small, place)
        place += 8 * small
        for stack in range(len(heights)):
            used = floats(POINT) * int(heights[stack])
            fields = np.frombuffer(body, "<f8", used, place).reshape(floats(POINT), -1)
            _by_field(d.profiles[stack, : heights[stack]])[:] = fields.T
            place += 8 * used
    if place != len(body):
        raise ValueError("bytes left over")
    return float(last_time)


def _by_field(points: Points) -> Floats:
    """The numbers of these points, one row a point; a snapshot holds them field by field."""
    rows: Floats = points.view("f8").reshape(len(points), floats(POINT))
    return rows


def _joint_key(config: JointConfig) -> bytes:
    """What the state depends on: drive, effects, memory (not the joint's name or its sensors)."""
    text = config.model_dump_json(include={"drive", "effect", "observer"})
    return hashlib.sha256(text.encode()).digest()[:16]
