"""Frames as every onlooker gets them: plain numbers by name, None for what is not known, and the wraps' profiles."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.observer import Observer, WrapProfile
from cablecomp.signals import Sample

Frame = dict[str, Any]
Profiles = Callable[[Any], Sequence[WrapProfile]]
_POINTS: Final = 60
"""Points of a profile that are shown: its bends are kept where there are fewer, else the farthest apart."""


def profiles_of(config: JointConfig) -> Profiles:
    """Function from an observer's state vector to its profiles, by an observer of its own, whose compiled code is
    loaded by now: that may take a second, and frames would come meanwhile."""
    twin = Observer(config)

    def found(vector: Any) -> Sequence[WrapProfile]:
        twin.set_vector(vector)
        return twin.profiles()

    twin.step(Sample(0.0, 0.0, 0.0, 0.0, config.motor_zero_Nm, 0.0, (0.0,) * len(twin.channels)))
    twin.profiles()
    return found


def unpacked(datagram: bytes, profiles: Profiles) -> Frame:
    """The frame in a datagram of `instrument.packed`."""
    head, _, body = datagram.partition(b"\n")
    scalars = json.loads(head)
    wraps = profiles(np.frombuffer(body, dtype=np.float64)) if body else ()
    return frame(scalars, wraps)


def frame(scalars: dict[str, Any], wraps: Sequence[WrapProfile]) -> Frame:
    """Scalars and profiles as a frame that any JSON reader takes."""
    found: Frame = {name: _plain(value) for name, value in scalars.items()}
    found["measured_rad"] = _sum(found.get("deflection_rad"), found.get("residual_rad"))
    found["wraps"] = [_thinned(wrap) for wrap in wraps]
    return found


def _thinned(wrap: WrapProfile) -> dict[str, Any]:
    angle, tension = np.asarray(wrap.angle_rad), np.asarray(wrap.tension_N)
    if len(angle) > _POINTS:
        keep = np.unique(
            np.searchsorted(angle, np.linspace(angle[0], angle[-1], _POINTS)).clip(0, len(angle) - 1)
        )
        angle, tension = angle[keep], tension[keep]
    return {
        "name": wrap.name,
        "angle_rad": np.round(angle, 5).tolist(),
        "tension_N": np.round(tension, 4).tolist(),
    }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _sum(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else a + b
