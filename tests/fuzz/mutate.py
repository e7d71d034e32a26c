"""Seeded mutations of bytes, for where no coverage-guided fuzzer is installed, and for the ordinary tests."""

from __future__ import annotations

import random

PIECES = (
    b"nan", b"inf", b"1e999", b"-", b"\n", b",", b'"', b"[", b"{", b"=", b"#", b"\0", b"\xff", b"9" * 400, b"0x",
    b"1e-320", b"true", b"[/red]", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"../", b"\r", b"\t",
)  # fmt: skip


def mutated(seed: bytes, random_: random.Random) -> bytes:
    """One to eight small changes: bits, bytes, pieces cut out, doubled, put in, the end lost."""
    data = bytearray(seed)
    for _ in range(random_.choice((1, 1, 2, 4, 8))):
        if not data:
            return bytes(random_.randbytes(random_.randrange(64)))
        at = random_.randrange(len(data))
        kind = random_.randrange(7)
        if kind == 0:
            data[at] ^= 1 << random_.randrange(8)
        elif kind == 1:
            data[at] = random_.randrange(256)
        elif kind == 2:
            del data[at : at + random_.randrange(1, 30)]
        elif kind == 3:
            data[at:at] = random_.choice(PIECES)
        elif kind == 4:
            data[at:at] = random_.randbytes(random_.randrange(1, 9))
        elif kind == 5:
            other = random_.randrange(len(data))
            data[at:at] = data[other : other + random_.randrange(1, 60)]
        else:
            del data[at:]
    return bytes(data)
