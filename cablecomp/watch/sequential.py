"""Watch a running residual: a sequential test with a stated rate of false alarms; own code, as `ruptures` looks back.

Constant memory, O(1) per sample.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, log, sqrt
from typing import Final, Literal

import numpy as np

from cablecomp.errors import InputError
from cablecomp.signal.autocorrelation import integrated_time, long_run_variance
from cablecomp.signal.smoothing import FloatArray

Kind = Literal["offset up", "offset down", "wider", "from the start"]
_KINDS: Final[tuple[Kind, ...]] = ("offset up", "offset down", "wider")
_STRENGTHS: Final = (0.5, 1.0, 2.0)
_NO_TAILS: Final = (0.0, 0.0, 0.0)
_TAUS: Final = 8.0
_FEWEST_BLOCKS: Final = 25
_WIDEST: Final = 6.0
"""Standard deviations that a block may always be wider by; more where learning has seen more."""


@dataclass(frozen=True)
class WatchConfig:
    """What the watch promises and how it learns.

    `between_false_alarms_s`: mean time between false alarms is at least this; `learning_samples`:
    samples after the start that show what is usual (no alarm can come before they are over); `indifference`:
    change of no interest, in units of the usual RMS: the promise holds as long as the mean moves by less
    and the variance grows by less than the square of it. Raises InputError if one is too small.
    """

    between_false_alarms_s: float = 36_000.0
    learning_samples: int = 4_000
    indifference: float = 0.0

    def __post_init__(self) -> None:
        if not self.between_false_alarms_s > 0.0:
            raise InputError(
                "between_false_alarms_s must be positive; give the mean time that is acceptable, in s"
            )
        if self.learning_samples < 400:
            raise InputError(
                f"learning_samples must be at least 400, found {self.learning_samples}; the usual residual "
                "cannot be "
                "learnt from fewer"
            )
        if not self.indifference >= 0.0:
            raise InputError(f"indifference must not be negative, found {self.indifference}; 0 = any change")


@dataclass(frozen=True)
class Alarm:
    """The residual is no longer what it was.

    `at_s`: now; `since_s`: when the evidence began to grow; `kind` ("from the start": said by `live`, never
    by `step`); `size_rad`: shift of the mean, or the RMS now; `usual_rad`: RMS while learning;
    `log_evidence`: natural logarithm of the detector; `threshold`: what it had to pass.
    """

    at_s: float
    since_s: float
    kind: Kind
    size_rad: float
    usual_rad: float
    log_evidence: float
    threshold: float


@dataclass(frozen=True)
class Usual:
    """What learning found: block length (samples), duration (s), mean, sd of block means, mean and sd
    of the cube root of the block's variance, allowances for not knowing them exactly, RMS, the threshold on
    the log evidence, and what mean and cube root may move by without being of interest, in their sd;
    what a block's cube root counts for at most, and what each strength owes to tails heavier than normal ones.
    """

    block: int
    duration_s: float
    mean: float
    mean_sd: float
    root: float
    root_sd: float
    allowance: float
    inflation: float
    rms: float
    threshold: float
    idle_mean: float
    idle_root: float
    widest: float
    tails: tuple[float, ...]


@dataclass
class WatchState:
    """State of the watch; made by `start`, changed by `step` alone. `usual` is None while learning."""

    config: WatchConfig
    learnt: FloatArray
    count: int = 0
    first_s: float = 0.0
    usual: Usual | None = None
    block_s: float = 0.0
    in_block: int = 0
    total: float = 0.0
    square: float = 0.0
    evidence: list[float] = field(default_factory=list)
    since: list[float] = field(default_factory=list)
    sums: list[float] = field(default_factory=list)
    blocks: list[int] = field(default_factory=list)


def start(config: WatchConfig) -> WatchState:
    """Return the state before the first sample."""
    return WatchState(config, np.zeros(config.learning_samples))


def step(state: WatchState, time_s: float, residual_rad: float) -> Alarm | None:
    """Take in one sample; return an alarm when the evidence passes the threshold, else None.

    Samples are gathered to blocks longer than the residual remembers. For each block and for each of
    nine alternatives (mean up, mean down, wider; three strengths lambda) e = exp(lambda (z - allowance)
    - lambda^2 s^2/2) has expectation <= 1 as long as the residual is as it was (how wide a block is has
    heavier tails than its mean: it is cut off, and e divided by what learning found); W <- max(W, 1) e, and
    the alarm comes when the mean of the nine W passes A blocks. Then the mean time to a false alarm is
    at least A (W stays below the Shiryaev–Roberts sum, and that sum less the time is a supermartingale:
    Shin, Ramdas, Rinaldo, "E-detectors", 2022). After an alarm the evidence starts anew. A residual
    that is not finite is passed over.
    """
    if not np.isfinite(residual_rad):
        return None
    if state.usual is None:
        _learn(state, time_s, residual_rad)
        return None
    if state.in_block == 0:
        state.block_s = time_s
    state.total += residual_rad
    state.square += residual_rad * residual_rad
    state.in_block += 1
    if state.in_block < state.usual.block:
        return None
    mean, square = state.total / state.in_block, state.square / state.in_block
    state.total = state.square = 0.0
    state.in_block = 0
    return _close_block(state, state.usual, time_s, mean, square)


def log_evidence(state: WatchState) -> float:
    """Return the logarithm of the detector as it stands (compare with `usual.threshold`); does not
    change the state.
    """
    if state.usual is None or not state.evidence:
        return 0.0
    top = max(state.evidence)
    return top + log(sum(exp(value - top) for value in state.evidence) / len(state.evidence))


def _learn(state: WatchState, time_s: float, residual: float) -> None:
    if state.count == 0:
        state.first_s = time_s
    state.learnt[state.count] = residual
    state.count += 1
    if state.count < state.config.learning_samples:
        return
    state.usual = _usual(state.learnt, time_s - state.first_s, state.config)
    alternatives = len(_KINDS) * len(_STRENGTHS)
    state.evidence = [0.0] * alternatives
    state.since = [time_s] * alternatives
    state.sums = [0.0] * alternatives
    state.blocks = [0] * alternatives


def _usual(values: FloatArray, duration_s: float, config: WatchConfig) -> Usual:
    n = len(values)
    tau = integrated_time(values)
    wanted = max(8, int(np.ceil(_TAUS * tau)))
    block = min(wanted, n // _FEWEST_BLOCKS)
    blocks = n // block
    shaped = values[: blocks * block].reshape(blocks, block)
    mean = float(values.mean())
    # the long-run variance counts what correlation between blocks adds to their sum
    variance = max(long_run_variance(values) / block, float(np.var(shaped.mean(axis=1), ddof=1)))
    roots = np.cbrt(shaped.var(axis=1))
    root_sd = max(sqrt(long_run_variance(roots)), float(np.std(roots, ddof=1)), 1e-300)
    block_s = max(duration_s, 1e-9) * block / max(1, n - 1)
    rms = float(np.sqrt(np.mean((values - mean) ** 2)))
    mean_sd, root = max(sqrt(variance), 1e-300), float(roots.mean())
    allowance, inflation = 2.5 / sqrt(blocks), 1.0 + 2.5 / sqrt(2.0 * blocks)
    wider = (roots - root) / root_sd
    return Usual(
        block,
        block_s,
        mean,
        mean_sd,
        root,
        root_sd,
        allowance,
        inflation,
        rms,
        log(max(config.between_false_alarms_s / block_s, 2.0)),
        config.indifference * rms / mean_sd,
        float(np.cbrt(root**3 + (config.indifference * rms) ** 2) - root) / root_sd,
        max(_WIDEST, float(wider.max())),
        tuple(_tail(wider, strength, allowance, inflation) for strength in _STRENGTHS),
    )


def _tail(wider: FloatArray, strength: float, allowance: float, inflation: float) -> float:
    """By how much the logarithm of e's mean over the blocks learnt from exceeds 0, the widest one counted three times:
    what is as rare may come more often."""
    evidence = strength * (wider - allowance) - 0.5 * (strength * inflation) ** 2
    most = float(evidence.max())
    return max(0.0, most + log((float(np.sum(np.exp(evidence - most))) + 2.0) / len(wider)))


def _close_block(state: WatchState, usual: Usual, time_s: float, mean: float, square: float) -> Alarm | None:
    z = (mean - usual.mean) / usual.mean_sd
    spread = max(square - mean * mean, 0.0)
    wider = (float(np.cbrt(spread)) - usual.root) / usual.root_sd
    index = 0
    for signal, tails, size in (
        (z - usual.idle_mean, _NO_TAILS, mean - usual.mean),
        (-z - usual.idle_mean, _NO_TAILS, mean - usual.mean),
        (min(wider - usual.idle_root, usual.widest), usual.tails, spread),
    ):
        for strength, tail in zip(_STRENGTHS, tails, strict=True):
            gain = strength * (signal - usual.allowance) - 0.5 * (strength * usual.inflation) ** 2 - tail
            if state.evidence[index] <= 0.0:
                state.evidence[index], state.since[index] = 0.0, state.block_s
                state.sums[index], state.blocks[index] = 0.0, 0
            state.evidence[index] += gain
            state.sums[index] += size
            state.blocks[index] += 1
            index += 1
    evidence = log_evidence(state)
    if evidence < usual.threshold:
        return None
    top = int(np.argmax(state.evidence))
    kind = _KINDS[top // len(_STRENGTHS)]
    average = state.sums[top] / max(1, state.blocks[top])
    size = sqrt(max(average, 0.0)) if kind == "wider" else average
    alarm = Alarm(time_s, state.since[top], kind, size, usual.rms, evidence, usual.threshold)
    state.evidence = [0.0] * len(state.evidence)
    return alarm
