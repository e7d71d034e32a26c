"""Opening sealed truths: check their SHA-256 against what was printed first, then read them as plain data."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT
from cablecomp.signal.smoothing import FloatArray

SEALED: str = "sealed"
_AGAIN = "the truth was changed, run again in another folder"


def digest(folder: Path) -> str:
    """SHA-256 over the SHA-256 of each sealed truth in turn, in hexadecimal digits; InputError if there is none."""
    paths = sorted(folder.glob("*.zip")) if folder.is_dir() else []
    if not paths:
        raise InputError(f"{folder}: holds no sealed truth; give the folder of a run")
    parts = [hashlib.sha256(p.read_bytes()).hexdigest() for p in paths]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def check_seal(folder: Path, sha256: str) -> list[Path]:
    """The sealed truths in order, once they are those that were committed to; raises InputError if they are not."""
    found = digest(folder)
    if found != sha256:
        raise InputError(f"{folder}: its SHA-256 is {found}, and {sha256} was given first; {_AGAIN}")
    return sorted(folder.glob("*.zip"))


def read_sealed(path: Path) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Truth and true angles (none where the plant is not ours) of one trial; raises InputError for what is no seal."""
    try:
        with zipfile.ZipFile(path) as archive:
            truth = json.loads(archive.read("truth.json"))
            angles: dict[str, FloatArray] = {}
            if "truth.npz" in archive.namelist():
                with np.load(io.BytesIO(archive.read("truth.npz"))) as data:
                    angles = {name: data[name] for name in data.files}
            return truth, angles
    except (OSError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is no sealed truth ({error}); run `cablecomp prove` again") from None


@dataclass(frozen=True)
class TrueEffect:
    """One concealed effect.

    `id`: of the catalogue, or a stranger's; `form`: "catalogue", another law's name, or "stranger"; `role`: "main" or
    "companion" (far smaller); `parameters` as a joint configuration states them; `size`: RMS contribution over
    the plain loop's width; `covariates` in which it shows, best first; `nearest`: names that are right for it;
    `channel`: the output in which it shows.
    """

    id: str
    parameters: Mapping[str, float | str]
    size: float
    covariates: tuple[str, ...]
    form: str = "catalogue"
    role: str = "main"
    nearest: tuple[str, ...] = ()
    channel: str = JOINT

    @property
    def known(self) -> bool:
        """Whether it is in the catalogue, by whatever law."""
        return self.id in catalogue()

    @property
    def listed(self) -> bool:
        """Whether its law is the catalogue's."""
        return self.form == "catalogue"


@dataclass(frozen=True)
class Truth:
    """What is true of one trial.

    `kind`: single, pair, none, stranger, sessions, confounded or motor; `partner`: the other explanation of a
    confounded trial; `depends_on`: (parameter, on) pairs; `imperfections`: by name, with what each was drawn to
    be; `true` drive values by name.
    """

    number: int
    kind: str
    case: str
    partner: str
    excitation: str
    effects: tuple[TrueEffect, ...]
    depends_on: tuple[tuple[str, str], ...]
    imperfections: Mapping[str, Mapping[str, Any]]
    loop_rad: float
    floor_rad: float
    true: Mapping[str, float]

    @property
    def main(self) -> tuple[TrueEffect, ...]:
        """What the trial is about."""
        return tuple(e for e in self.effects if e.role == "main")

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of what the trial is about."""
        return tuple(e.id for e in self.main)

    @property
    def in_joint(self) -> bool:
        """Whether something that the trial is about shows in the joint's angle."""
        return any(e.channel == JOINT for e in self.main)

    @property
    def right(self) -> frozenset[str]:
        """Every name that is right: what is there, what an imperfection is in small, what a stranger is nearest to."""
        here = {n for e in self.effects for n in (e.id, *(e.nearest if not e.known else ()))}
        return frozenset(here | {n for i in self.imperfections.values() for n in i.get("acts_as", ())})

    @property
    def size(self) -> float:
        """Size of the smallest effect that the trial is about; NaN if there is none."""
        return min((e.size for e in self.main), default=float("nan"))

    @property
    def laws(self) -> str:
        """Whose laws the trial's effects follow: "catalogue", "other" (one of them at least), "stranger", "none"."""
        if not self.main:
            return "none"
        if any(not e.known for e in self.main):
            return "stranger"
        return "catalogue" if all(e.listed for e in self.main) else "other"

    @property
    def label(self) -> str:
        """What stands in the confusion matrix for it."""
        words = {
            "pair": "a pair",
            "stranger": "a stranger",
            "none": "nothing",
            "sessions": self.case or "sessions",
        }
        return self.names[0] if self.kind in ("single", "motor") else words.get(self.kind, self.kind)


def truth_from(t: Mapping[str, Any]) -> Truth:
    """A trial's truth out of its plain data; raises InputError for what is none."""
    try:
        effects = tuple(
            TrueEffect(
                e["effect"], e["parameters"], float(e["size"]), tuple(e["covariates"]), e["form"], e["role"],
                tuple(e["nearest"]), e.get("channel", JOINT),
            )
            for e in t["effects"]
        )  # fmt: skip
        return Truth(
            int(t["trial"]),
            t["kind"],
            t["case"],
            t["partner"],
            t["recordings"][0]["course"],
            effects,
            tuple((d["parameter"], d["on"]) for d in t["depends_on"]),
            t["imperfections"],
            float(t["loop_rad"]),
            float(t["noise_floor_rad"]),
            t["true"],
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"a sealed truth lacks or misstates {error}; run `cablecomp prove` again") from None
