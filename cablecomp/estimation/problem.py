"""The fitting problem: misfits of all output channels of all recordings, zeros found inside, priors beside them.

Minimised over x is  sum_c sum_i (w_i (y_ci - f_ci(x) - zero_c))^2 / s_c^2  +  sum_j ((x_j - centre_j)/sd_j)^2.
y: measured, f: predicted, s_c: what is usually left in channel c times the root of its memory (so that many rows that
say the same weigh as what they are). Zeros are linear: a session's is free, a recording's departs from it by some
`zero_sd`; the motor torque has a slope by motor angle beside it (wires that are wound up). They are projected out
(variable projection, G. Golub and V. Pereyra 1973).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence
from cablecomp.estimation.limits import HOPELESS, STEP, ZERO_FAINT
from cablecomp.estimation.parallel import side_by_side
from cablecomp.estimation.parameter import Parameter, own_of
from cablecomp.estimation.simulate import Simulator, simulator
from cablecomp.estimation.standing import standing, stood, with_common
from cablecomp.estimation.zeros import Zeros, zeros_of
from cablecomp.signal.smoothing import FloatArray, IntArray

Misfits: TypeAlias = dict[str, list[FloatArray]]
"""Measured less predicted by channel, an array for each recording."""
Known: TypeAlias = Mapping[int, Mapping[str, FloatArray]]
"""Misfits of some recordings, by the recording's place and by channel."""


def of_recording(misfits: Misfits, place: int) -> dict[str, FloatArray]:
    """Those of one recording."""
    return {c: parts[place] for c, parts in misfits.items()}


@dataclass(frozen=True)
class Weighing:
    """What a misfit counts for: by channel, 1-sigma of a row with its memory, and how far a recording's zero
    departs from its session's; `moved`: recordings whose zero was set anew, and how far it may be; `history`: how far
    one that nobody recorded moves zeros [the channel's unit]."""

    sigma: Mapping[str, float]
    zero_sd: Mapping[str, float]
    moved: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    history: Mapping[str, float] = field(default_factory=dict)

    def with_history(self, moved_rad: float) -> Weighing:
        """The same where histories that nobody recorded move the zeros of the joint's angle by so much."""
        zero_sd = {**self.zero_sd, JOINT: max(ZERO_FAINT * self.sigma[JOINT], moved_rad)}
        return replace(self, zero_sd=zero_sd, history={JOINT: moved_rad})


class Aside(NamedTuple):
    """What is found inside of the fit, of one channel, in its unit.

    `zeros`: of each session and of each recording, by name (and slope by motor angle, for the motor torque);
    `carryover`: what each recording's history adds to its judged rows, by name.
    """

    zeros: dict[str, FloatArray]
    carryover: dict[str, FloatArray]


@dataclass(frozen=True)
class Problem:
    """Recordings, a joint, what of it is free."""

    config: JointConfig
    parameters: tuple[Parameter, ...]
    evidence: tuple[Evidence, ...]
    weighing: Weighing
    fine: bool = False
    bases: Mapping[str, Zeros] = field(default_factory=dict)
    _last: tuple[bytes, Misfits] | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.bases:
            object.__setattr__(self, "bases", {c: self._zeros_of(c) for c in self.channels})

    @property
    def channels(self) -> tuple[str, ...]:
        """Output channels that count, the joint's angle first."""
        return tuple(self.weighing.sigma)

    # --- coordinates --------------------------------------------------------------------------------------------------

    @property
    def start(self) -> FloatArray:
        """Coordinates of the starting values."""
        return np.array([p.x(p.start) for p in self.parameters])

    def values(self, x: FloatArray) -> dict[str, float]:
        """Parameters by name, in their own units."""
        return {p.name: p.value(float(v)) for p, v in zip(self.parameters, x, strict=True)}

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of x."""
        free = self.parameters
        return np.array([p.x(p.low) for p in free]), np.array([p.x(p.high) for p in free])

    def with_evidence(self, evidence: Sequence[Evidence]) -> Problem:
        """The same about other recordings."""
        return replace(self, evidence=tuple(evidence), bases={})

    def finely(self) -> Problem:
        """The same, run on every fine row, as laws with rates need it."""
        return replace(self, fine=True)

    def with_own(self, place: int) -> Problem:
        """The same with a value of each session's own of the parameter at this place."""
        own = own_of(self.parameters[place], self.sessions)
        return replace(self, parameters=(*self.parameters[:place], *own, *self.parameters[place + 1 :]))

    def with_weighing(self, weighing: Weighing) -> Problem:
        """The same with other weights; misfits hang on which channels have some, and on no weight."""
        changed = replace(self, weighing=weighing, bases={})
        if changed.channels == self.channels:
            object.__setattr__(changed, "_last", self._last)
        return changed

    # --- misfits ------------------------------------------------------------------------------------------------------

    def joint(self, x: FloatArray, recording: Evidence) -> JointConfig:
        """The joint at x as it stood in this recording."""
        return standing(self.config, self.values(x), recording)

    def misfits(self, x: FloatArray, known: Known | None = None) -> Misfits:
        """Measured less predicted, zeros still in it, on all judged rows, by channel and recording; NaN where
        the recording lacks the channel. Raises InputError where the drive cannot follow.

        `known`: misfits of recordings that are not run again, by the recording's place and channel. What was asked last
        is kept: a fit's own point is asked for its residual, its zeros and what it leaves of each channel.
        """
        last = self._last  # once: another thread may ask for another x meanwhile
        if known is None and last is not None and last[0] == x.tobytes():
            return last[1]
        values = self.values(x)
        common = with_common(self.config, values)
        found: Misfits = {c: [] for c in self.channels}
        cache: dict[Any, Simulator] = {}
        for k, r in enumerate(self.evidence):
            if known is not None and k in known:
                for c in self.channels:
                    found[c].append(known[k][c])
                continue
            key = self.stand_key(r)
            if key not in cache:
                cache[key] = simulator(stood(common, values, r), self.fine)
            predicted = cache[key].predict(r)
            for c in self.channels:
                if c in r.columns:
                    found[c].append(r.at_rows(c) - predicted[c])
                else:
                    found[c].append(np.full(len(r.rows), np.nan))
        if known is None:
            for part in chain(*found.values()):
                part.setflags(write=False)
            object.__setattr__(self, "_last", (x.tobytes(), found))
        return found

    def stand_key(self, r: Evidence) -> Any:
        """The same for recordings in which the joint stands alike, wherever x is."""
        return (
            r.session if any(p.session for p in self.parameters) else None,
            r.claimed,
            *r.apart.items(),
            *(r.condition[p.condition] for p in self.parameters if p.condition),
        )

    def residual(self, x: FloatArray) -> FloatArray:
        """Weighted misfits with their zeros taken off, channel by channel, then the priors."""
        found = self.followed(x)
        return np.concatenate([np.full(self._length(), HOPELESS), self.prior(x)]) if found is None else found

    def refused(self, residual: FloatArray) -> bool:
        """Whether a residual is that of a drive that cannot follow the recordings."""
        return bool(np.all(residual[: len(residual) - len(self.parameters)] == HOPELESS))

    def followed(self, x: FloatArray) -> FloatArray | None:
        """As `residual`; None where the drive cannot follow."""
        try:
            return self.weighted(x, self.misfits(x))
        except InputError:
            return None

    def weighted(self, x: FloatArray, misfits: Mapping[str, Sequence[FloatArray]]) -> FloatArray:
        """The residual at x whose misfits are these."""
        return np.concatenate([self.rows(misfits), self.prior(x)])

    def rows(self, misfits: Mapping[str, Sequence[FloatArray]]) -> FloatArray:
        """Data rows of a residual that has these misfits (or columns of them): weighted, zeros taken off, channel by
        channel."""
        return np.concatenate([self.bases[c].project(self._rows(c, misfits[c])) for c in self.channels])

    def prior(self, x: FloatArray) -> FloatArray:
        """Departures from the priors' centres over their sds (0 where there is none)."""
        return np.array([
            (v - p.centre_x) / p.sd if np.isfinite(p.sd) else 0.0
            for p, v in zip(self.parameters, x, strict=True)
        ])  # fmt: skip

    def jacobian(
        self, x: FloatArray, base: FloatArray | None = None, beside: Mapping[int, FloatArray] | None = None
    ) -> FloatArray:
        """d residual / d x by differences, inward at a bound, to the other side where the drive cannot follow, none of
        the data's where it can follow to neither side. `beside`: columns that are known already."""
        here = self.residual(x) if base is None else base
        low, high = self.bounds()
        refused_here = self.refused(here)
        columns = np.empty((len(here), len(x)))
        told = {} if beside is None else beside
        known = self._known(x) if len(told) < len(x) else None

        def column(k: int) -> FloatArray:
            inward = STEP if x[k] + STEP <= high[k] else -STEP
            for step in (inward, -inward):
                moved = x.copy()
                moved[k] += step
                if step == inward or low[k] <= moved[k] <= high[k]:
                    there = self._beside(moved, known, self.parameters[k].session)
                    if refused_here or not self.refused(there):
                        return np.asarray((there - here) / step, dtype=np.float64)
            return np.concatenate([np.zeros(len(here) - len(x)), (self.prior(moved) - self.prior(x)) / step])

        asked = [k for k in range(len(x)) if k not in told]
        for k, found in (*told.items(), *zip(asked, side_by_side(column, asked), strict=True)):
            columns[:, k] = found
        return columns

    def _known(self, x: FloatArray) -> Misfits | None:
        """Misfits at x where some parameter is one session's own, so that others need not be run for it."""
        if not any(p.session for p in self.parameters):
            return None
        try:
            return self.misfits(x)
        except InputError:
            return None

    def _beside(self, x: FloatArray, known: Misfits | None, session: str | None) -> FloatArray:
        if known is None or session is None:
            return self.residual(x)
        others = (k for k, r in enumerate(self.evidence) if r.session != session)
        try:
            return self.weighted(x, self.misfits(x, {k: of_recording(known, k) for k in others}))
        except InputError:
            return self.residual(x)

    def zeros(self, x: FloatArray) -> dict[str, dict[str, FloatArray]]:
        """By channel: the zero (and slope, for the motor torque) of each session, and of each recording, in the
        channel's unit."""
        misfits = self.misfits(x)
        return {c: self._aside(c, misfits[c]).zeros for c in self.channels}

    def aside(self, x: FloatArray, channel: str = JOINT) -> Aside:
        """What is found inside of the fit, of one channel."""
        return self._aside(channel, self.misfits(x)[channel])

    def left(self, x: FloatArray, channel: str = JOINT, own_zero: bool = True) -> list[FloatArray]:
        """Misfit of a channel on all judged rows with the recordings' zeros (or the sessions', where a recording's was
        not set anew) taken off."""
        misfits = self.misfits(x)[channel]
        zeros, carryover = self._aside(channel, misfits)
        parts = []
        for r, m in zip(self.evidence, misfits, strict=True):
            own = own_zero or r.name in self.weighing.moved.get(channel, ())
            zero = zeros[r.name if own else r.session]
            line = zero[0] + (zero[1] * r.at_rows("motor_position_rad") if len(zero) > 1 else 0.0)
            parts.append(m - line - carryover[r.name])
        return parts

    @property
    def departs(self) -> bool:
        """Whether recordings have zeros beside their sessions': one alone in its session has none, and whether
        there are penalties must not hang on weights."""
        return len(self.evidence) > len(self.sessions)

    @property
    def sessions(self) -> tuple[str, ...]:
        """The recordings' sessions, in order."""
        return tuple(dict.fromkeys(r.session for r in self.evidence))

    @property
    def repeated(self) -> frozenset[str]:
        """Sessions of more than one recording."""
        count = Counter(r.session for r in self.evidence)
        return frozenset(s for s, n in count.items() if n > 1)

    def states(self, name: str) -> bool:
        """Whether the configuration states how a parameter differs between the recordings."""
        return any(name in r.apart for r in self.evidence)

    def spans(self) -> dict[str, slice]:
        """Where each channel's rows lie in the residual."""
        found, first = {}, 0
        for c in self.channels:
            count = sum(int(r.counted[c].sum()) if c in r.counted else 0 for r in self.evidence)
            found[c] = slice(first, first + count)
            first += count + self.bases[c].penalty_rows
        return found

    def owners(self, channel: str) -> IntArray:
        """Which recording each counted row of a channel belongs to."""
        counts = [int(r.counted[channel].sum()) if channel in r.counted else 0 for r in self.evidence]
        return np.repeat(np.arange(len(counts)), counts)

    # --- inside -------------------------------------------------------------------------------------------------------

    def _aside(self, channel: str, misfits: Sequence[FloatArray]) -> Aside:
        solved = self.bases[channel].solve(self._rows(channel, misfits))
        width = 2 if channel == MOTOR else 1
        zeros = {s: solved[width * k : width * (k + 1)] for k, s in enumerate(self.sessions)}
        carryover = {}
        first = width * len(self.sessions)
        for r in self.evidence:
            zeros[r.name] = zeros[r.session].copy()
            if self.departs:
                zeros[r.name][0] += solved[first]
                first += 1
        for r in self.evidence:
            columns = r.carryover.get(channel) if channel in r.counted else None
            count = 0 if columns is None else columns.shape[1]
            here = solved[first : first + count]
            carryover[r.name] = np.zeros(len(r.rows)) if columns is None else columns @ here
            first += count
        return Aside(zeros, carryover)

    def _rows(self, channel: str, misfits: Sequence[FloatArray]) -> FloatArray:
        parts = []
        for r, m in zip(self.evidence, misfits, strict=True):
            if channel in r.counted:
                kept = r.counted[channel]
                parts.append((r.weight[kept] * m[kept].T).T / self.weighing.sigma[channel])
        return np.concatenate(parts) if parts else np.empty(0)

    def _length(self) -> int:
        rows = sum(int(s.stop - s.start) for s in self.spans().values())
        return rows + sum(z.penalty_rows for z in self.bases.values())

    def _zeros_of(self, channel: str) -> Zeros:
        sigma, spread = self.weighing.sigma[channel], self.weighing.zero_sd.get(channel, 0.0)
        moved = self.weighing.moved.get(channel, {})
        least = max(spread, 1e-6 * sigma)
        departs = [moved.get(r.name, least) for r in self.evidence] if self.departs else []
        return zeros_of(self.evidence, self.sessions, channel, sigma, departs)
