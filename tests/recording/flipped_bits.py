"""Bits flipped in a file that carries checksums."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cablecomp.errors import InputError
from cablecomp.recording.reader import read_all


def same_or_refused(path: Path, whole: bytes, seed: int, count: int = 120) -> None:
    """Flip single bits: every time the rows are the same, or the file is refused; never other rows."""
    path.write_bytes(whole)
    expected = {name: values.tobytes() for name, values in read_all(path).columns.items()}
    rng = np.random.default_rng(seed)
    refused = 0
    for place in rng.integers(0, len(whole), count):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            found = {name: values.tobytes() for name, values in read_all(path).columns.items()}
        except InputError:
            refused += 1
            continue
        assert found == expected, f"byte {place}"
    assert refused > count // 2
