"""CAN logs (BLF, ASC, candump, TRC, MF4): frames by python-can, their numbers by a DBC table or a link file."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

from cablecomp.errors import InputError
from cablecomp.recording.array_file import first_line
from cablecomp.recording.messages import Message, MessageLog
from cablecomp.recording.packages import package

CanKind = Literal["blf", "asc", "candump", "trc", "mf4"]
_MOST_CONTAINER: Final = 1 << 26
_CANDUMP = re.compile(r"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#")
_ASC = re.compile(r"\s*(date\s+\S+|base\s+(hex|dec)\b)", re.IGNORECASE)
_STAMP = re.compile(r"(\s*)(\d+(?:\.\d+)?)(\s.*)", re.DOTALL)


class Frame(NamedTuple):
    """One received frame: time [s] of the log, identifier, whether that is extended, data."""

    time_s: float
    identifier: int
    extended: bool
    data: bytes


DecodeFrame = Callable[[Frame], tuple[str, dict[str, float]] | None]
"""Topic and numbers of a frame; None for one that is not known. State may be kept: frames come in order."""


def can_kind(head: bytes) -> CanKind | None:
    """The kind of a CAN log by its first bytes; None if it is none."""
    if head.startswith(b"LOGG"):
        return "blf"
    if head.startswith((b"MDF     ", b"UnFinMF ")):
        return "mf4"
    text = head.decode("latin-1")
    lines = [line for line in text.splitlines() if line.strip()][:3]
    if any(line.startswith(";$FILEVERSION") for line in lines):
        return "trc"
    if lines and _CANDUMP.match(lines[0]):
        return "candump"
    if len(lines) > 1 and _ASC.match(lines[0]) and any(re.match(r"\s*base\s", line, re.I) for line in lines):
        return "asc"
    return None


def open_can_log(path: Path, kind: CanKind, decode: Callable[[], DecodeFrame] | None) -> MessageLog:
    """Open a CAN log; `decode` makes a new decoder for each reading.

    Raises InputError if there is no decoder, or the log is damaged.
    """
    if decode is None:
        raise InputError(
            f"{path}: is a CAN log ({kind.upper()}); say what its frames mean with --link LINK.toml or --dbc FILE"
        )
    make = decode

    def read(topics: frozenset[str] | None) -> Iterator[tuple[Message, float]]:
        decoder = make()
        first: float | None = None
        for frame in frames(path, kind):
            first = frame.time_s if first is None else first
            found = decoder(frame)
            if found is not None and (topics is None or found[0] in topics):
                logged = round((frame.time_s - first) * 1e9)
                yield Message(found[0], logged, None, found[1]), 0.0

    return MessageLog("can", read, notes=tuple(_ends_early(path, kind)))


def _ends_early(path: Path, kind: CanKind) -> Iterator[str]:
    """What is missing of a log that was cut short: a text's last line, which is not read, or objects of BLF."""
    size = path.stat().st_size
    with path.open("rb") as file:
        if kind == "blf":
            stated = int.from_bytes(file.read(24)[16:], "little")
            if size < stated:
                yield f"the log was cut short ({size:,} of {stated:,} bytes): what is there is read"
        elif kind != "mf4":
            file.seek(-1, 2)
            if file.read() != b"\n":
                yield "the last line is not whole and was left out: was the log cut short?"


def frames(path: Path, kind: CanKind) -> Iterator[Frame]:
    """Stream the data frames of a log, without error and remote frames; raises InputError where it is damaged."""
    read: list[int] = []
    try:
        with ExitStack() as stack:
            for count, m in enumerate(_reader(path, kind, stack, read)):
                if m.is_error_frame or m.is_remote_frame:
                    continue
                if not math.isfinite(m.timestamp):
                    raise InputError(f"{path}: frame {count + 1} has no time; record the log anew")
                yield Frame(float(m.timestamp), m.arbitration_id, m.is_extended_id, bytes(m.data))
    except InputError:
        raise
    except Exception as error:  # whatever python-can makes of a damaged log
        where = f"line {read[0]}: " if read else ""
        raise InputError(
            f"{path}: {where}damaged {kind.upper()} log ({first_line(error)}); record it anew"
        ) from None


def _reader(path: Path, kind: CanKind, stack: ExitStack, read: list[int]) -> Any:
    """python-can's reader; in `read` the number of the line of text that it was given last."""
    import can  # slow to import, and only such logs need it

    if kind == "mf4":
        version_4 = package("asammdf.blocks.mdf_v4", path, "mf4", "an MF4 log")
        from can.io.mf4 import MF4Reader

        # of a damaged file its own end is a traceback; `stop` closes what is open
        version_4.MDF4.__del__ = lambda self: None
        reader = MF4Reader(path)
        stack.callback(reader.stop)
        return reader
    if kind == "blf":
        _check_containers(path)
        return can.BLFReader(stack.enter_context(path.open("rb")))
    text = stack.enter_context(path.open(encoding="latin-1"))
    lines = _whole(text, read)
    if kind == "asc":
        return can.ASCReader(_Lines(_absolute(lines)))
    return can.CanutilsLogReader(_Lines(lines)) if kind == "candump" else can.TRCReader(_Lines(lines))


def _whole(text: Iterable[str], read: list[int]) -> Iterator[str]:
    for number, line in enumerate(text, start=1):
        read[:] = [number]
        if line.endswith("\n"):
            yield line


class _Lines:
    """Lines of text as python-can's readers take them from a file."""

    def __init__(self, lines: Iterator[str]) -> None:
        self._lines = lines

    def __iter__(self) -> Iterator[str]:
        return self._lines

    def __next__(self) -> str:
        return next(self._lines)

    def read(self, size: int = -1) -> str:
        """What is left of the text; python-can itself reads by lines."""
        return "".join(self._lines)

    def close(self) -> None:
        """The file is closed by who opened it."""


def _absolute(lines: Iterator[str]) -> Iterator[str]:
    """Lines of an ASC file with stamps from the start of the measurement.

    Where the head says `timestamps relative`, each line's stamp counts from the line before (Vector's ASC
    format); python-can takes them as they are, so they are summed up here.
    """
    relative, total = False, 0.0
    for line in lines:
        if re.match(r"\s*base\s", line, re.IGNORECASE):
            relative = "relative" in line.lower()
        match = _STAMP.fullmatch(line) if relative else None
        if match is None:
            yield line
            continue
        total += float(match[2])
        yield f"{match[1]}{total:.9f}{match[3]}"


def _check_containers(path: Path) -> None:
    """Refuse a BLF whose packed containers would not fit into memory, or are packed as python-can, which leaves such
    ones out, cannot unpack them."""
    with path.open("rb") as file:
        head = file.read(8)
        file.seek(int.from_bytes(head[4:8], "little"))
        while len(head := file.read(16)) == 16 and head[:4] == b"LOBJ":
            size, kind = int.from_bytes(head[8:12], "little"), int.from_bytes(head[12:16], "little")
            if size < 16:
                raise InputError(f"{path}: damaged BLF log (an object of {size} bytes); record it anew")
            data = file.read(size - 16 + size % 4)
            if kind != 10 or len(data) <= 16:
                continue
            method = int.from_bytes(data[:2], "little")
            if method not in (0, 2):
                raise InputError(
                    f"{path}: damaged BLF log (a container packed by method {method}; 0 and 2 are accepted); "
                    "record it anew"
                )
            if method == 2:
                unpacker = zlib.decompressobj()
                with suppress(zlib.error):
                    unpacker.decompress(data[16:], _MOST_CONTAINER)
                if unpacker.unconsumed_tail:
                    raise InputError(
                        f"{path}: a container unpacks to over {_MOST_CONTAINER >> 20} MB; that is no log"
                    )


def by_dbc(path: Path) -> Callable[[], DecodeFrame]:
    """Decode frames by a DBC file: topic = message, fields = its signals; InputError if it cannot be read."""
    import cantools

    try:
        loaded: Any = cantools.database.load_file(str(path), strict=False)
        table = {(m.frame_id, m.is_extended_frame): m for m in loaded.messages}
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a DBC file") from None
    except Exception as error:  # cantools has many
        raise InputError(
            f"{path}: is no message table ({first_line(error)}); DBC, ARXML, KCD, SYM are read"
        ) from None

    def decode(frame: Frame) -> tuple[str, dict[str, float]] | None:
        message = table.get((frame.identifier, frame.extended))
        if message is None:
            return None
        try:
            values = message.decode(frame.data, decode_choices=False, allow_truncated=True)
        except Exception:  # a frame that does not fit its description is a foreign one
            return None
        return message.name, {k: float(v) for k, v in values.items() if isinstance(v, int | float)}

    return lambda: decode
