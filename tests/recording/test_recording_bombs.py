"""Small files that unpack without end are refused, or streamed, within bounded memory."""

from __future__ import annotations

import gzip
import io
import json
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

MB = 1 << 20
READ = """
import json, resource, sys
from cablecomp.errors import InputError
from cablecomp.recording.reader import open_recording
import polars, scipy.io, zstandard, lz4.frame, mcap.records
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
before = peak()
answers = []
for path in sys.argv[1:]:
    try:
        answer = f'{sum(block.rows for block in open_recording(path).blocks())} rows'
    except InputError as error:
        answer = f'refused: {error}'
    answers.append((answer, peak() - before))
print(json.dumps(answers))
"""


def gzipped(text: bytes, times: int) -> bytes:
    out = io.BytesIO()
    with gzip.GzipFile(fileobj=out, mode="wb", compresslevel=1, mtime=0) as file:
        file.write(b"time_s,other_x\n0,0\n")
        for _ in range(times):
            file.write(text)
    return out.getvalue()


def npz() -> bytes:
    """Two arrays of 60 million zeros."""
    out = io.BytesIO()
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (60_000_000,)}
    )
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name in ("time_s", "other_x"):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(head.getvalue())
                for _ in range(480):
                    member.write(bytes(1_000_000))
    return out.getvalue()


def mcap(stated: int, compression: bytes, data: bytes) -> bytes:
    """One chunk that states `stated` bytes."""
    chunk = struct.pack("<QQQI", 0, 0, stated, 0) + struct.pack("<I", len(compression)) + compression
    chunk += struct.pack("<Q", len(data)) + data
    records = [(0x06, chunk), (0x0F, bytes(4)), (0x02, bytes(20))]
    magic = b"\x89MCAP0\r\n"
    return magic + b"".join(struct.pack("<BQ", code, len(body)) + body for code, body in records) + magic


def zstd() -> bytes:
    import zstandard

    return zstandard.ZstdCompressor(level=1).compress(bytes(600 * MB))


def lz4() -> bytes:
    import lz4.frame

    return bytes(lz4.frame.compress(bytes(600 * MB)))


def mat() -> bytes:
    """A double array of 10^9 x 1 in one compressed element (MAT-file format, level 5)."""
    name = struct.pack("<II", 1, 6) + b"time_s\0\0"
    size = struct.pack("<II", 5, 8) + struct.pack("<ii", 1_000_000_000, 1)
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    body = flags + size + name + struct.pack("<II", 9, 400_000_000) + bytes(400 * MB)
    packed = zlib.compress(struct.pack("<II", 14, len(body)) + body, 1)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49)
    return head + struct.pack("<II", 15, len(packed)) + packed


CASES: dict[str, tuple[Callable[[], bytes], str]] = {
    "gzip without line breaks": (lambda: gzipped(b"x" * MB, 400), "over a million characters"),
    "gzip of line breaks": (lambda: gzipped(b"\n" * MB, 400), "over a million empty lines"),
    "npz, streamed": (npz, "60000000 rows"),
    "MCAP that states a large chunk": (lambda: mcap(3 << 30, b"zstd", b"x"), "a chunk states"),
    "MCAP whose zstd gives more than stated": (lambda: mcap(100, b"zstd", zstd()), "not of the size"),
    "MCAP whose lz4 gives more than stated": (lambda: mcap(100, b"lz4", lz4()), "not of the size"),
    "MATLAB": (mat, "more than 134,217,728 numbers"),
}


def test_what_unpacks_without_end_needs_little_memory(tmp_path: Path) -> None:
    """One process reads them one after the other; the most that it ever had counts."""
    pytest.importorskip("mcap", reason="optional package mcap is not installed")
    paths = [tmp_path / f"bomb-{k}" for k in range(len(CASES))]
    for path, (make, _) in zip(paths, CASES.values(), strict=True):
        path.write_bytes(make())
    done = subprocess.run(
        [sys.executable, "-c", READ, *map(str, paths)],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    for (case, (_, words)), (answer, grown) in zip(CASES.items(), json.loads(done.stdout), strict=True):
        assert words in answer, case
        assert grown < 250, f"{case}: grew to {grown} MB more"
