"""Opening a sealed truth: check its SHA-256 against what was printed first, then read it as plain objects."""

from __future__ import annotations

import hashlib
import json
import tomllib
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cablecomp.config import JointConfig, parse_joint
from cablecomp.effects import catalogue
from cablecomp.errors import InputError


@dataclass(frozen=True)
class TrueEffect:
    """One concealed effect: id, parameters as a joint configuration states them, size (RMS contribution over
    the plain loop's width), and the covariates in which it shows, best first."""

    id: str
    parameters: Mapping[str, float | str]
    size: float
    covariates: tuple[str, ...]

    @property
    def known(self) -> bool:
        """Whether it is in the catalogue."""
        return self.id in catalogue()


@dataclass(frozen=True)
class Truth:
    """What is true of one trial.

    `kind`: single, pair, nothing, parameters, unknown or confounded; `partner`: the other explanation of a
    confounded trial; `true` drive values by name; `model`: the configuration with true parameters and the
    true effects, as far as a configuration can state them.
    """

    number: int
    kind: str
    case: str
    partner: str
    excitation: str
    effects: tuple[TrueEffect, ...]
    loop_rad: float
    floor_rad: float
    true: Mapping[str, float]
    offset_rad: float
    model: JointConfig

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of what is concealed."""
        return tuple(e.id for e in self.effects)

    @property
    def size(self) -> float:
        """Size of the smallest concealed effect; NaN if there is none."""
        return min((e.size for e in self.effects), default=float("nan"))

    @property
    def label(self) -> str:
        """What stands in the confusion matrix for it."""
        if self.kind == "single":
            return self.names[0]
        return {"pair": "a pair", "unknown": "unknown physics", "confounded": "confounded"}.get(
            self.kind, f"{self.kind} off" if self.kind == "parameters" else self.kind
        )


def digest(path: Path) -> str:
    """SHA-256 of a file in hexadecimal digits; raises InputError if it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); give the sealed truth of a run"
        ) from None


def open_sealed(path: Path, sha256: str) -> dict[int, Truth]:
    """Check the seal and read the truths by trial number; raises InputError if it was broken or is none."""
    found = digest(path)
    if found != sha256:
        raise InputError(
            f"{path}: its SHA-256 is {found}, and {sha256} was given first; the truth was changed, run again"
        )
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read("truth.json"))
            return {int(t["trial"]): _truth(t, archive) for t in data["trials"]}
    except (KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is no sealed truth ({error}); run `cablecomp prove` again") from None


def _truth(t: Mapping[str, Any], archive: zipfile.ZipFile) -> Truth:
    where = f"models/{int(t['trial']):05d}/true-model.toml"
    model = parse_joint(tomllib.loads(archive.read(where).decode()), where)
    effects = tuple(
        TrueEffect(e["id"], e["parameters"], float(e["size"]), tuple(e["covariates"])) for e in t["effects"]
    )
    return Truth(
        int(t["trial"]),
        t["kind"],
        t["case"],
        t["partner"],
        t["excitation"],
        effects,
        float(t["loop_rad"]),
        float(t["noise_floor_rad"]),
        t["true"],
        float(t["offset_rad"]),
        model,
    )
