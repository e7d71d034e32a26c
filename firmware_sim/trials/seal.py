"""The seal: all truths in one archive whose SHA-256 is given away before anything is diagnosed."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from firmware_sim.plant import PlantError

SEALED, TRUTH = "sealed.zip", "truth.json"
_LONG_AGO = (1993, 12, 1, 0, 0, 0)  # so that the archive depends on its contents alone


def write_seal(path: Path, files: Mapping[str, str]) -> str:
    """Write the archive and return its SHA-256 in hexadecimal digits; equal contents give equal digits."""
    spare = path.with_name(path.name + ".part")
    with zipfile.ZipFile(spare, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _LONG_AGO), files[name], zipfile.ZIP_DEFLATED)
    spare.replace(path)
    return digest(path)


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def open_truth(path: Path) -> dict[int, dict[str, Any]]:
    """The truths by trial number; raises PlantError if the archive cannot be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read(TRUTH))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise PlantError(f"{path}: is no sealed truth ({error}); give the sealed.zip of a run") from None
    return {int(t["trial"]): t for t in data["trials"]}
