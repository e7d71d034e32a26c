"""How far an event has gone: at once, for a while (evenly, or ever more slowly or quickly), or in steps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from cablecomp.config import JointConfig
from cablecomp.effects.base import Parameter
from cablecomp.errors import InputError
from cablecomp.mechanics.jit import njit

FURTHER: Final = ("second", "third", "fourth")
"""Steps that may follow the first."""

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

STEPS: Final = tuple(
    p
    for k, step in enumerate(FURTHER, start=2)
    for p in (
        Parameter(
            f"{step}_after_s",
            "s",
            math.nan,
            0.0,
            3600.0,
            f"a_{k}, how long after the first its {step} step comes; left out: none does",
            role="step",
            held=True,
            omitted=math.nan,
            minimum=0.0,
            maximum=1e6,
        ),
        Parameter(
            f"{step}_size",
            "-",
            1.0,
            0.05,
            20.0,
            f"w_{k}, size of its {step} step over that of the first",
            log=True,
            role="step size",
            omitted=1.0,
            minimum=0.0,
            maximum=1e3,
            reach=5.0,
        ),
    )
)
"""When its further steps come, and how large they are."""

COURSE: Final = (
    "g = u^c, c >= 1, or 1 - (1 - u)^(1/c), c < 1, of u = (t - t*)/d within 0..1, d = 0: a step; in steps "
    "g = sum of w_k over t >= t* + a_k, over the sum of all w_k (a_1 = 0, w_1 = 1)"
)
"""The course of an event in its equation."""

LENGTHS: Final = (("after", len(FURTHER)), ("size", len(FURTHER)))
"""Arrays that an event's term takes beside its amount, instant, duration and curve."""


@njit
def gone(since_s: Any, duration_s: Any, curve: Any, after_s: Any, size: Any) -> Any:
    """g, how far an event has gone `since_s` >= 0 after its instant, 0..1."""
    if not math.isnan(after_s[0]):
        whole, done = 1.0, 1.0
        for k in range(len(after_s)):
            if not math.isnan(after_s[k]):
                whole += size[k]
                if since_s >= after_s[k]:
                    done += size[k]
        return done / whole
    if since_s >= duration_s:
        return 1.0
    share = since_s / duration_s
    return share**curve if curve >= 1.0 else 1.0 - (1.0 - share) ** (1.0 / curve)


def course(values: Mapping[str, float], config: JointConfig) -> dict[str, float | list[float]]:
    """Instant, duration, curve and further steps as an event's term takes them; raises InputError for steps out of
    order, without an instant or of what takes its time otherwise, and for a curve of what happens at once."""
    after = [values[f"{step}_after_s"] for step in FURTHER]
    sizes = [values[f"{step}_size"] for step in FURTHER]
    given = [a for a in after if not math.isnan(a)]
    if any(math.isnan(a) for a in after[: len(given)]) or given != sorted(given):
        said = ", ".join(
            f"{k}_after_s = {a:g}" for k, a in zip(FURTHER, after, strict=True) if not math.isnan(a)
        )
        raise InputError(
            f"{config.name}: an event's further steps come one after another, each counted from the first, and "
            f"`effect` has {said}; give them in rising order, from `{FURTHER[0]}_after_s` on"
        )
    sized = zip(FURTHER, after, sizes, strict=True)
    lone = next((k for k, a, w in sized if math.isnan(a) and w != 1.0), None)
    if lone is not None:
        raise InputError(
            f"{config.name}: key `effect.{lone}_size` is given, and `effect.{lone}_after_s`, when that step comes, "
            "is not; give it too [s], or leave the size out"
        )
    if given and (values["duration_s"] != 0.0 or values["curve"] != 1.0):
        raise InputError(
            f"{config.name}: an event goes in steps (`effect.{FURTHER[0]}_after_s`) or takes its time "
            "(`effect.duration_s`, `effect.curve`), and both are given; leave one of them out"
        )
    if values["curve"] != 1.0 and values["duration_s"] == 0.0:
        raise InputError(
            f"{config.name}: key `effect.curve` is {values['curve']:g}, and `effect.duration_s`, the time that it "
            "shapes, is 0; give it above 0 [s], or leave the curve out where all happens at once"
        )
    return {
        "instant": values["time_s"],
        "duration": values["duration_s"],
        "curve": values["curve"],
        "after": after,
        "size": sizes,
    }
