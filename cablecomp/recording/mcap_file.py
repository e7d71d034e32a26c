"""MCAP (optional package `mcap`): messages in JSON, protobuf and ROS 2's CDR, every checksum checked.

Source: https://mcap.dev/spec. Chunks are unpacked by streaming, never beyond the size that they state.
"""

from __future__ import annotations

import heapq
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

from cablecomp.errors import InputError
from cablecomp.recording.array_file import first_line
from cablecomp.recording.message_decoders import Decode, decoder_for
from cablecomp.recording.messages import Message, MessageLog, numbers, stamp_of
from cablecomp.recording.packages import package

MAGIC: Final = b"\x89MCAP0\r\n"
_MOST_CHUNK: Final = 1 << 26
_MOST_WAITING: Final = 1 << 20
_DATA_END, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x0F, 0x02, 0x03, 0x04, 0x05, 0x06


class _Record(NamedTuple):
    code: int
    data: bytes
    at: int


class _Stretch(NamedTuple):
    """Messages that lie together: a chunk, or one message outside of any; in file order."""

    first_ns: int
    at: int


def open_mcap(path: Path) -> MessageLog:
    """Open MCAP: one pass checks lengths and checksums and finds the channels; InputError if damaged or cut."""
    package("mcap.records", path, "mcap", "MCAP")
    contents = _Contents(path)
    stretches = contents.survey()

    def read(topics: frozenset[str] | None) -> Iterator[tuple[Message, float]]:
        total = max(path.stat().st_size, 1)
        with path.open("rb") as file:
            for at, channel, logged, data in contents.in_order(file, stretches, topics):
                topic, decode = contents.channels[channel]
                content = _decoded(path, topic, decode, data)
                yield Message(topic, logged, stamp_of(content), numbers(content)), min(at / total, 1.0)

    return MessageLog("mcap", read, dict(contents.skipped))


class _Contents:
    """What an MCAP file holds, as far as one pass over it tells."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, tuple[str, Decode]] = {}
        self.skipped: dict[str, str] = {}
        self._schemas: dict[int, Any] = {}
        self._seen: dict[int, bytes] = {}
        self._records = package("mcap.records", path, "mcap", "MCAP")
        self._stream = package("mcap.data_stream", path, "mcap", "MCAP").ReadDataStream

    def survey(self) -> list[_Stretch]:
        """Check the whole file; returns its stretches by the time of their first message."""
        found: list[_Stretch] = []
        with self.path.open("rb") as file:
            for record in self._outer(file):
                try:
                    found += self._noted(record)
                except (KeyError, ValueError, OverflowError, EOFError, self._error()) as error:
                    raise self._damaged(first_line(error)) from None
        return sorted(found)

    def in_order(
        self, file: IO[bytes], stretches: list[_Stretch], topics: frozenset[str] | None
    ) -> Iterator[tuple[int, int, int, bytes]]:
        """Stream (place, channel, log time, data) in the order of log time; stretches that overlap are merged."""
        wanted = {c for c, (topic, _) in self.channels.items() if topics is None or topic in topics}
        waiting: list[tuple[int, int, int, int, bytes]] = []
        for k, stretch in enumerate(stretches):
            order = 0
            for logged, channel, data in self._messages(self._again(file, stretch.at)):
                if channel in wanted:
                    heapq.heappush(waiting, (logged, k, order, channel, data))
                    order += 1
            if len(waiting) > _MOST_WAITING:
                raise InputError(f"{self.path}: messages are too far out of order; sort it with `mcap` first")
            until = stretches[k + 1].first_ns if k + 1 < len(stretches) else None
            while waiting and (until is None or waiting[0][0] < until):
                logged, _, _, channel, data = heapq.heappop(waiting)
                yield stretch.at, channel, logged, data

    def _noted(self, record: _Record) -> Iterator[_Stretch]:
        """Take in schemas and channels; the stretch of a record that holds messages, if it is one."""
        if record.code == _SCHEMA:
            schema = self._records.Schema.read(self._stream(BytesIO(record.data)))
            self._schemas[schema.id] = schema
        elif record.code == _CHANNEL:
            self._channel(self._records.Channel.read(self._stream(BytesIO(record.data))))
        elif record.code in (_CHUNK, _MESSAGE):
            inside = list(self._inner(record)) if record.code == _CHUNK else [record]
            for inner in inside:
                if inner.code in (_SCHEMA, _CHANNEL):
                    yield from self._noted(inner)
            times = [logged for inner in inside for logged, _, _ in self._message(inner)]
            if times:
                yield _Stretch(min(times), record.at)

    def _channel(self, channel: Any) -> None:
        if channel.id in self.channels:
            return
        schema = self._schemas.get(channel.schema_id)
        decode = decoder_for(channel.message_encoding, schema, self.path)
        if isinstance(decode, str):
            self.skipped[channel.topic] = decode
        else:
            self.channels[channel.id] = (channel.topic, decode)

    def _messages(self, record: _Record) -> Iterator[tuple[int, int, bytes]]:
        """(log time, channel, data) of the messages in a chunk, or of a message outside of any."""
        for inner in self._inner(record) if record.code == _CHUNK else (record,):
            yield from self._message(inner)

    def _message(self, record: _Record) -> Iterator[tuple[int, int, bytes]]:
        if record.code != _MESSAGE:
            return
        if len(record.data) < 22:
            raise self._damaged("a message is too short")
        channel = int.from_bytes(record.data[:2], "little")
        yield int.from_bytes(record.data[6:14], "little"), channel, record.data[22:]

    def _inner(self, record: _Record) -> Iterator[_Record]:
        """The records in a chunk, unpacked and its checksum checked."""
        chunk = self._records.Chunk.read(self._stream(BytesIO(record.data)))
        if chunk.uncompressed_size > _MOST_CHUNK:
            raise self._damaged(
                f"a chunk states {chunk.uncompressed_size:,} bytes; {_MOST_CHUNK:,} are accepted"
            )
        data = _unpacked(chunk.compression, chunk.data, chunk.uncompressed_size, self.path)
        if len(data) != chunk.uncompressed_size:
            raise self._damaged("a chunk is not of the size that it states")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise self._damaged("a chunk's checksum is wrong")
        at = 0
        while at < len(data):
            size = int.from_bytes(data[at + 1 : at + 9], "little")
            if at + 9 + size > len(data):
                raise self._damaged("a record goes beyond its chunk")
            yield _Record(data[at], data[at + 9 : at + 9 + size], record.at)
            at += 9 + size

    def _outer(self, file: IO[bytes]) -> Iterator[_Record]:
        """The records of the data section, with its checksum and the end of the file checked."""
        crc, at = zlib.crc32(file.read(len(MAGIC))), len(MAGIC)
        while True:
            head = file.read(9)
            if len(head) < 9:
                raise self._cut()
            size = int.from_bytes(head[1:], "little")
            data = file.read(min(size, 2 * _MOST_CHUNK + 1))
            if len(data) < size:
                raise (
                    self._cut()
                    if len(data) < 2 * _MOST_CHUNK
                    else self._damaged(f"a record of {size:,} bytes")
                )
            if head[0] == _DATA_END:
                stated = int.from_bytes(data[:4], "little")
                if stated and stated != crc:
                    raise self._damaged("the checksum of its data is wrong")
                break
            crc = zlib.crc32(data, zlib.crc32(head, crc))
            yield _Record(head[0], data, at)
            at += 9 + size
        self._end(file)

    def _end(self, file: IO[bytes]) -> None:
        file.seek(-len(MAGIC), 2)
        if file.read() != MAGIC:
            raise self._cut()

    def _again(self, file: IO[bytes], at: int) -> _Record:
        file.seek(at)
        head = file.read(9)
        return _Record(head[0], file.read(int.from_bytes(head[1:], "little")), at)

    def _error(self) -> type[Exception]:
        kind: type[Exception] = package("mcap.exceptions", self.path, "mcap", "MCAP").McapError
        return kind

    def _damaged(self, why: str) -> InputError:
        return InputError(f"{self.path}: damaged MCAP ({why}); run `mcap recover` on it")

    def _cut(self) -> InputError:
        return InputError(f"{self.path}: MCAP without its end, it was cut short; run `mcap recover` on it")


def _unpacked(kind: str, data: bytes, size: int, path: Path) -> bytes:
    """Unpack at most `size` + 1 bytes, whatever the data would give."""
    try:
        if kind == "zstd":
            zstandard = package("zstandard", path, "mcap", "MCAP with zstd")
            with zstandard.ZstdDecompressor().stream_reader(BytesIO(data)) as reader:
                return bytes(reader.read(size + 1))
        if kind == "lz4":
            frame = package("lz4.frame", path, "mcap", "MCAP with lz4")
            return bytes(frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))
    except InputError:
        raise
    except Exception as error:  # each package has errors of its own
        raise InputError(f"{path}: damaged MCAP ({first_line(error)}); run `mcap recover` on it") from None
    if kind:
        raise InputError(f"{path}: MCAP packed by {kind!r}; zstd, lz4 and none are accepted")
    return data


def _decoded(path: Path, topic: str, decode: Callable[[bytes], Any], data: bytes) -> Any:
    try:
        return decode(data)
    except Exception as error:  # whatever a decoder makes of damaged bytes
        raise InputError(
            f"{path}: topic {topic} holds a message that cannot be decoded ({first_line(error)}); record it anew"
        ) from None
