"""The seals: each trial's truth in an archive whose SHA-256 is given away before anything is diagnosed."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from firmware_sim.plant import PlantError

SEALED, TRUTH, ANGLES = "sealed", "truth.json", "truth.npz"
_LONG_AGO = (1993, 12, 1, 0, 0, 0)  # so that an archive depends on its contents alone


def truth_text(truth: Mapping[str, Any]) -> str:
    """A truth as JSON."""
    return json.dumps(truth, indent=1) + "\n"


def write_seal(path: Path, files: Mapping[str, str | bytes]) -> None:
    """Write one trial's archive; equal contents give equal bytes, and it appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    spare = path.with_name(path.name + ".part")
    with zipfile.ZipFile(spare, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _LONG_AGO), files[name], zipfile.ZIP_DEFLATED)
    spare.replace(path)


def digest(folder: Path) -> str:
    """SHA-256 over the SHA-256 of each seal in turn, in hexadecimal digits."""
    parts = [hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.glob("*.zip"))]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def open_truth(path: Path) -> dict[str, Any]:
    """The truth of one trial; raises PlantError if the archive cannot be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            truth: dict[str, Any] = json.loads(archive.read(TRUTH))
            return truth
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise PlantError(f"{path}: is no sealed truth ({error}); give one of a run's sealed/*.zip") from None
