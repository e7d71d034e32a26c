"""MCAP with JSON messages, as Foxglove and PlotJuggler read and write it (optional package `mcap`).

A row is all the messages of one log time. A field is a channel if its name is one (`joint_torque_mNm`); a
message with the single field `value` or `data` is the channel that its topic's last part names.
Source: https://mcap.dev/spec
"""

from __future__ import annotations

import importlib
import json
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.channels import parse_column
from cablecomp.recording.foreign import BinaryRows, RowStream
from cablecomp.recording.table import Block

TOPIC: Final = "/joint"
_ROWS: Final = 1 << 14


def open_mcap(path: Path) -> tuple[tuple[str, ...], RowStream]:
    """Return column names and a stream of rows; InputError if damaged or no JSON topic holds a channel.

    Fields that are no channels are left out. Without a time channel, log time since the first message is it.
    """
    names, seen, clock = _discover(path)
    if not names:
        raise InputError(
            f"{path}: no JSON message holds a known channel; expected fields such as motor_position_rad; "
            f"found {', '.join(sorted(seen)) or 'no JSON topic'}"
        )
    columns = names if clock is not None else ("time_s", *names)

    def rows() -> Iterator[BinaryRows]:
        first_line, held = 1, []
        start: int | None = None
        for log_time, fields, fraction in _merged(path):
            start = log_time if start is None else start
            fields.setdefault("time_s", (log_time - start) * 1e-9)
            held.append([fields.get(name, math.nan) for name in columns])
            if len(held) == _ROWS:
                yield _rows(first_line, held, fraction)
                first_line, held = first_line + len(held), []
        if held:
            yield _rows(first_line, held, 1.0)

    return columns, rows


def write_mcap(path: Path, blocks: Iterable[Block]) -> None:
    """Write blocks as one JSON message a row on the topic `/joint`, which `open_mcap` reads back unchanged.

    Log time is `time_s` in whole nanoseconds, counted from the first row where that is negative.
    """
    writer_module = _package("mcap.writer", path)
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start(profile="", library="cablecomp")
        channel: int | None = None
        shift = 0.0
        for block in blocks:
            names = tuple(block.columns)
            if channel is None:
                channel = _register(writer, names)
                shift = min(float(block.columns["time_s"][0]), 0.0)
            for row in zip(*(block.columns[name].tolist() for name in names), strict=True):
                values = dict(zip(names, row, strict=True))
                stamp = round((values["time_s"] - shift) * 1e9)
                data = json.dumps({n: None if math.isnan(v) else v for n, v in values.items()}).encode()
                writer.add_message(channel_id=channel, log_time=stamp, publish_time=stamp, data=data)
        writer.finish()


def _register(writer: Any, names: tuple[str, ...]) -> int:
    properties = {name: {"type": "number"} for name in names}
    schema = json.dumps({"type": "object", "properties": properties}).encode()
    schema_id = writer.register_schema(name="cablecomp.Joint", encoding="jsonschema", data=schema)
    channel: int = writer.register_channel(topic=TOPIC, message_encoding="json", schema_id=schema_id)
    return channel


def _rows(first_line: int, held: list[list[float]], fraction: float) -> BinaryRows:
    return BinaryRows(first_line, list(np.ascontiguousarray(np.array(held, dtype=np.float64).T)), fraction)


def _discover(path: Path) -> tuple[tuple[str, ...], set[str], str | None]:
    """Return the channels, everything seen, and the time channel, from each topic's first message."""
    names: dict[str, None] = {}
    seen: set[str] = set()
    topics: set[str] = set()
    waiting: set[str] | None = None
    for channel, message, known in _messages(path):
        waiting = set(known) if waiting is None else waiting
        if channel.topic not in topics:
            topics.add(channel.topic)
            fields = _fields(channel.topic, message, path)
            seen |= {f"{channel.topic}.{name}" for name in fields}
            names |= dict.fromkeys(name for name in fields if _is_channel(name))
        if topics >= waiting:
            break
    clock = next((name for name in names if parse_column(name).name == "time_s"), None)
    return tuple(names), seen, clock


def _merged(path: Path) -> Iterator[tuple[int, dict[str, float], float]]:
    current: int | None = None
    fields: dict[str, float] = {}
    span: tuple[int, int] | None = None
    for channel, message, _ in _messages(path):
        if span is None:
            span = _span(path)
        if current is not None and message.log_time != current:
            yield current, fields, _share(current, span)
            fields = {}
        current = message.log_time
        fields |= _fields(channel.topic, message, path)
    if current is not None:
        yield current, fields, 1.0


def _messages(path: Path) -> Iterator[tuple[Any, Any, list[str]]]:
    """Stream (channel, message, all JSON topics) in the order of log time."""
    reader_module, errors = _package("mcap.reader", path), _package("mcap.exceptions", path)
    try:
        with path.open("rb") as stream:
            reader = reader_module.make_reader(stream)
            summary = reader.get_summary()
            if summary is None:
                raise InputError(
                    f"{path}: MCAP without its index, it was cut short; run `mcap recover` on it"
                )
            topics = [c.topic for c in summary.channels.values() if c.message_encoding == "json"]
            if topics:
                for _, channel, message in reader.iter_messages(topics=topics):
                    yield channel, message, topics
    except (errors.McapError, OSError, EOFError, ValueError) as error:
        raise InputError(f"{path}: damaged or cut MCAP ({error}); run `mcap recover` on it") from None


def _span(path: Path) -> tuple[int, int]:
    with path.open("rb") as stream:
        statistics = _package("mcap.reader", path).make_reader(stream).get_summary().statistics
    return (statistics.message_start_time, statistics.message_end_time) if statistics else (0, 0)


def _share(now: int, span: tuple[int, int]) -> float:
    return (now - span[0]) / (span[1] - span[0]) if span[1] > span[0] else 1.0


def _fields(topic: str, message: Any, path: Path) -> dict[str, float]:
    try:
        content = json.loads(message.data)
    except ValueError:
        raise InputError(f"{path}: topic {topic} holds a message that is not JSON; export it anew") from None
    if not isinstance(content, dict):
        return {}
    fields = {
        name: math.nan if value is None else float(value)
        for name, value in content.items()
        if value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    }
    if len(fields) == 1 and next(iter(fields)) in ("value", "data"):
        return {topic.rsplit("/", 1)[-1]: next(iter(fields.values()))}
    return fields


def _is_channel(name: str) -> bool:
    try:
        parse_column(name)
    except InputError:
        return False
    return True


def _package(name: str, path: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"{path}: MCAP needs the package mcap; install it with `pip install cablecomp[mcap]`"
        ) from None
