"""Sessions, conditions and empirical laws in a joint configuration.

A session is everything recorded without taking the joint apart or re-mounting it. Some values are each
session's own: the zeros of the sensors always, the pretension where the cables were set anew.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Final, Self

from pydantic import Field, model_validator

from cablecomp.config.base import Finite, Frozen, Listed, Positive, Text

ZEROS: Final = ("joint_position_offset_rad", "motor_torque_offset_Nm")
"""What may differ from session to session unless the configuration says otherwise: the zeros."""

_ESCAPED: Final = re.compile(r"\[([*?[])\]")
"""A character of a path that a pattern does not mean as its own: `glob.escape` writes it so."""


class Session(Frozen):
    """One `[[session]]`; without a name (`[session]`) it says what holds for all sessions.

    `own`: names of the parameters that may differ from session to session. `recordings`: patterns of paths
    (`*`, `?`, `[..]` as in a shell; a folder stands for all that is in it), matched from the right; one that is a
    recording's own path goes before all others, of several the longest, of these the one in the shortest list, and a
    part of a mounting before that mounting. `values`: what this session's own parameters
    are, by name. `mounting`: the session that this is a part of, where the drive stood differently in its recordings
    (before and after an event; bent more or less): zeros, and what is `own`, are the mounting's.
    """

    name: str = ""
    mounting: str = ""
    own: Annotated[tuple[Text, ...], Listed] | None = None
    recordings: Annotated[tuple[Text, ...], Listed] = ()
    values: dict[str, Finite] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _named(self) -> Self:
        if not self.name and (self.recordings or self.values or self.mounting):
            raise ValueError("a session with `recordings`, `values` or a `mounting` needs a `name`; add it")
        return self

    def matches(self, recording: Path) -> bool:
        """Whether one of the patterns names this recording or a folder that it is in."""
        places = [place for place in (recording, *recording.parents) if place.name]
        return any(self.names(p) or any(map(p.match, self.recordings)) for p in places)

    def names(self, recording: Path) -> int:
        """How many parts of this recording's own path one of the patterns is, from the right; 0 if none is."""
        paths = (
            Path(p).parts for pattern in self.recordings for p in (pattern, _ESCAPED.sub(r"\1", pattern))
        )
        return max((len(parts) for parts in paths if recording.parts[-len(parts) :] == parts), default=0)


class Depends(Frozen):
    """One `[[depends]]`: a parameter that grows with a condition, where no session says what it is.

    parameter(c) = parameter + per_unit (c - at), c the median of the condition's channel in the recording, held within
    `seen`: what the recordings that told it spanned.
    """

    parameter: Text
    on: Text
    per_unit: Finite
    at: Finite
    seen: Annotated[tuple[Finite, Finite], Listed]


class Empirical(Frozen):
    """One `[[empirical]]`: a law without a physical name, added to the predicted joint position.

    `id` says what it is; `law` its form; `of` the channel that it depends on. With x = (of - centre)/half_width,
    the argument in -1..1, the law gives sum of coefficients_rad[k] times the form's k-th function of x.
    `centre` and `half_width` are in the unit of `of`. With a `session` it holds in that one, or that
    mounting, alone.
    """

    id: Text
    law: Text
    of: Text
    centre: Finite = 0.0
    half_width: Positive = 1.0
    coefficients_rad: Annotated[tuple[Finite, ...], Listed] = Field(min_length=1)
    session: str = ""


def as_tables(value: Any) -> Any:
    """`[session]` alone is a list of one; both cannot stand in one TOML file."""
    return (value,) if isinstance(value, dict) else value


def check_names(where: str, names: Iterable[str], known: Iterable[str], stages: int) -> None:
    """Raise ValueError for names that are no parameters: known keys, `KEY.STAGE`, `effect.ID.KEY`, `ID.KEY`."""
    known = tuple(known)
    bad = [name for name in names if not _is_parameter(name, known, stages)]
    if bad:
        heads = [name.partition(".")[0] for name in bad[:9]]
        close = [near for head in heads for near in difflib.get_close_matches(head, known, 1) if near != head]
        hint = f"did you mean {', '.join(f'`{near}`' for near in dict.fromkeys(close))}?" if close else ""
        hint = hint or f"known are {', '.join(known)}, KEY.N of stage N, effect.ID.KEY"
        raise ValueError(
            f"[{where}]: {', '.join(f'`{name}`' for name in bad[:9])}: no such parameter; {hint}"
        )


def _is_parameter(name: str, known: tuple[str, ...], stages: int) -> bool:
    head, dot, rest = name.partition(".")
    if head in known:
        return not dot or (rest.isdecimal() and len(rest) < 4 and 1 <= int(rest) <= stages)
    return bool(head and rest) and not rest.isdecimal()
