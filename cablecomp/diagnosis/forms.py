"""How each effect enters a fit: amplitudes that are nearly linear, and shapes that are tried on a grid first.

An amplitude coordinate x gives the value `scale * x` (x = 1 is a contribution worth seeing in these
data); a phase goes with its amplitude as a pair (a cos, a sin), so that no phase has to be guessed;
shapes (a time constant, an instant, a range) are tried on a few points and freed in the last fit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.effects import Effect, Parameter, catalogue
from cablecomp.signal.smoothing import FloatArray

PHASE = "phase_rad"
INSTANTS = 12


@dataclass(frozen=True)
class Surroundings:
    """What a form must know of the recordings: first and last time, mean temperature (NaN if none),
    other channels.
    """

    first_s: float
    last_s: float
    temperature_degC: float
    temperature_range: float
    others: tuple[str, ...]


@dataclass(frozen=True)
class Form:
    """One effect as a hypothesis.

    `amplitudes`: parameters fitted linearly; `shapes`: those that say how; `fixed`: the rest, texts
    included; `point`: shape values of this grid point; `scales`: unit of each amplitude coordinate;
    `limits`: bounds by name; `further`: amplitudes that join with the shapes, neutral until then.
    """

    effect: Effect
    amplitudes: tuple[Parameter, ...]
    shapes: tuple[Parameter, ...]
    phase: bool
    fixed: Mapping[str, float | str]
    point: tuple[float, ...]
    scales: tuple[float, ...]
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    further: tuple[Parameter, ...] = ()

    @property
    def name(self) -> str:
        """Effect and, where it reads one, its channel."""
        channel = self.fixed.get("channel")
        return self.effect.id if channel is None else f"{self.effect.id}:{channel}"

    @property
    def size(self) -> int:
        """Number of amplitude coordinates."""
        return len(self.amplitudes) + int(self.phase)

    def entry(self, x: Sequence[float], point: Sequence[float] | None = None) -> EffectEntry:
        """The configuration entry at coordinates x (and other shape values than its own, if given)."""
        values: dict[str, float | str] = dict(self.fixed)
        shape = self.point if point is None else point
        values |= {p.name: self._inside(p, v) for p, v in zip(self.shapes, shape, strict=True)}
        if self.phase:
            # a cos(q - phi) or e sin(q + phi): either way the pair turns the phase
            size, phase = math.hypot(x[0], x[1]), math.atan2(x[1], x[0])
            values[self.amplitudes[0].name] = self._inside(self.amplitudes[0], size * self.scales[0])
            values[PHASE] = phase
        else:
            for p, scale, v in zip(self.amplitudes, self.scales, x, strict=True):
                values[p.name] = self._inside(p, scale * v)
        return EffectEntry(id=self.effect.id, **values)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of the amplitude coordinates."""
        if self.phase:
            top = self._limit(self.amplitudes[0])[1] / self.scales[0]
            return np.full(2, -top), np.full(2, top)
        limits = [self._limit(p) for p in self.amplitudes]
        low = np.array([a / s for (a, _), s in zip(limits, self.scales, strict=True)])
        return low, np.array([b / s for (_, b), s in zip(limits, self.scales, strict=True)])

    def shape_bounds(self) -> list[tuple[float, float, bool]]:
        """(low, high, logarithmic) of each shape."""
        return [(*self.limits[p.name], p.log) for p in self.shapes]

    def scaled(self, factors: Sequence[float]) -> Form:
        """The same with larger or smaller units, kept inside what the law can take."""
        scales = []
        for p, s, f in zip(self.amplitudes, self.scales, factors, strict=True):
            top = max(abs(b) for b in self._limit(p))
            scales.append(min(s * f, top))
        return replace(self, scales=tuple(scales))

    def at(self, point: Sequence[float]) -> Form:
        """The same at another grid point."""
        return replace(self, point=tuple(point))

    def _limit(self, p: Parameter) -> tuple[float, float]:
        low, high = self.limits[p.name]
        return (0.0 if p.log or low >= 0.0 else low), high

    def _inside(self, p: Parameter, value: float) -> float:
        return float(min(max(value, p.minimum), p.maximum))


def forms_of(effect: Effect, config: JointConfig, around: Surroundings) -> list[Form]:
    """The effect's hypotheses for these recordings: one for each grid point of its shapes (and each
    channel it may read).

    Empty where the recordings lack what the effect acts through (no temperature, no other channel).
    """
    if effect.id == "thermal_pretension" and not around.temperature_range > 0.0:
        return []
    channels: list[str | None] = list(around.others) if effect.texts else [None]
    phase = any(p.name == PHASE for p in effect.parameters)
    amplitudes = tuple(p for p in effect.parameters if not p.shape)
    shapes = tuple(p for p in effect.parameters if p.shape and p.name not in (PHASE, "reference_degC"))
    limits = {p.name: p.bounds(config) for p in effect.parameters}
    limits["time_s"] = (around.first_s, around.last_s)
    grids = [_grid(p, limits[p.name], around) for p in shapes]
    fixed: dict[str, float | str] = {}
    if effect.id == "thermal_pretension":
        fixed["reference_degC"] = around.temperature_degC
    amplitudes, further = amplitudes[:1], amplitudes[1:]  # the first amplitude names the effect
    fixed |= {p.name: p.neutral for p in further}
    scales = tuple(_first_scale(p, limits[p.name]) for p in amplitudes)
    found = []
    for channel in channels:
        texts: dict[str, float | str] = {} if channel is None else {"channel": channel}
        found += [
            Form(effect, amplitudes, shapes, phase, {**fixed, **texts}, point, scales, limits, further)
            for point in itertools.product(*grids)
        ]
    return found


def all_forms(config: JointConfig, around: Surroundings) -> list[list[Form]]:
    """Hypotheses of every effect that the configuration does not hold yet, grouped by effect and channel."""
    groups: dict[str, list[Form]] = {}
    held = {entry.id for entry in config.effect}
    for effect in catalogue().values():
        if effect.id in held:
            continue
        for form in forms_of(effect, config, around):
            groups.setdefault(form.name, []).append(form)
    return list(groups.values())


def _first_scale(p: Parameter, limits: tuple[float, float]) -> float:
    low, high = limits
    return math.sqrt(low * high) if p.log and low > 0.0 else 0.05 * max(abs(low), abs(high))


def _grid(p: Parameter, limits: tuple[float, float], around: Surroundings) -> tuple[float, ...]:
    low, high = limits
    if p.name == "time_s":
        step = (around.last_s - around.first_s) / INSTANTS
        return tuple(around.first_s + step * (k + 0.5) for k in range(INSTANTS))
    if p.name == "arc_length_m":
        return (0.02 * high, 0.25 * high)
    if p.log:
        return tuple(float(v) for v in np.geomspace(low, high, 5)[1:-1])
    return (0.5 * (low + high),)


@dataclass(frozen=True)
class FreedForm(Form):
    """A form whose shapes are coordinates too: the first ones as in `Form`, then the further amplitudes,
    then one for each shape, 0 at the grid point.
    """

    @property
    def size(self) -> int:
        """Number of coordinates, shapes included."""
        return self._first + len(self.further) + len(self.shapes)

    @property
    def _first(self) -> int:
        return len(self.amplitudes) + int(self.phase)

    def shape_values(self, x: Sequence[float]) -> tuple[float, ...]:
        """Shape values at coordinates x: a factor exp(x/2) where logarithmic, else a shift by x
        twentieths of the range.
        """
        values = []
        for p, at, v in zip(self.shapes, self.point, x[self._first + len(self.further) :], strict=True):
            low, high = self.limits[p.name]
            values.append(at * math.exp(0.5 * v) if p.log else at + 0.05 * (high - low) * v)
        return tuple(values)

    def fixed_shapes(self, x: Sequence[float]) -> Form:
        """The form with its shapes fixed where x has them."""
        held = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return Form(**(held | {"point": self.shape_values(x)}))

    def entry(self, x: Sequence[float], point: Sequence[float] | None = None) -> EffectEntry:
        """The configuration entry at coordinates x."""
        shapes = self.shape_values(x) if point is None else point
        found = super().entry(x[: self._first], shapes)
        more = {
            p.name: self._inside(p, _first_scale(p, self.limits[p.name]) * v)
            for p, v in zip(self.further, x[self._first :], strict=False)
        }
        return EffectEntry(id=found.id, **{**found.parameters, **more})

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of all coordinates."""
        low, high = super().bounds()
        more = [(0.0 if a >= 0.0 else a, b) for p in self.further for a, b in [self._limit(p)]]
        scale = [_first_scale(p, self.limits[p.name]) for p in self.further]
        extra = [(a / s, b / s) for (a, b), s in zip(more, scale, strict=True)]
        for p, at in zip(self.shapes, self.point, strict=True):
            a, b = self.limits[p.name]
            if p.log:
                extra.append((2.0 * math.log(a / at), 2.0 * math.log(b / at)))
            else:
                extra.append(((a - at) / (0.05 * (b - a)), (b - at) / (0.05 * (b - a))))
        ends = np.array(extra).reshape(-1, 2)
        return np.concatenate([low, ends[:, 0]]), np.concatenate([high, ends[:, 1]])


def freed(form: Form) -> FreedForm:
    """The form with its shapes free."""
    if isinstance(form, FreedForm):
        return form
    return FreedForm(**{name: getattr(form, name) for name in form.__dataclass_fields__})


def has_instant(form: Form) -> bool:
    """Whether the form is an event, with its instant as the only shape."""
    return [p.name for p in form.shapes] == ["time_s"]
