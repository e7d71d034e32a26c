"""Other programs that look on: PlotJuggler (UDP), Foxglove (WebSocket), and an MCAP file for later."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path
from typing import Any, Final, Protocol

from cablecomp.errors import InputError
from cablecomp.monitor.frames import Frame

PLOTJUGGLER: Final = ("127.0.0.1", 9870)
FOXGLOVE_PORT: Final = 8765
_TOPIC: Final = "/live"


class Sink(Protocol):
    """Takes frames one by one."""

    def take(self, found: Frame) -> None:
        """Take in a frame."""

    def close(self) -> None:
        """No more will come."""


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
    """A WebSocket server on loopback that Foxglove connects to: topic `/live`, JSON."""

    def __init__(self, port: int = FOXGLOVE_PORT) -> None:
        try:
            import foxglove
        except ImportError:
            raise InputError("--foxglove needs a package: pip install 'cablecomp[live]'") from None
        self._server = foxglove.start_server(name="cablecomp", host="127.0.0.1", port=port)
        self._channel = foxglove.Channel(_TOPIC, message_encoding="json")
        self.port: int = self._server.port

    def take(self, found: Frame) -> None:
        """See `Sink.take`."""
        self._channel.log(found, log_time=round(found["time_s"] * 1e9))

    def close(self) -> None:
        """See `Sink.close`."""
        self._server.stop()


class Mcap:
    """Frames as JSON messages in an MCAP file; on disk once a second, so that a crash costs no more than that."""

    def __init__(self, path: Path, every_s: float = 1.0) -> None:
        try:
            from mcap.writer import Writer
        except ImportError:
            raise InputError(f"{path}: MCAP needs a package: pip install 'cablecomp[mcap]'") from None
        self._stream = path.open("wb")
        self._writer: Any = Writer(self._stream, enable_data_crcs=True, use_chunking=False)
        self._writer.start(profile="", library="cablecomp")
        schema = self._writer.register_schema("cablecomp.Live", "jsonschema", b'{"type": "object"}')
        self._channel = self._writer.register_channel(_TOPIC, "json", schema)
        self._every_s, self._saved_s = every_s, float("-inf")

    def take(self, found: Frame) -> None:
        """See `Sink.take`."""
        stamp = round(max(found["time_s"], 0.0) * 1e9)
        self._writer.add_message(
            self._channel, log_time=stamp, publish_time=stamp, data=json.dumps(found).encode()
        )
        if found["time_s"] - self._saved_s >= self._every_s:
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self._saved_s = found["time_s"]

    def close(self) -> None:
        """See `Sink.close`: index and footer."""
        self._writer.finish()
        self._stream.close()
