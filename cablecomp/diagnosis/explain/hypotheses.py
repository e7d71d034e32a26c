"""Every effect as a hypothesis: where its parameters start, which channel it reads, which shapes are tried first."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.explain.courses import Course
from cablecomp.diagnosis.explain.neighbours import neighbours
from cablecomp.diagnosis.explain.starts import absolute, grid, width
from cablecomp.effects import Effect, Parameter, catalogue
from cablecomp.effects.base import Role, at_most
from cablecomp.estimation.evidence import MOTOR, OUTPUTS, Evidence, load_channel, varies
from cablecomp.estimation.parameter import Parameter as Free
from cablecomp.estimation.parameter import of_drive, of_effect, vague_drive
from cablecomp.estimation.simulate import load_of

OF_COURSE: Final = ("duration", "curve", "step", "step size")
"""Roles of what tells an event's course beside its instant."""
OF_CYCLE: Final = ("cycle", "cycle start")
"""Roles of what tells how something comes and goes, again and again."""


@dataclass(frozen=True)
class Start:
    """One point to begin from: the effect's parameters by name, texts included; the first amplitude is scaled later."""

    values: Mapping[str, float | str]


@dataclass(frozen=True)
class Hypothesis:
    """One effect (and the channel that it reads), with the points to begin from.

    `name`: its id, with `:channel` where it reads one, with `:amount` for a second of its amounts. `amount`: the
    parameter that says how much. `further`: values of shapes that the starts leave out, asked for once the best start
    is known.
    """

    effect: Effect
    name: str
    amount: Parameter
    starts: tuple[Start, ...]
    two_sided: bool
    channel: str = ""
    further: tuple[Mapping[str, float], ...] = ()

    def same_as(self, other: Hypothesis) -> bool:
        """Whether both are one physics, of one channel where they have to read one."""
        channels = self.channel == other.channel or self.effect.texts_optional
        return self.effect.id == other.effect.id and channels

    @property
    def acts_through(self) -> tuple[str, ...]:
        """Covariates in which its mismatch shows, best first, the channel that it reads by name."""
        return self.effect.covariates(self.channel)

    def key(self, parameter: str) -> str:
        """The full name of one of the effect's parameters, as a fit has it."""
        return f"effect.{self.effect.id}.{parameter}"

    @property
    def has_instant(self) -> bool:
        """Whether it is an event."""
        return self.instant != ""

    @property
    def has_phase(self) -> bool:
        """Whether it has a phase, which goes with the amount as a pair."""
        return self.phase != ""

    @property
    def instant(self) -> str:
        """The name of the event's instant."""
        return self._of_role("instant")

    @property
    def phase(self) -> str:
        """The name of its phase."""
        return self._of_role("phase")

    @property
    def duration(self) -> str:
        """The name of how long the event takes."""
        return self._of_role("duration")

    def course(self, c: Course) -> dict[str, float]:
        """The values of an event that goes like this."""
        found = {self.instant: c.instant_s}
        for (after, size), (after_s, of_it) in zip(self._further_steps, c.steps, strict=False):
            found |= {after: after_s, size: of_it}
        if not c.steps and self.duration:
            found[self.duration] = c.duration_s
        curve = self.effect.of_role("curve")
        if curve is not None and c.curve != curve.neutral:
            found[curve.name] = c.curve
        return found

    def course_by(self, values: Mapping[str, float | str]) -> Course:
        """How an event of these values goes."""

        def value(name: str, otherwise: float) -> float:
            return float(values.get(name, otherwise))

        steps = [(value(after, math.nan), value(size, 1.0)) for after, size in self._further_steps]
        curve = self.effect.of_role("curve")
        return Course(
            float(values[self.instant]),
            value(self.duration, 0.0),
            1.0 if curve is None else value(curve.name, curve.neutral),
            tuple((after, size) for after, size in steps if not math.isnan(after)),
        )

    @property
    def of_course(self) -> frozenset[str]:
        """The names of what tells the event's course beside its instant."""
        return frozenset(p.name for p in self.effect.parameters if p.role in OF_COURSE)

    @property
    def cycle_start(self) -> str:
        """The name of when what comes and goes comes, once; "" where its law knows no such."""
        return self._of_role("cycle start")

    @property
    def of_cycle(self) -> tuple[str, ...]:
        """The names of how often that comes, for what share of the time it stays, what share is always there."""
        return tuple(p.name for p in self.effect.parameters if p.role == "cycle" and not p.held)

    @property
    def goes_in_steps(self) -> bool:
        """Whether it is an event whose law knows further steps."""
        return bool(self._further_steps)

    @property
    def _further_steps(self) -> list[tuple[str, str]]:
        """The names of when each further step comes, and of how large it is."""
        of = {r: [p.name for p in self.effect.parameters if p.role == r] for r in ("step", "step size")}
        return list(zip(of["step"], of["step size"], strict=True))

    def _of_role(self, role: Role) -> str:
        """The name of the parameter of that role that goes with the amount; "" where there is none."""
        own = (p for p in self.effect.parameters if p.of in ("", self.amount.name))
        return next((p.name for p in own if p.role == role), "")

    @property
    def further_at_speed(self) -> tuple[Mapping[str, float], ...]:
        """What of `further` goes with speed: all of a law with rates, else what such a shape is."""
        at_speed = {p.name for p in self.effect.parameters if self.effect.rates or p.of_speed}
        return tuple(values for values in self.further if at_speed & set(values))

    @property
    def trades(self) -> bool:
        """Whether it trades places with calibration and other effects of its kind: friction and stiffness in
        the load's path."""
        plain = not (self.has_instant or self.has_phase or self.effect.texts or self.effect.rates)
        through = set(self.effect.acts_through)
        return plain and bool({"load", "reversal"} & through) and "time" not in through and not self.groove

    @property
    def groove(self) -> bool:
        """Whether it depends on the place in the groove."""
        return "joint_angle" in self.effect.acts_through

    def entry(self, values: Mapping[str, float | str]) -> EffectEntry:
        """The configuration's entry with these values, inside what the law can take."""
        inside = {
            k: (
                v
                if isinstance(v, str)
                else min(max(v, self.effect.parameter(k).minimum), self.effect.parameter(k).maximum)
            )
            for k, v in values.items()
        }
        return EffectEntry(id=self.effect.id, **inside)

    def neutral(self, values: Mapping[str, float | str]) -> dict[str, float | str]:
        """The same with its amount switched off."""
        return {**values, self.amount.name: self.amount.neutral}

    def free(self, values: Mapping[str, float | str], config: JointConfig) -> tuple[Free, ...]:
        """The parameters to fit, from these values; a second amount that starts neutral may grow."""
        numbers = {k: v for k, v in values.items() if not isinstance(v, str)}
        fitted = {k: v for k, v in numbers.items() if not self.effect.parameter(k).held}
        return of_effect(self.effect, fitted, config)


def hypotheses(config: JointConfig, evidence: Sequence[Evidence]) -> list[Hypothesis]:
    """All effects that the configuration does not hold yet and that these recordings could show."""
    held = {entry.id for entry in config.effect}
    told, vague = loaded(config, evidence), vague_drive(of_drive(config))
    load = load_channel(config, evidence[0].columns)
    at_motor, both_ways = load == MOTOR, _changes_sign(config, evidence)
    found = []
    for effect in catalogue().values():
        if effect.id in held or (effect.felt_by_motor and at_motor):
            continue
        mute = {
            p.name
            for p in effect.parameters
            if (p.of_load and not told)
            or (p.of_known_drive and vague)
            or (p.of_motor_load and not at_motor)
            or (p.of_both_ways and not both_ways)
            or (p.needs and not _tells(evidence, p.needs, load))
        }
        # a shape goes with its amount
        asked = tuple(p for p in effect.parameters if not mute & {p.name, p.of})
        found += _of_effect(replace(effect, parameters=asked), config, evidence)
    return found


def _of_effect(effect: Effect, config: JointConfig, evidence: Sequence[Evidence]) -> list[Hypothesis]:
    load = load_channel(config, evidence[0].columns)
    if not all(_tells(evidence, channel, load) for channel in effect.needs):
        return []
    channels = [""] if not effect.texts or effect.texts_optional else []
    if effect.texts:
        channels += [n for n in neighbours(config, evidence) if n.endswith(effect.channel_ends)]
    found = []
    for c in channels:
        read = _by_readings(effect, width(evidence, c)) if c else effect
        read = _of_one_cable(read) if config.drive.circuit == "open" else read
        read = _within(read, max(float(np.ptp(e.columns["time_s"])) for e in evidence))
        amounts = [p for p in read.parameters if not p.shape and not p.held]
        found += [_by_amount(read, p, c, config, evidence) for p in amounts]
    return found


def _by_readings(effect: Effect, largest: float) -> Effect:
    """The effect with what its amounts range over by unit of a channel whose largest reading is that."""

    def read(p: Parameter) -> Parameter:
        unit = largest if p.role == "slack" else 1.0 / largest
        return replace(p, low=p.low * unit, high=p.high * unit) if p.per_reading else p

    return replace(effect, parameters=tuple(read(p) for p in effect.parameters))


def _of_one_cable(effect: Effect) -> Effect:
    """The effect where there is no cable l."""
    parameters = (
        replace(p, low=max(p.low, 0.0), minimum=max(p.minimum, 0.0)) if p.of_cable_l == "below zero" else p
        for p in effect.parameters
        if p.of_cable_l != "always"
    )
    return replace(effect, parameters=tuple(parameters))


def _within(effect: Effect, longest_s: float) -> Effect:
    """The effect with its times that have to show within a recording of that length (`Parameter.within_recording`)."""
    parameters = (
        replace(p, maximum=min(p.maximum, longest_s), is_another=at_most) if p.within_recording else p
        for p in effect.parameters
    )
    return replace(effect, parameters=tuple(parameters))


def _by_amount(
    effect: Effect, amount: Parameter, channel: str, config: JointConfig, evidence: Sequence[Evidence]
) -> Hypothesis:
    own = [p for p in effect.parameters if p.of in ("", amount.name)]
    asked_together = {name for values in effect.tries for name in values}
    together = {p.name for p in own if p.omitted is not None and p.name in asked_together}
    # of an event, asked for by itself; of a channel that is not read
    aside = (*OF_COURSE, *OF_CYCLE, *(() if channel else ("tilt",)))
    shapes = [p for p in own if p.shape and not p.tries and p.name not in together and p.role not in aside]
    # an amount with a shape of its own is a hypothesis of its own
    shaped = {p.of for p in effect.parameters if not p.tries and p.name not in asked_together}
    further = [
        p for p in own if not (p.shape or p is amount or p.name in shaped or p.by_itself or amount.by_itself)
    ]
    low, high = amount.bounds(config)
    size = math.sqrt(low * high) if amount.log and low > 0.0 else 0.05 * max(abs(low), abs(high))
    two_sided = not amount.log and low < 0.0
    texts: dict[str, float | str] = {effect.texts[0]: channel} if channel else {}
    grids = {p.name: grid(p, config, evidence, channel) for p in shapes}
    widths: dict[str, tuple[float, ...]] = {}
    if any(p.role == "place" for p in shapes):  # first where, by a usual width; then how wide
        widths = {p.name: grids[p.name] for p in shapes if p.role != "place"}
        grids |= {name: (values[len(values) // 2],) for name, values in widths.items()}
    starts = tuple(
        Start(
            {
                amount.name: size,
                **{p.name: v for p, v in zip(shapes, point, strict=True) if not math.isnan(v)},
                **{p.name: p.neutral for p in further},
                **texts,
            }
        )
        for point in itertools.product(*grids.values())
    )
    second = "" if amount is next(p for p in effect.parameters if not p.shape) else amount.name
    name = ":".join(filter(None, (effect.id, channel, second)))
    names = {p.name for p in own}
    tried = [{p.name: v} for p in own for v in p.tries]
    mute = {p.name for p in own if p.role in aside}
    tried += [dict(values) for values in effect.tries if set(values) <= names - mute]
    asked = tuple(
        {n: absolute(effect, n, v, config, evidence, channel) for n, v in values.items()} for values in tried
    )
    other = ({n: v} for n, values in widths.items() for v in values if v not in grids[n])
    return Hypothesis(effect, name, amount, starts, two_sided, channel, (*other, *asked))


def at_instants(h: Hypothesis, instants: Sequence[float]) -> Hypothesis:
    """The same event asked for at these instants."""
    base = h.starts[0].values
    return replace(h, starts=tuple(Start({**base, h.instant: float(t)}) for t in instants))


def _tells(evidence: Sequence[Evidence], channel: str, load: str | None) -> bool:
    """Whether the recordings have the channel as an effect needs it; an output that the load is read from is an
    input."""
    if channel in OUTPUTS and channel != load:
        return all(channel in e.counted for e in evidence)
    return varies(evidence, channel)


def loaded(config: JointConfig, evidence: Sequence[Evidence]) -> bool:
    """Whether the recordings tell a load."""
    channel = load_channel(config, evidence[0].columns)
    return channel is not None and varies(evidence, channel)


def _changes_sign(config: JointConfig, evidence: Sequence[Evidence]) -> bool:
    """Whether the load goes as far as a twentieth of its largest both ways."""
    loads = [load_of(config, e.columns) for e in evidence]
    low, high = min(float(np.nanmin(m)) for m in loads), max(float(np.nanmax(m)) for m in loads)
    return min(-low, high) > 0.05 * max(-low, high)
