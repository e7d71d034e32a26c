"""The scoreboard of blind trials: rates with their intervals, against what is to be reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import isfinite, nan, sqrt
from typing import Any

import numpy as np

from cablecomp.trials.scoring import Row

SIZE_EDGES = (0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.35, 0.6001)
CONFIDENCE_EDGES = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 1.0001)


@dataclass(frozen=True)
class Rate:
    """A share of trials with its 95 % interval (Wilson); NaN where there is none."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """The share."""
        return self.hits / self.of if self.of else nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval."""
        if not self.of:
            return nan, nan
        z, n, p = 1.959964, self.of, self.value
        middle = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z * sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
        return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True)
class Target:
    """A figure to be reached: `reached` against `least` or `most`; `ok` None if there were no trials."""

    what: str
    reached: float
    of: int
    least: float | None
    most: float | None

    @property
    def ok(self) -> bool | None:
        """Whether it is reached."""
        if not isfinite(self.reached):
            return None
        return (self.least is None or self.reached >= self.least) and (
            self.most is None or self.reached <= self.most
        )


@dataclass(frozen=True)
class SizeBin:
    """Single effects of one range of sizes: named rightly, named wrongly, not named."""

    low: float
    high: float
    right: Rate
    right_decidable: Rate
    wrong: Rate


@dataclass(frozen=True)
class Scoreboard:
    """All scores of a run; `confusion[truth][outcome]` counts trials."""

    sha256: str
    seed: int
    kind: str
    rows: tuple[Row, ...]
    targets: tuple[Target, ...]
    confusion: dict[str, dict[str, int]]
    sizes: tuple[SizeBin, ...]
    reliability: tuple[tuple[float, float, float, Rate], ...]
    """(lowest, highest, mean confidence, share of names that are true) of each bin."""

    def of_kind(self, *kinds: str) -> list[Row]:
        """Rows of some kinds."""
        return [r for r in self.rows if r.kind in kinds]


def scoreboard(rows: Iterable[Row], sha256: str, seed: int, kind: str) -> Scoreboard:
    """Put all scores together."""
    listed = tuple(sorted(rows, key=lambda r: r.number))
    return Scoreboard(
        sha256,
        seed,
        kind,
        listed,
        tuple(_targets(listed)),
        _confusion(listed),
        _sizes(listed),
        _reliability(listed),
    )


def rate(rows: Iterable[Row], hit: Callable[[Row], bool]) -> Rate:
    """Share of rows that hit."""
    answers = [hit(r) for r in rows]
    return Rate(sum(answers), len(answers))


def _targets(rows: Sequence[Row]) -> list[Target]:
    single = [r for r in rows if r.kind == "single"]
    decidable = [r for r in single if r.decidable]
    pairs = [r for r in rows if r.kind == "pair" and r.decidable]
    clean = [r for r in rows if r.kind in ("nothing", "parameters")]
    unknown = [r for r in rows if r.kind == "unknown"]
    confounded = [r for r in rows if r.kind == "confounded"]
    worst = max((b.wrong.value for b in _sizes(rows) if b.wrong.of), default=nan)
    ratios = _ratios(rows)
    z = _z(rows)
    times = [r.seconds for r in rows]
    kept = [r.final_rad / r.heldout_rad for r in rows if r.heldout_rad > 0.0 and isfinite(r.final_rad)]
    bounds = [b for r in rows for b in r.bounds]
    names = [n for r in rows for n in r.named]
    over = "held-out RMSE over the true model's"

    def share(what: str, r: Rate, least: float | None, most: float | None = None) -> Target:
        return Target(what, r.value, r.of, least, most)

    return [
        share("single effect named first, where decidable", rate(decidable, lambda r: r.first_right), 0.95),
        Target("wrong names in the worst range of sizes", worst, len(single), None, 0.02),
        Target(
            "wrong among names given (confidence 0.5 and more)",
            _mean([not n.right for n in names]),
            len(names),
            None,
            0.05,
        ),
        share(
            "mismatch located by the residual itself, same trials",
            rate(decidable, lambda r: bool(r.located)),
            0.95,
        ),
        share("pairs: both named, nothing else, where decidable", rate(pairs, lambda r: r.all_right), 0.80),
        share("false names where nothing is missing", rate(clean, lambda r: bool(r.named)), None, 0.01),
        share("unknown: unexplained, no known name", rate(unknown, _abstained), 0.90),
        share("unknown: located by the residual itself", rate(unknown, lambda r: bool(r.located)), 0.90),
        share("confounded: said so, named together", rate(confounded, lambda r: bool(r.said_tied)), 0.95),
        share("confounded: experiment proposed", rate(confounded, lambda r: bool(r.proposed)), 0.95),
        share("confounded: that experiment settles it", rate(confounded, lambda r: bool(r.settled)), 0.95),
        Target(f"{over}, median", _quantile(ratios, 0.5), len(ratios), None, 1.10),
        Target(f"{over}, 90th percentile", _quantile(ratios, 0.9), len(ratios), None, 1.5),
        Target("stated 95 % intervals that hold the truth", _mean(np.abs(z) <= 1.96), len(z), 0.90, 0.99),
        Target(
            "what was not named lies below its stated bound",
            _mean([b.held for b in bounds]),
            len(bounds),
            0.95,
            None,
        ),
        Target(
            "RMSE kept for the end over that held out, median", _quantile(kept, 0.5), len(kept), None, 1.25
        ),
        Target("time of one diagnosis, median, s", _quantile(times, 0.5), len(rows), None, 10.0),
        Target("time of one diagnosis, 90th percentile, s", _quantile(times, 0.9), len(rows), None, 40.0),
        Target("time of one diagnosis, worst, s", _quantile(times, 1.0), len(rows), None, 90.0),
    ]


def _abstained(row: Row) -> bool:
    """No known name, and said to be unexplained where it can be seen above the noise at all."""
    return not row.named and (row.verdict == "unexplained" or not row.visible) and not row.failed


def _ratios(rows: Sequence[Row]) -> list[float]:
    """Held-out RMSE after modelling over the true model's, where the catalogue holds the truth."""
    return [
        r.heldout_rad / r.true_rad for r in rows if r.kind != "unknown" and r.true_rad > 0.0 and not r.failed
    ]


def _z(rows: Sequence[Row]) -> Any:
    return np.array([e.z for r in rows for e in r.estimates])


def _confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    table: dict[str, dict[str, int]] = {}
    for row in rows:
        line = table.setdefault(row.label, {})
        line[row.outcome] = line.get(row.outcome, 0) + 1
    return table


def _sizes(rows: Sequence[Row]) -> tuple[SizeBin, ...]:
    single = [r for r in rows if r.kind == "single"]
    found = []
    for low, high in pairwise(SIZE_EDGES):
        here = [r for r in single if low <= r.size < high]
        found.append(
            SizeBin(
                low,
                min(high, 0.6),
                rate(here, lambda r: r.first_right),
                rate([r for r in here if r.decidable], lambda r: r.first_right),
                rate(here, lambda r: r.wrong),
            )
        )
    return tuple(found)


def _reliability(rows: Sequence[Row]) -> tuple[tuple[float, float, float, Rate], ...]:
    names = [n for r in rows for n in r.named if isfinite(n.confidence)]
    found = []
    for low, high in pairwise(CONFIDENCE_EDGES):
        here = [n for n in names if low <= n.confidence < high]
        if here:
            mean = float(np.mean([n.confidence for n in here]))
            found.append((low, min(high, 1.0), mean, Rate(sum(n.right for n in here), len(here))))
    return tuple(found)


def _quantile(values: Sequence[float], q: float) -> float:
    kept = [v for v in values if isfinite(v)]
    return float(np.quantile(kept, q)) if kept else nan


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else nan


def as_json(board: Scoreboard) -> dict[str, Any]:
    """The contents of `scoreboard.json`: targets, rates, confusion matrix, every trial."""

    def shown(r: Rate) -> dict[str, Any]:
        return {"hits": r.hits, "of": r.of, "share": r.value, "interval_95": list(r.interval)}

    result = {
        "schema": 1,
        "sha256": board.sha256,
        "seed": board.seed,
        "kind": board.kind,
        "trials": len(board.rows),
        "targets": [{**asdict(t), "ok": t.ok} for t in board.targets],
        "confusion": board.confusion,
        "by_size": [
            {
                "from": b.low,
                "to": b.high,
                "named": shown(b.right),
                "named_where_decidable": shown(b.right_decidable),
                "wrong": shown(b.wrong),
            }
            for b in board.sizes
        ],
        "reliability": [
            {"from": low, "to": high, "confidence": mean, "true": shown(r)}
            for low, high, mean, r in board.reliability
        ],
        "rows": [asdict(r) | {"outcome": r.outcome} for r in board.rows],
    }
    finite: dict[str, Any] = _finite(result)
    return finite


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None instead."""
    if isinstance(value, float) and not isfinite(value):
        return None
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return value
