"""Shares of trials with their intervals, and plain data that JSON can hold."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, nan, sqrt
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


@dataclass(frozen=True)
class Rate:
    """A share of trials with its 95 % interval (Wilson); NaN where there is none.

    `hits` is whole but where some of several that count alike are taken, each then by their share."""

    hits: float
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

    def entry(self) -> dict[str, Any]:
        """As JSON has it."""
        return {"hits": self.hits, "of": self.of, "share": self.value, "interval_95": list(self.interval)}


def rate(items: Iterable[T], hit: Callable[[T], bool]) -> Rate:
    """Share of items that hit."""
    answers = [hit(i) for i in items]
    return Rate(sum(answers), len(answers))


def quantile(values: Iterable[float], q: float) -> float:
    """Quantile of what is finite; NaN where nothing is."""
    kept = [v for v in values if isfinite(v)]
    return float(np.quantile(kept, q)) if kept else nan


def bootstrapped(
    values: Sequence[T], figure: Callable[[Sequence[T]], float], draws: int = 300, seed: int = 0
) -> tuple[float, float]:
    """95 % interval of a figure of a sample, by resampling it (percentiles); NaN for an empty one."""
    if not values:
        return nan, nan
    rng = np.random.default_rng(seed)
    found = [figure([values[k] for k in rng.integers(len(values), size=len(values))]) for _ in range(draws)]
    return quantile(found, 0.025), quantile(found, 0.975)


def finite(value: Any) -> Any:
    """The same with None for what is not finite: JSON knows no NaN."""
    if isinstance(value, float) and not isfinite(value):
        return None
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    return value


def write_json(path: Path, data: Any) -> None:
    """Write JSON that appears whole or not at all."""
    spare = path.with_name(path.name + ".part")
    spare.write_text(json.dumps(finite(data), indent=1) + "\n", encoding="utf-8")
    spare.replace(path)
