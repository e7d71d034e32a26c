"""Where a fleet's recordings lie: `FOLDER/JOINT/NIGHT`, a night being a recording or a folder of recordings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cablecomp import __version__
from cablecomp.errors import InputError
from cablecomp.recording.folder import SUFFIXES, find_recordings
from cablecomp.recording.mapping import find_mapping

JOINT_FILE: Final = "joint.toml"


@dataclass(frozen=True)
class Night:
    """One joint's recordings of one night, and the configuration that holds for them."""

    joint: str
    name: str
    recordings: tuple[Path, ...]
    config: Path

    def fingerprint(self, what: str) -> str:
        """Digest of what a row is made from: the work, version, configuration, and each recording's path, size
        and date, and the mapping that is saved beside it."""
        found = hashlib.sha256(f"{what} {__version__}\n".encode() + self.config.read_bytes())
        for path in self.recordings:
            stat = path.stat()
            found.update(
                f"{path.resolve()} {stat.st_size} {stat.st_mtime_ns}\n".encode("utf-8", "surrogateescape")
            )
            mapping = find_mapping(path)
            found.update(b"" if mapping is None else mapping.read_bytes())
        return found.hexdigest()


def nights(folders: Sequence[Path], config: Path | None, out: Path | None = None) -> list[Night]:
    """Every joint's nights, in order.

    A folder inside `folders` is a joint; what lies in it are its nights. A `joint.toml` in the joint's folder holds
    for it, else `config`. Raises InputError where a folder holds no joint or a joint has no configuration, or where
    `out`, what is written into, would be one of its joints the next time.
    """
    found: list[Night] = []
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"{folder}: is no folder; a fleet lies in FOLDER/JOINT/RECORDING")
        if out is not None and out.resolve().is_relative_to(folder.resolve()):
            raise InputError(
                f"{out}: lies in {folder}, whose folders are joints; give another place with --out"
            )
        inside = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
        if not inside:
            raise InputError(f"{folder}: holds no folder; a fleet lies in FOLDER/JOINT/RECORDING")
        for joint in inside:
            found += _of_joint(joint, config)
    twice = {
        (n.joint, n.name) for n in found if [(m.joint, m.name) for m in found].count((n.joint, n.name)) > 1
    }
    if twice:
        joint_name, night = sorted(twice)[0]
        raise InputError(f"{joint_name}/{night}: two places have this joint and night; rename one of them")
    return found


def strays(folders: Sequence[Path]) -> list[str]:
    """A line for each folder of a fleet with recordings that lie in no joint's folder: these are left out."""
    found = []
    for folder in folders:
        names = sorted(p.name for p in folder.iterdir() if p.is_file() and p.name.lower().endswith(SUFFIXES))
        if names:
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            found.append(f"{folder}: {names[0]}{more}: left out, as in no joint's folder")
    return found


def _of_joint(folder: Path, config: Path | None) -> list[Night]:
    own = folder / JOINT_FILE
    if not own.exists() and config is None:
        raise InputError(f"{own}: is missing; add it, or give one for all joints with --config")
    config = own if own.exists() or config is None else config
    by_night: dict[str, list[Path]] = {}
    for path in find_recordings([folder]):
        by_night.setdefault(path.relative_to(folder).parts[0], []).append(path)
    return [Night(folder.name, name, tuple(paths), config) for name, paths in by_night.items()]
