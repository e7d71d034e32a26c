"""The tension profiles of all wraps, as users read them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.mechanics.assemble import Model
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.tables import ELSEWHERE, tau_of_v


class WrapProfile(NamedTuple):
    """Tension along one wrap: angle [rad] from the termination, tension [N]."""

    name: str
    angle_rad: NDArray[np.float64]
    tension_N: NDArray[np.float64]


def wrap_profiles(config: JointConfig, model: Model, memory: Floats, heights: Ints) -> list[WrapProfile]:
    """The tension profile on every wrap in the state `memory`, `heights`, termination first."""
    d = model.named(memory, heights)
    result = []
    for wrap in range(2 * d.size.cables):
        cable, state = d.cables[wrap // 2], d.states[wrap // 2]
        n = int(heights[wrap])
        t0 = cable.T0 * state.pretension * state.stiffness
        tau = np.array([tau_of_v(model.laws, ELSEWHERE, v) for v in d.profiles[wrap, :n]["v"]])
        name = _wrap_name(config, wrap, cable.sign)
        result.append(WrapProfile(name, d.profiles[wrap, :n]["y"].copy(), t0 * tau))
    return result


def _wrap_name(config: JointConfig, wrap: int, sign: float) -> str:
    stages = len(config.drive.stage)
    closed = config.drive.circuit == "closed"
    cable = wrap // 2
    if closed and config.drive.arrangement == "series":
        stage = cable // 2
    else:
        stage = cable % stages
    side = "output" if wrap % 2 == 0 else "input"
    label = f"cable {'h' if sign > 0 else 'l'}, {side} pulley"
    return label if stages == 1 else f"stage {stage + 1}, {label}"
