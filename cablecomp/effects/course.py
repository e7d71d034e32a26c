"""How far an event has gone: at once, for a while (evenly, or ever more slowly or quickly), or in equal steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from cablecomp.config import JointConfig
from cablecomp.effects.base import Parameter
from cablecomp.errors import InputError
from cablecomp.mechanics.jit import njit

MOST_STEPS: Final = 50

DURATION: Final = Parameter(
    "duration_s",
    "s",
    0.0,
    0.0,
    3600.0,
    "d, how long the event takes; 0: all at once",
    role="duration",
    omitted=0.0,
    minimum=0.0,
    maximum=3600.0,
)
"""How long an event takes."""

STEPS: Final = Parameter(
    "steps",
    "-",
    0.0,
    0.0,
    5.0,
    "n, equal steps that it takes in that time, the first at its instant, the last at its end; 0: it goes evenly",
    role="steps",
    held=True,
    omitted=0.0,
    minimum=0.0,
    maximum=MOST_STEPS,
)
"""In how many steps."""

CURVE: Final = Parameter(
    "curve",
    "-",
    1.0,
    0.1,
    10.0,
    "c, how it goes in that time: 1 evenly, below 1 ever more slowly, above 1 ever more quickly",
    role="curve",
    held=True,
    omitted=1.0,
    minimum=0.05,
    maximum=20.0,
)
"""How what takes its time speeds up or settles."""

COURSE: Final = (
    "g = u^c, u = (t - t*)/d within 0..1, d = 0: a step; "
    "in n steps (1 + floor((n - 1) u^c))/n, all from t* + d"
)
"""The course of an event in its equation."""


@njit
def gone(since_s: Any, duration_s: Any, steps: Any, curve: Any) -> Any:
    """g, how far an event has gone `since_s` >= 0 after its instant, 0..1."""
    if since_s >= duration_s:
        return 1.0
    share = since_s / duration_s
    if curve != 1.0:
        share = share**curve
    if steps < 2.0:
        return share
    return (1.0 + int((steps - 1.0) * share)) / steps


def course(values: Mapping[str, float], config: JointConfig) -> dict[str, float]:
    """Instant, duration, steps and curve as an event's term takes them; raises InputError for a part of a step, and
    for steps or a curve of what happens at once."""
    steps = values["steps"]
    if steps != int(steps) or steps == 1.0:
        raise InputError(
            f"{config.name}: key `effect.steps` is {steps:g}; a whole number from 2 to {MOST_STEPS} is accepted, or 0 "
            "where it goes evenly (or at once: duration_s = 0)"
        )
    if steps and values["duration_s"] == 0.0:
        raise InputError(
            f"{config.name}: key `effect.steps` is {steps:g}, and `effect.duration_s`, from first step to last, "
            "is 0; give it above 0 [s], or leave the steps out where all happens at once"
        )
    if values["curve"] != 1.0 and values["duration_s"] == 0.0:
        raise InputError(
            f"{config.name}: key `effect.curve` is {values['curve']:g}, and `effect.duration_s`, the time that it "
            "shapes, is 0; give it above 0 [s], or leave the curve out where all happens at once"
        )
    return {
        "instant": values["time_s"],
        "duration": values["duration_s"],
        "steps": steps,
        "curve": values["curve"],
    }
