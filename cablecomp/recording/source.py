"""Opening a file by what it holds, not by its ending, and streaming its bytes (gzip unpacked on the way)."""

from __future__ import annotations

import queue
import stat
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Literal, NamedTuple

from cablecomp.errors import InputError
from cablecomp.recording.can_log import can_kind

Kind = Literal["text", "parquet", "mcap", "npz", "mat", "hdf5", "bag", "blf", "asc", "candump", "trc", "mf4"]

CHUNK: Final = 1 << 22
_SNIFF: Final = 8192
_GZIP: Final = b"\x1f\x8b"
_READABLE: Final[dict[bytes, Kind]] = {
    b"PAR1": "parquet",
    b"\x89MCAP0\r\n": "mcap",
    b"PK\x03\x04": "npz",
    b"MATLAB 5": "mat",
    b"\x89HDF\r\n\x1a\n": "hdf5",
    b"#ROSBAG": "bag",
    b"SQLite format 3": "bag",
}
_FOREIGN: Final[dict[bytes, str]] = {
    b"BZh": "bzip2-compressed",
    b"\xfd7zXZ\x00": "xz-compressed",
    b"\x28\xb5\x2f\xfd": "zstd-compressed",
    b"7z\xbc\xaf": "a 7-zip archive",
    b"ARROW1": "an Arrow file",
    b"%PDF": "a PDF",
    b"\x89PNG": "a PNG image",
    b"\xff\xfe": "UTF-16 text",
    b"\xfe\xff": "UTF-16 text",
    b"\xd0\xcf\x11\xe0": "an old Excel file",
    b"# Created by Octave": "Octave's text format (its `save -v7` writes a .mat that is read)",
    b"{": "JSON text",
    b"[{": "JSON text",
}
_ACCEPTED: Final = (
    "accepted are CSV text (plain or gzip), Parquet, .npz, .mat, HDF5, MCAP, ROS bags, "
    "CAN logs (BLF, ASC, candump, TRC, MF4)"
)


class Truncated(Exception):
    """The compressed stream ends early or is damaged; the text says which."""


class Opened(NamedTuple):
    """`kind` of the content and whether it is packed with gzip."""

    kind: Kind
    gzipped: bool


class Piece(NamedTuple):
    """Bytes of the (unpacked) text, and the share of the file read up to here."""

    data: bytes
    fraction: float


def identify(path: Path) -> Opened:
    """Look at a file's first bytes; InputError if it is missing, empty or nothing that can be read."""
    if (path / "metadata.yaml").is_file():
        return Opened("bag", False)
    try:
        if not (stat.S_ISREG(mode := path.stat().st_mode) or stat.S_ISDIR(mode)):
            raise InputError(
                f"{path}: is a pipe or a device; write what comes from it to a file, and give that"
            )
        with path.open("rb") as file:
            head = file.read(_SNIFF)
    except IsADirectoryError:
        inside = next((p for p in sorted(path.iterdir()) if p.suffix in (".db3", ".mcap")), None)
        if inside is not None:
            raise InputError(
                f"{path}: is a bag without its metadata.yaml; give {inside}, or run `ros2 bag reindex` on it"
            ) from None
        raise InputError(f"{path}: is a directory; give the path of one recording") from None
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist; give the path of a recording") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the permissions") from None
    if not head:
        raise InputError(f"{path}: is empty; record or export it anew")
    if not head.startswith(_GZIP):
        return Opened(_kind(path, head, ""), False)
    try:
        inner = next(chunks(path, gzipped=True, size=_SNIFF), Piece(b"", 1.0)).data
    except Truncated as error:
        raise InputError(f"{path}: {error}; copy or record the file anew") from None
    if not inner:
        raise InputError(f"{path}: is gzip of an empty file; record or export it anew")
    kind = _kind(path, inner[:_SNIFF], "gzip of ")
    if kind != "text":
        raise InputError(f"{path}: is gzip of {kind}; unpack it first, gzip is accepted around CSV only")
    return Opened(kind, True)


def chunks(path: Path, gzipped: bool, size: int = CHUNK) -> Iterator[Piece]:
    """Stream a file's bytes, unpacked if `gzipped` (several members are allowed); raises Truncated."""
    total = max(path.stat().st_size, 1)
    with path.open("rb") as file:
        if not gzipped:
            while data := file.read(size):
                yield Piece(data, file.tell() / total)
            return
        yield from _inflate(file, total, size)


def ahead(pieces: Iterator[Piece], depth: int = 3) -> Iterator[Piece]:
    """Run an iterator in a thread, up to `depth` pieces ahead: unpacking overlaps with parsing."""
    box: queue.Queue[Piece | BaseException | None] = queue.Queue(depth)
    done = threading.Event()

    def put(item: Piece | BaseException | None) -> bool:
        while not done.is_set():
            try:
                box.put(item, timeout=0.1)
                return True
            except queue.Full:
                continue
        return False

    def work() -> None:
        try:
            for piece in pieces:
                if not put(piece):
                    return
            put(None)
        except BaseException as error:  # handed to the reader, which raises it
            put(error)

    thread = threading.Thread(target=work, name="recording-unpack", daemon=True)
    thread.start()
    try:
        while (item := box.get()) is not None:
            if isinstance(item, BaseException):
                raise item
            yield item
    finally:
        done.set()
        thread.join()


def _kind(path: Path, head: bytes, wrapper: str) -> Kind:
    for magic, kind in _READABLE.items():
        if head.startswith(magic):
            return "hdf5" if kind == "mat" and head[512:520].startswith(b"\x89HDF") else kind
    if head.startswith(b"MATLAB 7.3"):
        return "hdf5"
    for magic, name in _FOREIGN.items():
        if head.startswith(magic):
            raise InputError(f"{path}: is {wrapper}{name}; {_ACCEPTED}: convert it first")
    log = can_kind(head)
    if log is not None:
        return log
    if b"\0" in head:
        ending = f" although it is named {path.suffix}" if path.suffix else ""
        if path.suffix == ".mat":
            ending += " (one of MATLAB 4? its `save -v7` writes one that is read)"
        raise InputError(f"{path}: is {wrapper}binary data of an unknown kind{ending}; {_ACCEPTED}")
    return "text"


def _inflate(file: BinaryIO, total: int, size: int) -> Iterator[Piece]:
    unpacker = zlib.decompressobj(wbits=31)
    data = b""
    while True:
        data = data or file.read(size // 4)
        if not data:
            break
        if unpacker.eof:
            if not data.strip(b"\0"):  # padding after the last member is allowed
                data = b""
                continue
            unpacker = zlib.decompressobj(wbits=31)
        try:
            out = unpacker.decompress(data, size)
        except zlib.error as error:
            raise Truncated(f"gzip data is damaged near byte {file.tell()} ({error})") from None
        data = unpacker.unused_data if unpacker.eof else unpacker.unconsumed_tail
        if out:
            yield Piece(out, file.tell() / total)
    if not unpacker.eof:
        raise Truncated(f"gzip data ends early (file cut at byte {total})")
