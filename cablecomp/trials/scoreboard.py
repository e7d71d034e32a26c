"""The scoreboard of blind trials: rates with their intervals against what is to be reached, and what they hang on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import isfinite, nan
from typing import Any

import numpy as np

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.trials.calibrated import (
    brier,
    calibration_error,
    equal_counts,
    perfect_error,
    risk_area,
    risk_coverage,
)
from cablecomp.trials.row import Named, Row
from cablecomp.trials.shares import Rate, bootstrapped, finite, quantile, rate

SIZE_EDGES = (0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.35, 0.6001)


@dataclass(frozen=True)
class Target:
    """A figure with its 95 % interval, against `least` or `most` (both None: told, not judged); `ok` None if
    there were no trials, or nothing is asked."""

    what: str
    reached: float
    interval: tuple[float, float]
    of: int
    least: float | None = None
    most: float | None = None
    unit: str = "%"

    @property
    def ok(self) -> bool | None:
        """Whether it is reached."""
        if not isfinite(self.reached) or (self.least is None and self.most is None):
            return None
        return (self.least is None or self.reached >= self.least) and (
            self.most is None or self.reached <= self.most
        )


@dataclass(frozen=True)
class Part:
    """Trials of one sort (a law, an imperfection, a size): named first and located where decidable, wrong names
    of all."""

    name: str
    trials: int
    right: Rate
    located: Rate
    wrong: Rate
    low: float = nan
    high: float = nan


@dataclass(frozen=True)
class Trust:
    """Whether confidence can be trusted, over all effects that were weighed: expected calibration error, that of a
    perfect confidence on as many (mean, 2.5 and 97.5 %), Brier score, area under risk against coverage by confidence
    and by z alone, the curve itself, and the bins that the calibration error counts (lowest, highest, mean confidence,
    true)."""

    of: int
    error: float
    perfect: tuple[float, float, float]
    brier: float
    area: float
    area_by_z: float
    coverage: tuple[float, ...]
    risk: tuple[float, ...]
    risk_by_z: tuple[float, ...]
    bins: tuple[tuple[float, float, float, Rate], ...]


@dataclass(frozen=True)
class Scoreboard:
    """All scores of a run; `wish` is what was asked for, `confusion[truth][outcome]` counts trials."""

    sha256: str
    wish: Mapping[str, Any]
    rows: tuple[Row, ...]
    targets: tuple[Target, ...]
    confusion: dict[str, dict[str, int]]
    by_law: tuple[Part, ...]
    by_imperfection: tuple[Part, ...]
    by_size: tuple[Part, ...]
    trust: Trust

    @property
    def counted(self) -> str:
        """How many trials are scored, and of how many where some are still to be diagnosed."""
        asked = int(self.wish["trials"])
        return str(asked) if len(self.rows) == asked else f"{len(self.rows)} of {asked}"

    def of_kind(self, *kinds: str) -> list[Row]:
        """Rows of some kinds."""
        return [r for r in self.rows if r.kind in kinds]


def scoreboard(rows: Iterable[Row], sha256: str, wish: Mapping[str, Any]) -> Scoreboard:
    """Put all scores together."""
    listed = tuple(sorted(rows, key=lambda r: r.number))
    trust = _trust([n for r in listed for n in r.weighed])
    return Scoreboard(
        sha256,
        wish,
        listed,
        tuple(_targets(listed, trust)),
        _confusion(listed),
        tuple(_by_law(listed)),
        tuple(_by_imperfection(listed)),
        tuple(_by_size(listed)),
        trust,
    )


def _targets(rows: Sequence[Row], trust: Trust) -> Iterable[Target]:
    yield from _of_names(rows)
    yield from _of_confidence(rows, trust)
    yield from _of_errors(rows)
    yield from _of_the_rest(rows)


def _of_names(rows: Sequence[Row]) -> Iterable[Target]:
    """Named and located, rightly and wrongly."""
    single = [r for r in rows if r.kind == "single"]
    decidable = [r for r in single if r.decidable]
    known, other = ([r for r in decidable if r.laws == laws] for laws in ("catalogue", "other"))
    pairs = [r for r in rows if r.kind == "pair" and r.decidable]
    clean = [r for r in rows if r.kind == "none"]
    strange = [r for r in rows if r.kind == "stranger"]
    unlike = [r for r in strange if r.decidable]
    motor = [r for r in rows if r.kind == "motor"]
    yield _share("single effect named first, catalogue's law, decidable", rate(known, _first), 0.97)
    yield _share("single effect named first, another law, decidable", rate(other, _first), 0.90)
    yield _share("single effect named, whatever stands before it, decidable", rate(decidable, _told))
    yield _share("single effect: a wrong name", rate(single, lambda r: r.wrong), None, 0.02)
    yield _share("nothing missing: a wrong name", rate(clean, lambda r: r.wrong), None, 0.01)
    yield _share("pairs: both named, decidable", rate(pairs, lambda r: r.all_right), 0.80)
    yield _share("strangers: no wrong name", rate(strange, lambda r: not r.wrong and not r.failed), 0.90)
    yield _share("strangers: located by the residual itself, decidable", _raw_location(unlike), 0.80)
    yield _share("single effect: located by the residual itself, decidable", _raw_location(decidable), 0.90)
    beside = rate([r for r in motor if r.decidable], _first)
    yield _share("friction of the motor, in its torque alone: named first, decidable", beside)
    yield _share("friction of the motor: a wrong name", rate(motor, lambda r: r.wrong))


def _of_confidence(rows: Sequence[Row], trust: Trust) -> Iterable[Target]:
    """Whether what is said to be sure is."""
    z = [(e.z, r) for r in rows for e in r.estimates]
    bounds = [b for r in rows for b in r.bounds]
    over = trust.area / trust.area_by_z if trust.area_by_z > 0.0 else nan
    error = "confidence: expected calibration error"
    yield Target(error, trust.error, (nan, nan), trust.of, None, 0.05, "1")
    mean, low, high = trust.perfect
    yield Target("confidence: error of a perfect one, as many effects", mean, (low, high), trust.of, unit="1")
    area = "confidence: area under risk–coverage, over that of z alone"
    yield Target(area, over, (nan, nan), trust.of, None, 1.0, "1")
    held = rate(z, lambda e: abs(e[0]) <= 1.96)
    yield _share("95 % intervals that hold the truth, catalogue's laws", held, 0.92, 0.98)
    yield _share("not named: the truth below its stated bound", rate(bounds, lambda b: b.held), 0.95)


def _of_errors(rows: Sequence[Row]) -> Iterable[Target]:
    """What the models leave, over what they promised and over noise."""
    kept = [r.final_rad / r.heldout_rad for r in rows if r.heldout_rad > 0.0 and isfinite(r.final_rad)]
    ratios = [
        r.heldout_rad / r.true_rad for r in rows if r.laws in ("catalogue", "none") and r.true_rad > 0.0
    ]
    yield _at("error kept for the end over that left out, median", kept, 0.5, 1.25, "1")
    yield _at("error kept for the end over that left out, 90 %", kept, 0.9, None, "1")
    yield _at("error left out over noise, catalogue's laws, median", ratios, 0.5, 1.10, "1")
    yield _at("error left out over noise, catalogue's laws, 90 %", ratios, 0.9, 1.5, "1")


def _of_the_rest(rows: Sequence[Row]) -> Iterable[Target]:
    """Laws without a name, dependences, what is confounded by design, time."""
    clean = [r for r in rows if r.kind == "none"]
    tied = [r for r in rows if r.kind == "confounded"]
    depends = Rate(*_sum(r.depends for r in rows if r.depends is not None))
    times = [r.seconds for r in rows if isfinite(r.seconds)]
    yield _share(
        "nothing missing: a law without a name", rate(clean, lambda r: bool(r.empirical)), None, 0.05
    )
    yield _share("dependences found", depends)
    wrongly = rate(rows, lambda r: r.depends_wrongly > 0)
    yield _share("dependences that are not true, per trial", wrongly, None, 0.02)
    yield _share("confounded: said so, named together", rate(tied, lambda r: bool(r.said_tied)))
    yield _share("confounded: experiment proposed", rate(tied, lambda r: bool(r.proposed)))
    yield _share("confounded: that experiment settles it", rate(tied, lambda r: bool(r.settled)))
    yield _at("time of one diagnosis, median", times, 0.5, 10.0, "s")
    yield _at("time of one diagnosis, 90 %", times, 0.9, 40.0, "s")
    yield _at("time of one diagnosis, worst", times, 1.0, 90.0, "s")
    yield _share("diagnoses without a verdict", rate(rows, lambda r: bool(r.failed)), None, 0.0)


def _share(what: str, r: Rate, least: float | None = None, most: float | None = None) -> Target:
    return Target(what, r.value, r.interval, r.of, least, most)


def _at(what: str, values: Sequence[float], q: float, most: float | None, unit: str) -> Target:
    """The quantile q of those values that are finite: a trial without a verdict has none."""
    values = [v for v in values if isfinite(v)]
    span = bootstrapped(values, lambda v: quantile(v, q))
    return Target(what, quantile(values, q), span, len(values), None, most, unit)


def _first(row: Row) -> bool:
    return row.first_right


def _told(row: Row) -> bool:
    return set(row.truth) <= {n.effect for n in row.named}


def _raw_location(rows: Sequence[Row]) -> Rate:
    """Of those that have a place in the joint's angle."""
    return rate([r for r in rows if r.located is not None], lambda r: bool(r.located))


def _sum(pairs: Iterable[tuple[int, int] | None]) -> tuple[int, int]:
    known = [p for p in pairs if p is not None]
    return sum(p[0] for p in known), sum(p[1] for p in known)


def _part(name: str, rows: Sequence[Row], low: float = nan, high: float = nan) -> Part:
    decidable = [r for r in rows if r.decidable]
    return Part(
        name, len(rows), rate(decidable, _first), _raw_location(decidable), rate(rows, lambda r: r.wrong), low, high
    )  # fmt: skip


def _by_law(rows: Sequence[Row]) -> Iterable[Part]:
    one = [r for r in rows if r.kind in ("single", "stranger", "motor")]
    for name in sorted({f for r in one for f in r.forms}):
        yield _part(name, [r for r in one if name in r.forms])


def _by_imperfection(rows: Sequence[Row]) -> Iterable[Part]:
    """Single effects (clean trials too, for wrong names) with each imperfection, after those with none at all."""
    these = [r for r in rows if r.kind in ("single", "none")]
    names = sorted({i for r in these for i in r.imperfections})
    yield _part("none at all", [r for r in these if not r.imperfections])
    for name in names:
        yield _part(name, [r for r in these if name in r.imperfections])


def _by_size(rows: Sequence[Row]) -> Iterable[Part]:
    single = [r for r in rows if r.kind == "single"]
    for low, high in pairwise(SIZE_EDGES):
        here = [r for r in single if low <= r.size < high]
        yield _part(f"{100 * low:g}–{100 * min(high, 0.6):g} %", here, low, min(high, 0.6))


def _trust(weighed: Sequence[Named]) -> Trust:
    known = [n for n in weighed if isfinite(n.confidence)]
    p, right = [n.confidence for n in known], [n.right for n in known]
    z = [n.evidence.get("z", nan) for n in known]
    by_z = [v if isfinite(v) else -np.inf for v in z]
    coverage, risk = risk_coverage(p, right)
    return Trust(
        len(known),
        calibration_error(p, right),
        perfect_error(p),
        brier(p, right),
        risk_area(p, right),
        risk_area(by_z, right),
        tuple(coverage.tolist()),
        tuple(risk.tolist()),
        tuple(risk_coverage(by_z, right)[1].tolist()),
        tuple(
            (float(c[0]), float(c[-1]), float(np.mean(c)), Rate(float(np.sum(y)), len(y)))
            for c, y in equal_counts(p, right)
        ),
    )


def _confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    table: dict[str, dict[str, int]] = {}
    for row in rows:
        line = table.setdefault(row.label, {})
        line[row.outcome] = line.get(row.outcome, 0) + 1
    return table


def as_json(board: Scoreboard) -> dict[str, Any]:
    """The contents of `scoreboard.json`: targets, breakdowns, trust, confusion matrix, every trial."""
    result = {
        "schema": 2,
        "sha256": board.sha256,
        **dict(board.wish),
        "targets": [{**asdict(t), "ok": t.ok} for t in board.targets],
        "confusion": board.confusion,
        "by_law": [_entry(p) for p in board.by_law],
        "by_imperfection": [_entry(p) for p in board.by_imperfection],
        "by_size": [_entry(p) for p in board.by_size],
        "confidence": {
            **{k: v for k, v in asdict(board.trust).items() if k != "bins"},
            "sure_from": LIMITS.name,
            "bins": [
                {"from": low, "to": high, "confidence": mean, "true": r.entry()}
                for low, high, mean, r in board.trust.bins
            ],
        },
        "rows": [asdict(r) | {"outcome": r.outcome} for r in board.rows],
    }
    known: dict[str, Any] = finite(result)
    return known


def _entry(p: Part) -> dict[str, Any]:
    return {
        "name": p.name,
        "trials": p.trials,
        "named_first": p.right.entry(),
        "located": p.located.entry(),
        "wrong_name": p.wrong.entry(),
    }
