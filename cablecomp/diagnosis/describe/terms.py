"""Terms of plain physics from which a sparse law for a residual may be made up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.diagnosis.describe.memory import lagged, play
from cablecomp.diagnosis.describe.periodic import Periodicity
from cablecomp.diagnosis.locate.covariates import FURTHER
from cablecomp.diagnosis.locate.series import Series
from cablecomp.diagnosis.locate.views import elapsed
from cablecomp.signal.smoothing import FloatArray, IntArray

_LAGS: Final = (0.02, 0.05, 0.15)
"""Time constants of lags that are tried, as shares of a recording's length."""
_RADII: Final = (0.05, 0.15)
"""Radii of play operators that are tried, as shares of a channel's range."""


@dataclass(frozen=True)
class Term:
    """One group of regressors that enters or stays out as a whole.

    `symbols`: how each regressor is written; `unit`: of a regressor (its coefficient has rad over that
    unit, or rad); `values`: n x k.
    """

    symbols: tuple[str, ...]
    unit: str
    values: FloatArray


def terms(series: Series, period: Periodicity | None, changes: IntArray) -> Iterator[Term]:
    """Yield the library: load, direction, speed, angle, their products, filtered load, time,
    temperature, others.

    M load, sgn Ṁ its direction (kept in holds), M₀ its RMS, q joint angle, q_m motor angle, v joint
    speed, a joint acceleration, t time since the start, ϑ temperature. `period`: adds its own
    frequency; `changes`: sample indices that add steps in time.
    """
    yield from _load_terms(series)
    yield from _motion_terms(series)
    yield from _memory_terms(series)
    yield from _outer_terms(series)
    if period is not None:
        q = series.covariates.values[period.angle]
        symbol = "q_m" if period.angle == "motor_angle" else "q"
        load = series.covariates.values["load"]
        wave = _wave(q, period.cycles, symbol)
        yield wave
        yield Term(tuple(f"M {part}" for part in wave.symbols), "N·m", wave.values * load[:, None])
    clock, load = elapsed(series), series.covariates.values["load"]
    for change in changes:
        after = (np.arange(series.samples) >= change).astype(np.float64)
        name = f"[t > {clock[change]:.4g} s]"
        yield Term((name,), "", after[:, None])
        yield Term((f"{name} M",), "N·m", (after * load)[:, None])


def _load_terms(series: Series) -> Iterator[Term]:
    values = series.covariates.values
    load, direction = values["load"], values["load_direction"]
    yield _single("M", "N·m", load)
    yield _single("M²", "(N·m)²", load**2)
    yield _single("M|M|", "(N·m)²", load * np.abs(load))
    yield _single("M³", "(N·m)³", load**3)
    # terms that nearly cancel are not found one at a time
    yield Term(("M", "M·(M/M₀)²"), "N·m", np.column_stack((load, load * (load / _usual(load)) ** 2)))
    yield _single("sgn M", "", np.sign(load))
    yield _single("sgn Ṁ", "", direction)
    yield _single("sgn Ṁ |M|", "N·m", direction * np.abs(load))
    yield _single("sgn Ṁ M", "N·m", direction * load)
    yield _single("dM/dt", "N·m/s", values["load_rate"])
    yield _single("sgn Ṁ √|M|", "√(N·m)", direction * np.sqrt(np.abs(load)))


def _motion_terms(series: Series) -> Iterator[Term]:
    values = series.covariates.values
    load, speed = values["load"], values["velocity"]
    turn = series.covariates.motion_direction
    if float(np.ptp(speed)) > 0.0:
        yield _single("sgn v", "", turn)
        yield _single("v", "rad/s", speed)
        yield _single("|v|", "rad/s", np.abs(speed))
        yield _single("v|v|", "(rad/s)²", speed * np.abs(speed))
        yield _single("M v", "N·m rad/s", load * speed)
        yield _single("M sgn v", "N·m", load * turn)
        yield _single("|M| sgn v", "N·m", np.abs(load) * turn)
        yield _single("a", "rad/s²", values["acceleration"])
    for name, symbol in (("joint_angle", "q"), ("motor_angle", "q_m")):
        if name not in values or float(np.ptp(values[name])) < 0.05:
            continue
        q = values[name]
        yield _single(symbol, "rad", q)
        yield _single(f"{symbol}²", "rad²", q**2)
        yield _single(f"M {symbol}", "N·m rad", load * q)
        for cycles in (1.0, 2.0, 3.0):
            yield _wave(q, cycles, symbol)
        wave = _wave(q, 1.0, symbol)
        yield Term(tuple(f"M {part}" for part in wave.symbols), "N·m", load[:, None] * wave.values)
        yield Term(tuple(f"sgn v {part}" for part in wave.symbols), "", turn[:, None] * wave.values)


def _memory_terms(series: Series) -> Iterator[Term]:
    values, starts = series.covariates.values, series.covariates.starts
    clock = elapsed(series)
    load = values["load"]
    length = float(clock[-1] - clock[0]) / max(1, len(starts))
    for share in _LAGS:
        tau = _rounded(share * length / 4.0)
        yield _single(f"M − ⟨M⟩({tau:g} s)", "N·m", load - lagged(load, clock, tau, starts))
    direction = values["load_direction"]
    for share in _LAGS[:2]:
        tau = _rounded(share * length / 4.0)
        held = values["dwell"]
        yield _single(f"sgn Ṁ exp(−dwell/{tau:g} s)", "", direction * np.exp(-held / tau))
    for share in _RADII:
        radius = _rounded(share * float(np.ptp(load)))
        yield _single(f"M − play(M, {radius:g} N·m)", "N·m", load - play(load, radius, starts))
    q = values.get("joint_angle", values["motor_angle"])
    if float(np.ptp(q)) >= 0.05:
        for share in _RADII:
            radius = _rounded(share * float(np.ptp(q)))
            yield _single(f"q − play(q, {radius:g} rad)", "rad", q - play(q, radius, starts))


def _outer_terms(series: Series) -> Iterator[Term]:
    values = series.covariates.values
    load = values["load"]
    clock = elapsed(series) - elapsed(series)[0]
    pace = _rounded(float(clock[-1]) / 30.0)
    yield _single("t", "s", clock)
    yield _single(f"ln(1 + t/{pace:g} s)", "", np.log1p(clock / pace))
    yield _single("M t", "N·m s", load * clock)
    for name in values:
        if name == "temperature":
            yield from _outer("(ϑ − ϑ₀)", "K", values[name], load)
        elif name.startswith(FURTHER):
            yield from _outer(name.partition(":")[2], "unit", values[name], load)


def _outer(symbol: str, unit: str, values: FloatArray, load: FloatArray) -> Iterator[Term]:
    centred = values - float(np.mean(values))
    if float(np.ptp(centred)) > 0.0:
        yield _single(symbol, unit, centred)
        yield _single(f"M {symbol}", f"N·m {unit}", load * centred)
        yield _single(f"{symbol}²", f"{unit}²", centred**2)


def _single(symbol: str, unit: str, values: FloatArray) -> Term:
    return Term((symbol,), unit, np.asarray(values, dtype=np.float64)[:, None])


def _wave(q: FloatArray, cycles: float, symbol: str) -> Term:
    inner = symbol if cycles == 1.0 else f"{cycles:.4g} {symbol}"
    return Term(
        (f"sin({inner})", f"cos({inner})"), "", np.column_stack((np.sin(cycles * q), np.cos(cycles * q)))
    )


def _usual(values: FloatArray) -> float:
    rms = float(np.sqrt(np.mean(values**2)))
    return rms if rms > 0.0 else 1.0


def _rounded(value: float) -> float:
    """Two significant digits, so that the law can be written down as it was fitted."""
    return float(f"{value:.2g}")
