"""Writing MCAP: a JSON message a row, as Foxglove and PlotJuggler read it (optional package `mcap`)."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np

from cablecomp.recording.packages import package
from cablecomp.recording.table import Block

TOPIC: Final = "/joint"


def write_mcap(path: Path, blocks: Iterable[Block]) -> None:
    """Write blocks as one JSON message a row on the topic `/joint`, which `open_mcap` reads back unchanged.

    Log time is `time_s` in whole nanoseconds, counted from the first row where that is negative.
    """
    writer_module = package("mcap.writer", path, "mcap", "MCAP")
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream, enable_data_crcs=True)
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
                data = json.dumps({n: None if np.isnan(v) else v for n, v in values.items()}).encode()
                writer.add_message(channel_id=channel, log_time=stamp, publish_time=stamp, data=data)
        writer.finish()


def _register(writer: Any, names: tuple[str, ...]) -> int:
    properties = {name: {"type": "number"} for name in names}
    schema = json.dumps({"type": "object", "properties": properties}).encode()
    schema_id = writer.register_schema(name="cablecomp.Joint", encoding="jsonschema", data=schema)
    channel: int = writer.register_channel(topic=TOPIC, message_encoding="json", schema_id=schema_id)
    return channel
