"""Other programs that look on: PlotJuggler (UDP), Foxglove (WebSocket), and an MCAP file for later."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path
from typing import Any, Final, Protocol

from cablecomp.errors import DeviceError, InputError
from cablecomp.monitor.frames import Frame

PLOTJUGGLER: Final = ("127.0.0.1", 9870)
FOXGLOVE_PORT: Final = 8765
_TOPIC: Final = "/live"
_SCHEMA: Final = "cablecomp.Live"


def schema_of(found: Frame) -> bytes:
    """JSON schema of frames like this one: by it onlookers offer the curves that can be drawn."""
    kinds: dict[type, str] = {str: "string", list: "array"}
    fields = {name: {"type": kinds.get(type(value), "number")} for name, value in found.items()}
    return json.dumps({"title": _SCHEMA, "type": "object", "properties": fields}).encode()


class Sink(Protocol):
    """Takes frames one by one."""

    def take(self, found: Frame) -> None:
        """Take in a frame."""

    def close(self) -> None:
        """No more will come; DeviceError where what was kept is incomplete."""


class PlotJuggler:
    """JSON datagrams to PlotJuggler's UDP server (message protocol JSON, `time_s` as time stamp)."""

    def __init__(self, address: tuple[str, int] = PLOTJUGGLER) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._address = address

    def take(self, found: Frame) -> None:
        """See `Sink.take`; profiles are no curves over time and stay out."""
        name = found.get("joint", "joint")
        values = {k: v for k, v in found.items() if isinstance(v, int | float) and k != "time_s"}
        self._socket.sendto(json.dumps({"timestamp": found["time_s"], name: values}).encode(), self._address)

    def close(self) -> None:
        """See `Sink.close`."""
        self._socket.close()


class Foxglove:
    """A WebSocket server on loopback that Foxglove connects to: topic `/live`, JSON; where its usual port is taken, as
    by another run, at a free one (`port`)."""

    def __init__(self, port: int = FOXGLOVE_PORT) -> None:
        try:
            import foxglove
        except ImportError:
            raise InputError("--foxglove needs a package: pip install 'cablecomp[live]'") from None
        self._foxglove = foxglove
        try:
            self._server = foxglove.start_server(name="cablecomp", host="127.0.0.1", port=port)
        except RuntimeError:
            self._server = foxglove.start_server(name="cablecomp", host="127.0.0.1", port=0)
        self._channel: Any = None
        self.port: int = self._server.port

    def take(self, found: Frame) -> None:
        """See `Sink.take`."""
        if self._channel is None:
            schema = self._foxglove.Schema(name=_SCHEMA, encoding="jsonschema", data=schema_of(found))
            self._channel = self._foxglove.Channel(_TOPIC, schema=schema, message_encoding="json")
        self._channel.log(found, log_time=round(found["time_s"] * 1e9))

    def close(self) -> None:
        """See `Sink.close`."""
        self._server.stop()


class Mcap:
    """Frames as JSON messages in an MCAP file; on disk once a second, so that a crash costs no more than that. A disk
    that fills ends the file; `close` says so."""

    def __init__(self, path: Path, every_s: float = 1.0) -> None:
        try:
            from mcap.writer import Writer
        except ImportError:
            raise InputError(f"{path}: MCAP needs a package: pip install 'cablecomp[mcap]'") from None
        self._path, self._stream = path, path.open("wb")
        self._failure: OSError | None = None
        self._writer: Any = Writer(self._stream, enable_data_crcs=True, use_chunking=False)
        self._writer.start(profile="", library="cablecomp")
        self._channel: int | None = None
        self._every_s, self._saved_s = every_s, float("-inf")

    def take(self, found: Frame) -> None:
        """See `Sink.take`."""
        if self._failure is not None:
            return
        try:
            self._put(found)
        except OSError as error:
            self._failure = error

    def _put(self, found: Frame) -> None:
        if self._channel is None:
            schema = self._writer.register_schema(_SCHEMA, "jsonschema", schema_of(found))
            self._channel = self._writer.register_channel(_TOPIC, "json", schema)
        stamp = round(max(found["time_s"], 0.0) * 1e9)
        self._writer.add_message(
            self._channel, log_time=stamp, publish_time=stamp, data=json.dumps(found).encode()
        )
        if found["time_s"] - self._saved_s >= self._every_s:
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self._saved_s = found["time_s"]

    def close(self) -> None:
        """See `Sink.close`: index and footer; DeviceError if the disk refused something."""
        try:
            with self._stream:
                if self._failure is None:
                    self._writer.finish()
        except OSError as error:
            self._failure = self._failure or error
        if self._failure is not None:
            raise DeviceError(f"{self._path}: is incomplete ({self._failure.strerror}); free some space")
