"""Excitation protocols: what load and what joint position are asked for over time, as a TOML file states it.

    schema = 1
    name = "nested reversals"
    mode = "position"                  # or "force": the motor makes the load, against a held output
    [[segment]]
    kind = "ramp"                      # to a load, a position or both
    load_Nm = 2.0
    duration_s = 4.0

Kinds: `ramp`, `hold`, `sine_sweep`, `nested_reversals`, `rate_pair`, `angle_sweep`, `wait`, `unload`. Every
segment starts from where the one before ended; what a segment does not name is held. Times in s, loads in Nm
(external moment on the output pulley), positions in rad (joint).
"""

from __future__ import annotations

from bisect import bisect_right
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from cablecomp.config import Finite, Limits, NonNegative, Positive, read_toml, validated
from cablecomp.control.command import Reference
from cablecomp.control.segments import Knot, Piece, line, sweep
from cablecomp.errors import InputError

Channel = Literal["load", "position"]


class _Frozen(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Ramp(_Frozen):
    """To a load (linearly), a position (with least jerk) or both, within `duration_s`."""

    kind: Literal["ramp"] = "ramp"
    duration_s: Positive
    load_Nm: Finite | None = None
    position_rad: Finite | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.load_Nm is None and self.position_rad is None:
            raise ValueError("load_Nm, position_rad or both are accepted")
        return self

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        load = at.load if self.load_Nm is None else self.load_Nm
        position = at.position if self.position_rad is None else self.position_rad
        return [line(at, Knot(position, load), self.duration_s)]


class Hold(_Frozen):
    """Everything stays as it is for `duration_s`: creep and relaxation show."""

    kind: Literal["hold"] = "hold"
    duration_s: Positive

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        return [line(at, at, self.duration_s)]


class Wait(_Frozen):
    """As `hold`, for what changes by itself, such as temperature; `why` is for the reader."""

    kind: Literal["wait"] = "wait"
    duration_s: Positive
    why: str = ""

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        return [line(at, at, self.duration_s)]


class SineSweep(_Frozen):
    """`amplitude sin(phase)` about the present value, frequency rising geometrically; it ends where it
    began."""

    kind: Literal["sine_sweep"] = "sine_sweep"
    channel: Channel = "load"
    amplitude: Positive
    from_Hz: Positive
    to_Hz: Positive
    duration_s: Positive

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as one sweep."""
        return [sweep(at, self.channel == "load", self.amplitude, self.from_Hz, self.to_Hz, self.duration_s)]


class NestedReversals(_Frozen):
    """Ramps at `rate` per second to each of `peaks` in turn and back to the start: loops within loops."""

    kind: Literal["nested_reversals"] = "nested_reversals"
    channel: Channel = "load"
    peaks: Annotated[tuple[Finite, ...], Field(min_length=2)]
    rate: Positive
    dwell_s: NonNegative = 0.0

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        load = self.channel == "load"
        start = at.load if load else at.position
        found: list[Piece] = []
        for value in (*self.peaks, start):
            found += _travel(at, load, value, self.rate, self.dwell_s)
            at = found[-1].end if found else at
        return found


class RatePair(_Frozen):
    """The same swing to `amplitude`, its negative and back, once at each of `rates` per second: what depends
    on rate shows."""

    kind: Literal["rate_pair"] = "rate_pair"
    channel: Channel = "load"
    amplitude: Positive
    rates: Annotated[tuple[Positive, ...], Field(min_length=2)]
    dwell_s: NonNegative = 0.0

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        load = self.channel == "load"
        start = at.load if load else at.position
        found: list[Piece] = []
        for rate in self.rates:
            for value in (start + self.amplitude, start - self.amplitude, start):
                found += _travel(at, load, value, rate, self.dwell_s)
                at = found[-1].end
        return found


class AngleSweep(_Frozen):
    """There and back between two joint positions at the mean speed `speed_rad_s`, under a load held
    meanwhile, `cycles` times."""

    kind: Literal["angle_sweep"] = "angle_sweep"
    from_rad: Finite
    to_rad: Finite
    speed_rad_s: Positive
    load_Nm: Finite | None = None
    load_rate_Nm_s: Positive = 1.0
    cycles: Annotated[int, Field(ge=1)] = 1

    @model_validator(mode="after")
    def _somewhere(self) -> Self:
        if self.from_rad == self.to_rad:
            raise ValueError("from_rad and to_rad must differ")
        return self

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        found: list[Piece] = []
        if self.load_Nm is not None:
            found += _travel(at, True, self.load_Nm, self.load_rate_Nm_s, 0.0)
            at = found[-1].end if found else at
        for value in (self.from_rad, *((self.to_rad, self.from_rad) * self.cycles)):
            found += _travel(at, False, value, self.speed_rad_s, 0.0)
            at = found[-1].end if found else at
        return found


class Unload(_Frozen):
    """The load goes to zero at `rate_Nm_s`, then stays for `dwell_s`."""

    kind: Literal["unload"] = "unload"
    rate_Nm_s: Positive
    dwell_s: NonNegative = 0.0

    def pieces(self, at: Knot) -> list[Piece]:
        """The segment as lines."""
        return _travel(at, True, 0.0, self.rate_Nm_s, self.dwell_s)


Segment = Annotated[
    Ramp | Hold | Wait | SineSweep | NestedReversals | RatePair | AngleSweep | Unload,
    Field(discriminator="kind"),
]


def _travel(at: Knot, load: bool, value: float, rate: float, dwell_s: float) -> list[Piece]:
    end = at._replace(load=value) if load else at._replace(position=value)
    distance = abs(value - (at.load if load else at.position))
    found: list[Piece] = [line(at, end, distance / rate)] if distance > 0.0 else []
    if dwell_s > 0.0:
        found.append(line(end, end, dwell_s))
    return found


class Extremes(NamedTuple):
    """Least and greatest load (Nm) and joint position (rad) that a protocol asks for, and its greatest
    rates."""

    load_low_Nm: float
    load_high_Nm: float
    position_low_rad: float
    position_high_rad: float


class Protocol(_Frozen):
    """A sequence of segments; starts at `start_position_rad`, `start_load_Nm`, ends by holding what it came
    to."""

    schema_: Literal[1] = Field(alias="schema", default=1)
    name: Annotated[str, Field(min_length=1)]
    mode: Literal["position", "force"] = "position"
    note: str = ""
    start_position_rad: Finite = 0.0
    start_load_Nm: Finite = 0.0
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)]

    def model_post_init(self, context: Any, /) -> None:
        """Lay the segments out in time, once."""
        at, start = Knot(self.start_position_rad, self.start_load_Nm), 0.0
        pieces: list[Piece] = []
        starts: list[float] = []
        for segment in self.segment:
            for piece in segment.pieces(at):
                starts.append(start)
                pieces.append(piece)
                start += piece.duration_s
                at = piece.end
        object.__setattr__(self, "_pieces", tuple(pieces))
        object.__setattr__(self, "_starts", tuple(starts))
        object.__setattr__(self, "_end", at)
        object.__setattr__(self, "_duration", start)

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        duration: float = self.__dict__["_duration"]
        return duration

    def reference(self, time_s: float) -> Reference:
        """What is asked for at a time: position, velocity and load of the joint; before the start and after
        the end at rest."""
        starts: tuple[float, ...] = self.__dict__["_starts"]
        pieces: tuple[Piece, ...] = self.__dict__["_pieces"]
        if time_s >= self.duration_s or not pieces:
            end: Knot = self.__dict__["_end"]
            return Reference(end.position, 0.0, end.load)
        if time_s <= 0.0:
            return Reference(self.start_position_rad, 0.0, self.start_load_Nm)
        k = bisect_right(starts, time_s) - 1
        at = pieces[k].at(time_s - starts[k])
        return Reference(at.position, at.position_rate, at.load, at.position_rate_rate)

    def extremes(self) -> Extremes:
        """What it asks for at most."""
        pieces: tuple[Piece, ...] = self.__dict__["_pieces"]
        loads = [v for p in pieces for v in p.load_range()] or [self.start_load_Nm]
        positions = [v for p in pieces for v in p.position_range()] or [self.start_position_rad]
        return Extremes(min(loads), max(loads), min(positions), max(positions))

    def check_within(self, limits: Limits, where: str = "protocol") -> None:
        """Raise InputError if the protocol asks for more than the joint may be given."""
        e = self.extremes()
        most = limits.joint_torque_max_Nm
        asked = max(abs(e.load_low_Nm), abs(e.load_high_Nm))
        if most is not None and asked > most:
            raise InputError(
                f"{where}: asks for {asked:g} Nm; the joint's limit is {most:g} Nm; lower its loads"
            )
        low, high = limits.joint_position_min_rad, limits.joint_position_max_rad
        if low is not None and e.position_low_rad < low:
            raise InputError(
                f"{where}: asks for {e.position_low_rad:g} rad; the joint's limit is {low:g} rad"
            )
        if high is not None and e.position_high_rad > high:
            raise InputError(
                f"{where}: asks for {e.position_high_rad:g} rad; the joint's limit is {high:g} rad"
            )

    def to_toml(self) -> str:
        """The file that `load_protocol` reads back as this protocol."""
        lines = ["schema = 1", f"name = {_toml(self.name)}", f"mode = {_toml(self.mode)}"]
        if self.note:
            lines.append(f"note = {_toml(self.note)}")
        for key in ("start_position_rad", "start_load_Nm"):
            if getattr(self, key) != 0.0:
                lines.append(f"{key} = {_toml(getattr(self, key))}")
        for segment in self.segment:
            values = segment.model_dump(exclude_none=True)
            lines += ["", "[[segment]]", *(f"{key} = {_toml(value)}" for key, value in values.items())]
        return "\n".join(lines) + "\n"


def load_protocol(path: Path) -> Protocol:
    """Read a protocol file; raises InputError with one line that names file, key, what was found, what is
    accepted."""
    return parse_protocol(read_toml(path), str(path))


def parse_protocol(data: dict[str, Any], where: str) -> Protocol:
    """Validate a protocol already read; `where` names it in errors."""
    return validated(Protocol, data, where)


def _toml(value: Any) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        return f'"{escaped}"'
    if isinstance(value, tuple | list):
        return f"[{', '.join(_toml(v) for v in value)}]"
    return repr(value)
