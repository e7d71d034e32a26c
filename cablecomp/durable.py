"""Files that are old or new, and whole, whenever power fails.

A rename alone does not promise that: the name may reach the disk before the content does (`fsync(2)`,
`rename(2)`).
"""

from __future__ import annotations

import os
from contextlib import suppress
from errno import EISDIR
from pathlib import Path


def write_durably(path: Path, data: bytes) -> None:
    """Write a file whole, in the place of one that may be there; raises OSError and leaves the old one."""
    if not path.name:
        raise IsADirectoryError(EISDIR, os.strerror(EISDIR), str(path))
    temporary = path.with_name(f".{path.name}.partial-{os.getpid()}")
    try:
        temporary.write_bytes(data)
        replace_durably(temporary, path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def replace_durably(temporary: Path, path: Path) -> None:
    """Put a finished file in the place of another, or a folder where there is none: content first, then the
    name, both on the disk.
    """
    for item in (temporary, *temporary.rglob("*")):
        _sync(item)
    os.replace(temporary, path)
    _sync(path.parent)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        if not path.is_dir():  # there are file systems that cannot sync a folder
            raise
    finally:
        os.close(handle)
