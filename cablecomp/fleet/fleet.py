"""A fleet from end to end: every night's row, kept as it comes; a table; what became of each joint."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import polars as pl

from cablecomp.cluster import Workers, spread
from cablecomp.effects import catalogue
from cablecomp.fleet.change import FEWEST, change
from cablecomp.fleet.places import Night
from cablecomp.fleet.rows import Row, diagnosed_row, replayed_row
from cablecomp.recording.atomic import atomic_file

Work = Literal["replay", "diagnose"]
Tell = Callable[[int, int], None]
_WORK: Final[dict[str, Callable[[Night], Row]]] = {"replay": replayed_row, "diagnose": diagnosed_row}
_STRAND_LOSS: Final = 0.01
"""Least growth of compliance that is called a loss of strands: half of one wire of 49."""
_ZERO_SD: Final = 2e-5
"""rad; a night's zero is taken to be known to this at best, the noise of a good joint encoder."""
_RATIO_SD: Final = 0.002


@dataclass(frozen=True)
class JointStory:
    """What a joint's nights say, in order: `words` for a reader, `flags` among drifts, slips, loses strands."""

    joint: str
    nights: int
    failed: int
    flags: tuple[str, ...]
    words: tuple[str, ...]


@dataclass(frozen=True)
class Fleet:
    """One row for each joint and night, and each joint's story."""

    work: Work
    rows: tuple[Row, ...]
    joints: tuple[JointStory, ...]
    reused: int


def run_fleet(work: Work, places: Sequence[Night], out: Path, workers: Workers, tell: Tell) -> Fleet:
    """Work through all nights; writes `rows/*.json` as they come, then `fleet.csv`.

    A row that is there and was made from the same files is taken as it is: what was interrupted goes on where
    it stopped. A night that fails is a row that says why, and is tried again the next time.
    """
    out.mkdir(parents=True, exist_ok=True)
    prints = [night.fingerprint(work) for night in places]
    rows: list[Row | None] = [_kept(out, *pair) for pair in zip(places, prints, strict=True)]
    open_ = [k for k, row in enumerate(rows) if row is None]
    reused = len(places) - len(open_)
    tell(reused, len(places))
    for count, done in enumerate(spread(_WORK[work], [(places[k],) for k in open_], workers), start=1):
        k = open_[done.job]
        night = places[k]
        row = {"joint": night.joint, "night": night.name, "failed": done.failed, **(done.result or {})}
        _keep(out, night, prints[k], row)
        rows[k] = row
        tell(reused + count, len(places))
    whole = tuple(row for row in rows if row is not None)
    with atomic_file(out / "fleet.csv") as path:
        pl.DataFrame(whole, infer_schema_length=None).write_csv(path)
    return Fleet(work, whole, tuple(_stories(whole)), reused)


def _place(out: Path, night: Night) -> Path:
    return out / "rows" / f"{night.joint}--{night.name}.json"


def _kept(out: Path, night: Night, fingerprint: str) -> Row | None:
    try:
        found = json.loads(_place(out, night).read_text(encoding="utf-8"))
        row: Row = found["row"]
        return row if found["made_from"] == fingerprint and not row["failed"] else None
    except (OSError, ValueError, KeyError, TypeError):  # not there, or not ours: made anew
        return None


def _keep(out: Path, night: Night, fingerprint: str, row: Row) -> None:
    path = _place(out, night)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as spare:
        spare.write_text(json.dumps({"made_from": fingerprint, "row": row}) + "\n", encoding="utf-8")


def _stories(rows: Sequence[Row]) -> Iterator[JointStory]:
    for joint in dict.fromkeys(row["joint"] for row in rows):
        own = [row for row in rows if row["joint"] == joint]
        good = [row for row in own if not row["failed"]]
        found = list(_story(good))
        flags = tuple(dict.fromkeys(flag for flag, _ in found if flag))
        words = tuple(text for _, text in found)
        yield JointStory(joint, len(own), len(own) - len(good), flags, words)


def _story(rows: Sequence[Row]) -> Iterator[tuple[str, str]]:
    yield from _zeros(rows)
    ratios = [row for row in rows if row.get("compliance_ratio") is not None]
    found = change([row["compliance_ratio"] for row in ratios], _RATIO_SD)
    if found.how and found.size > _STRAND_LOSS:
        when = f"from {ratios[found.at]['night']} on" if found.how == "step" else "from night to night"
        yield "loses strands", f"compliance under load grows by {100 * found.size:.1f} % {when}"
    for row in rows:
        if row.get("missing"):
            yield _named(row["missing"]), f"{row['night']}: {row['missing'].replace('_', ' ')}"
    if len(rows) < FEWEST and any(row.get("zero_rad") is not None for row in rows):
        yield (
            "",
            f"{len(rows)} night{'s' if len(rows) != 1 else ''}: too few to tell a change from scatter ({FEWEST} are)",
        )


def _zeros(rows: Sequence[Row]) -> Iterator[tuple[str, str]]:
    """Changes of the zero: inside of a night, at once between nights, slowly."""
    for row in rows:
        if row.get("step_within_rad"):
            yield (
                "slips",
                f"{row['night']}: zero steps by {1e3 * row['step_within_rad']:.3g} mrad within the recording",
            )
    zeros = [row for row in rows if row.get("zero_rad") is not None]
    found = change([row["zero_rad"] for row in zeros], _ZERO_SD)
    if found.how == "trend":
        yield "drifts", f"zero moves by {1e3 * found.size:.3g} mrad over {len(zeros)} nights"
    elif found.how == "step":
        yield "slips", f"zero steps by {1e3 * found.size:.3g} mrad from {zeros[found.at]['night']} on"


def _named(missing: str) -> str:
    """The flag that a named effect stands for."""
    known = catalogue()
    flags = (known[name].flag for name in missing.split(", ") if name in known)
    return next((flag for flag in flags if flag), "")
