"""Writing MCAP: a JSON message a row, as Foxglove and PlotJuggler read it, or ROS 2's messages (optional package
`mcap`)."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.recording.packages import package
from cablecomp.recording.ros_messages import TYPES, RosRows
from cablecomp.recording.table import Block

TOPIC: Final = "/joint"


Put = Callable[[int, Mapping[str, float]], None]
"""Writes one row, given its time in ns."""


def write_mcap(path: Path, blocks: Iterable[Block]) -> None:
    """Write blocks as one JSON message a row on the topic `/joint`, which `open_mcap` reads back unchanged.

    Log time is `time_s` in whole nanoseconds, counted from the first row where that is negative.
    """
    with _writer(path, "") as writer:
        channel = -1

        def put(stamp_ns: int, row: Mapping[str, float]) -> None:
            nonlocal channel
            if channel < 0:
                channel = _register(writer, tuple(row))
            data = json.dumps({n: None if np.isnan(v) else v for n, v in row.items()}).encode()
            writer.add_message(channel_id=channel, log_time=stamp_ns, publish_time=stamp_ns, data=data)

        _each_row(blocks, put)


def write_ros_mcap(path: Path, blocks: Iterable[Block]) -> None:
    """Write blocks as ROS 2 messages (`ros_messages`), times as in `write_mcap`; `ros2 bag play` plays them."""
    with _writer(path, "ros2") as writer:
        places = {}
        for topic, (name, definition) in TYPES.items():
            schema = writer.register_schema(name=name, encoding="ros2msg", data=definition.encode())
            places[topic] = writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)
        rows: RosRows | None = None

        def put(stamp_ns: int, row: Mapping[str, float]) -> None:
            nonlocal rows
            rows = RosRows(tuple(row)) if rows is None else rows
            for topic, data in rows.messages(stamp_ns, row).items():
                place = places[topic]
                writer.add_message(channel_id=place, log_time=stamp_ns, publish_time=stamp_ns, data=data)

        _each_row(blocks, put)


@contextmanager
def _writer(path: Path, profile: str) -> Iterator[Any]:
    module = package("mcap.writer", path, "mcap", "MCAP")
    with path.open("wb") as stream:
        writer = module.Writer(stream, enable_data_crcs=True)
        writer.start(profile=profile, library="cablecomp")
        yield writer
        writer.finish()


def _each_row(blocks: Iterable[Block], put: Put) -> None:
    shift: float | None = None
    for block in blocks:
        names = tuple(block.columns)
        if shift is None:
            shift = min(float(block.columns["time_s"][0]), 0.0)
        for row in zip(*(block.columns[name].tolist() for name in names), strict=True):
            values = dict(zip(names, row, strict=True))
            put(round((values["time_s"] - shift) * 1e9), values)


def _register(writer: Any, names: tuple[str, ...]) -> int:
    properties = {name: {"type": "number"} for name in names}
    schema = json.dumps({"type": "object", "properties": properties}).encode()
    schema_id = writer.register_schema(name="cablecomp.Joint", encoding="jsonschema", data=schema)
    channel: int = writer.register_channel(topic=TOPIC, message_encoding="json", schema_id=schema_id)
    return channel
