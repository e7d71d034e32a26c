"""The drive as a python-control nonlinear system: exact, with its whole history as state, or reduced to a few play
operators."""

from __future__ import annotations

from math import inf
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.plays import Plays, fit_plays, play
from cablecomp.control.stiffness import full, plain
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signals import Sample

Floats = NDArray[np.float64]
INPUTS = ["motor_position_rad", "joint_torque_Nm"]
OUTPUTS = ["joint_position_rad", "deflection_rad"]
TENSIONS = ["tension_h_N", "tension_l_N"]


def to_nlsys(
    config: JointConfig,
    period_s: float = 1e-3,
    name: str = "drive",
    *,
    states: int | None = None,
    load_max_Nm: float | None = None,
) -> Any:
    """The drive as a discrete-time `control.NonlinearIOSystem` from (motor position, joint torque) to (joint position,
    deflection); a state of zeros is uniform pretension at the first motor angle, and time is the state's own.

    `states` None: the observer itself, thousands of states, with both tensions as further outputs: for simulation; it
    has no operating points, as time is one of its states.
    `states` = n: n play operators (Prandtl-Ishlinskii) fitted to the drive's loops with the motor held, for loads up to
    `load_max_Nm` (None = the joint's limit, else R T0): any state is possible, so operating points, linearisation and
    frequency responses are quick; what turning of the drums does to the history is not in it. Its error on the loops
    that it was fitted to is `params["rms_rad"]`. Raises InputError.
    """
    if not 0.0 < period_s < inf:
        raise InputError(f"period_s is {period_s}; a time above 0 s is accepted")
    if states is None:
        return _exact(config, period_s, name)
    if states not in range(1, 65):
        raise InputError(f"states is {states}; 1 to 64, or None for the whole history, are accepted")
    return _reduced(config, period_s, name, fit_plays(config, int(states), load_max_Nm))


def _exact(config: JointConfig, period_s: float, name: str) -> Any:
    model = Observer(plain(config))
    model.step(full(Sample(0.0, 0.0, 0.0, 0.0, 0.0, 20.0), model))
    start = model.vector()

    def take_up(x: Floats) -> None:
        try:
            model.set_vector(x)
        except InputError as error:
            raise InputError(
                f"{error}; what tries states of its own (find_operating_point, linearize) needs the reduced "
                "system, to_nlsys(joint, states=16)"
            ) from None

    def sample(x: Floats, u: Floats) -> Sample:
        known = bool(np.any(x[:-1]))
        time = float(x[-1]) + period_s if known else 0.0
        return full(Sample(time, float(u[0]), float(u[1]), 0.0, 0.0, 20.0), model)

    def update(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        take_up(x)
        model.step(sample(x, u))
        return model.vector()

    def output(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        take_up(x)
        e = model.peek(sample(x, u))
        low = e.tension_l_N if e.tension_l_N == e.tension_l_N else 0.0
        return np.array([e.joint_position_rad, e.deflection_rad, e.tension_h_N, low])

    return control.nlsys(
        update,
        output,
        name=name,
        inputs=INPUTS,
        outputs=OUTPUTS + TENSIONS,
        states=len(start),
        dt=period_s,
        params={"start": start},
    )


def _reduced(config: JointConfig, period_s: float, name: str, found: Plays) -> Any:
    weights, radii, ratio = found.weights, found.radii_Nm, config.drive.ratio

    def update(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        return play(x, float(u[1]), radii)

    def output(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        load = float(u[1])
        deflection = found.rest_rad + float(weights @ [load, load * load, *play(x, load, radii)])
        return np.array([ratio * float(u[0]) + deflection, deflection])

    return control.nlsys(
        update,
        output,
        name=name,
        inputs=INPUTS,
        outputs=OUTPUTS,
        states=len(radii),
        dt=period_s,
        params={"rms_rad": found.rms_rad},
    )
