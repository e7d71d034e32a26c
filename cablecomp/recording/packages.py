"""Optional packages: imported when a file needs them, with a line that says what to install."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from cablecomp.errors import InputError


def package(name: str, path: Path, extra: str, what: str) -> Any:
    """The module `name`; InputError that names the extra if its package is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"{path}: {what} needs the package {name.partition('.')[0]}; install it with "
            f"`pip install cablecomp[{extra}]`"
        ) from None
