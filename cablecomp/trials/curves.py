"""What size of each concealed physics was found, and how often a name was given where nothing was put."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan
from statistics import median
from typing import Any

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.trials.run import Verdict
from cablecomp.trials.shares import Rate, finite, rate

MOVED_SD = 3.0
"""Stated standard deviations by which a value has to leave its twin's to count as moved."""


@dataclass(frozen=True)
class Concealed:
    """One trial beside its twin, which differs by nothing but what is concealed.

    `physics`: its id ("twin" for the twin itself); `accepted`: names that are right; `size` in `unit`; `share`:
    the same as it was drawn; `new`: names that its twin was not given; `grown`: right names that its twin was given
    too, with other values; `located`: the residual's first covariate is the right one, and not the twin's; `moved`:
    calibrated values that left the twin's.
    """

    number: int
    round: int
    physics: str
    words: str
    accepted: tuple[str, ...]
    calibrates: bool
    share: float
    size: float
    unit: str
    named: tuple[str, ...]
    new: tuple[str, ...]
    grown: tuple[str, ...]
    located: bool
    moved: tuple[str, ...]
    confidence: float
    seconds: float
    failed: str

    @property
    def found(self) -> bool:
        """Whether what was put was found: a right name is new, or its values have left the twin's; where there is
        none, it is located, or calibrated away."""
        if self.accepted:
            return bool(self.grown) or any(n in self.accepted for n in self.new)
        return bool(self.moved) if self.calibrates else self.located

    @property
    def wrong(self) -> bool:
        """Whether a name is new that is not right."""
        return any(n not in self.accepted for n in self.new)


_NOTHING: Mapping[str, Any] = {"missing_physics": [], "candidates": [], "mismatch": [], "calibration": {}}


def score_concealed(truth: Mapping[str, Any], verdict: Verdict, twin: Mapping[str, Any] | None) -> Concealed:
    """Score one trial's verdict beside its twin's `diagnosis.json`, None where that one failed."""
    said, twin = verdict.said or _NOTHING, twin or _NOTHING
    accepted = tuple(truth["named"])
    names = tuple(m["effect"] for m in said["missing_physics"])
    before = {m["effect"]: m["parameters"] for m in twin["missing_physics"]}
    both = {m["effect"]: m["parameters"] for m in said["missing_physics"] if m["effect"] in before}
    weighed = [
        m["confidence"] or 0.0
        for m in (*said["missing_physics"], *said["candidates"])
        if m["effect"] in accepted
    ]
    first, theirs = _first(said), _first(twin)
    return Concealed(
        int(truth["trial"]),
        int(truth["round"]),
        truth["physics"],
        truth["words"],
        accepted,
        bool(truth["calibrates"]),
        float(truth["share"]),
        nan if truth["size"] is None else float(truth["size"]),
        truth["unit"],
        names,
        tuple(n for n in names if n not in before) if truth["physics"] != "twin" else (),
        tuple(n for n in accepted if n in both and any(_moved(both[n], before[n]))),
        first in truth["shows_in"] and first != theirs,
        tuple(_moved(said["calibration"], twin["calibration"])),
        max(weighed, default=0.0),
        verdict.seconds,
        verdict.failed,
    )


def _first(said: Mapping[str, Any]) -> str:
    """The covariate that the residual follows most, if it does so beyond chance."""
    mismatch = said["mismatch"]
    return mismatch[0]["covariate"] if mismatch and (mismatch[0]["p_value"] or 0.0) < 0.05 else ""


def _moved(mine: Mapping[str, Any], theirs: Mapping[str, Any]) -> Iterable[str]:
    for name in sorted(mine.keys() & theirs.keys()):
        a, b = mine[name], theirs[name]
        if not isinstance(a, Mapping) or not isinstance(b, Mapping):
            continue  # a channel's name
        if None in (a["value"], b["value"], a["sd"], b["sd"]):
            continue
        sd = max(float(a["sd"]), float(b["sd"]))
        if sd > 0.0 and abs(float(a["value"]) - float(b["value"])) > MOVED_SD * sd:
            yield name


@dataclass(frozen=True)
class Point:
    """Trials of one size of a physics: how many were found, located, and given a wrong name besides."""

    share: float
    size: float
    found: Rate
    located: Rate
    wrong: Rate


@dataclass(frozen=True)
class Curve:
    """All sizes of one physics, smallest first. `in_twins`: twins that were given its name although nothing was
    put: hardware has physics of its own. `from_size`: smallest size from which on all were found; NaN where not even
    the largest."""

    physics: str
    words: str
    names: tuple[str, ...]
    unit: str
    points: tuple[Point, ...]
    in_twins: Rate
    from_size: float


@dataclass(frozen=True)
class Curves:
    """The answer: curves, twins and names given to them, trials done of those planned, what was asked for."""

    curves: tuple[Curve, ...]
    twins: int
    names_in_twins: Mapping[str, int]
    done: int
    of: int
    wrong: Rate
    rows: tuple[Concealed, ...]
    wish: Mapping[str, Any]

    def as_json(self) -> dict[str, Any]:
        """The contents of `concealed.json`."""
        found: dict[str, Any] = finite(
            {
                "schema": 1,
                **dict(self.wish),
                "done": self.done,
                "of": self.of,
                "twins": self.twins,
                "names_in_twins": dict(self.names_in_twins),
                "wrong_names": self.wrong.entry(),
                "sure_from": LIMITS.name,
                "curves": [_curve(c) for c in self.curves],
                "rows": [asdict(r) | {"found": r.found, "wrong": r.wrong} for r in self.rows],
            }
        )
        return found


def curves(rows: Sequence[Concealed], of: int, wish: Mapping[str, Any]) -> Curves:
    """Put all trials that were done together; those of a piece whose twin failed count as done alone."""
    twins = [r for r in rows if r.physics == "twin" and not r.failed]
    alone = {r.round for r in rows if r.physics == "twin" and r.failed}
    put = [r for r in rows if r.physics != "twin" and r.round not in alone]
    given: dict[str, int] = {}
    for twin in twins:
        for name in twin.named:
            given[name] = given.get(name, 0) + 1
    kinds = dict.fromkeys(r.physics for r in put)
    return Curves(
        tuple(_of(kind, [r for r in put if r.physics == kind], twins) for kind in kinds),
        len(twins),
        given,
        len(rows),
        of,
        rate(put, lambda r: r.wrong),
        tuple(rows),
        wish,
    )


def _of(physics: str, rows: Sequence[Concealed], twins: Sequence[Concealed]) -> Curve:
    first = rows[0]
    points = []
    for share in sorted({r.share for r in rows}):
        here = [r for r in rows if r.share == share]
        points.append(
            Point(
                share,
                median(r.size for r in here),
                rate(here, lambda r: r.found),
                rate(here, lambda r: r.located),
                rate(here, lambda r: r.wrong),
            )
        )
    size = nan
    for p in reversed(points):
        if p.found.hits < p.found.of:
            break
        size = p.size
    named = rate(twins, lambda t: any(n in first.accepted for n in t.named))
    return Curve(
        physics,
        first.words,
        first.accepted,
        first.unit,
        tuple(points),
        named,
        size,
    )


def _curve(c: Curve) -> dict[str, Any]:
    return {
        "physics": c.physics,
        "words": c.words,
        "names": list(c.names),
        "unit": c.unit,
        "found_from": c.from_size if isfinite(c.from_size) else None,
        "named_in_twins": c.in_twins.entry(),
        "points": [
            {
                "share": p.share,
                "size": p.size,
                "found": p.found.entry(),
                "located": p.located.entry(),
                "wrong_name": p.wrong.entry(),
            }
            for p in c.points
        ],
    }
