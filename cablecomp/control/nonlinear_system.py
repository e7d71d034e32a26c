"""The drive as a python-control nonlinear system: exact, with its whole history as state, or reduced to a few play
operators."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import control
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from cablecomp.config import JointConfig
from cablecomp.control.stiffness import full, greatest_load, plain
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signals import Sample

Floats = NDArray[np.float64]
INPUTS = ["motor_position_rad", "joint_torque_Nm"]
OUTPUTS = ["joint_position_rad", "deflection_rad"]
TENSIONS = ["tension_h_N", "tension_l_N"]


class Plays(NamedTuple):
    """The drive with its motor held, in few states: deflection = a M + b M² + sum w_i z_i, z_i+ = min(max(z_i,
    M − r_i), M + r_i).

    `weights`: a [rad/Nm], b [rad/Nm²], then w_i [rad/Nm]; `radii_Nm`: r_i; `rms_rad`: error on the loops that
    it was fitted to; `most_Nm`: the greatest load of those.
    """

    weights: Floats
    radii_Nm: Floats
    rms_rad: float
    most_Nm: float


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
    if states is None:
        return _exact(config, period_s, name)
    if not 1 <= states <= 64:
        raise InputError(f"states is {states}; 1 to 64, or None for the whole history, are accepted")
    return _reduced(config, period_s, name, fit_plays(config, states, load_max_Nm))


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


def fit_plays(config: JointConfig, states: int = 16, load_max_Nm: float | None = None) -> Plays:
    """Fit play operators to nested loops of the observer: w_i >= 0 and a >= 0 by least squares, r_i evenly over
    the loads up to `load_max_Nm` (None = the joint's limit, else R T0)."""
    most_Nm = greatest_load(config, load_max_Nm)
    radii = most_Nm * (np.arange(states) + 0.5) / states
    loads = _loops(most_Nm, config.drive.circuit == "closed")
    observer = Observer(plain(config))
    rows, wanted, z = [], [], np.zeros(states)
    for k, load in enumerate(loads):
        z = _play(z, load, radii)
        rows.append([load, load * load, *z])
        found = observer.step(full(Sample(1e3 * k, 0.0, float(load), 0.0, 0.0, 20.0), observer))
        wanted.append(found.deflection_rad)
    A, b = np.array(rows), np.array(wanted)
    size = np.maximum(np.abs(A).max(axis=0), 1e-300)
    least = np.zeros(states + 2)
    least[1] = -np.inf
    weights = (
        lsq_linear(A / size, b / np.abs(b).max(), bounds=(least, np.inf), method="bvls").x
        * np.abs(b).max()
        / size
    )
    return Plays(weights, radii, float(np.sqrt(np.mean((A @ weights - b) ** 2))), most_Nm)


def _reduced(config: JointConfig, period_s: float, name: str, found: Plays) -> Any:
    weights, radii, ratio = found.weights, found.radii_Nm, config.drive.ratio

    def update(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        return _play(x, float(u[1]), radii)

    def output(t: float, x: Floats, u: Floats, params: Any) -> Floats:
        load = float(u[1])
        deflection = float(weights @ [load, load * load, *_play(x, load, radii)])
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


def _play(z: Floats, load: float, radii: Floats) -> Floats:
    """Play operators after their input has moved to `load`."""
    return np.clip(z, load - radii, load + radii)


def _loops(most_Nm: float, closed: bool) -> Floats:
    """Loads of ever smaller swings: about zero in a closed circuit, above zero in an open one."""
    turns = [0.0]
    for share in (1.0, 0.75, 0.5, 0.25):
        turns += [share * most_Nm, -share * most_Nm if closed else 0.0]
    parts = [np.linspace(a, b, 60, endpoint=False) for a, b in pairwise(turns)]
    return np.concatenate([*parts, [turns[-1]]])
