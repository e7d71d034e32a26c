"""The drive with its motor held as a sum of play operators (Prandtl-Ishlinskii), fitted to the observer's loops."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from cablecomp.config import JointConfig
from cablecomp.control.stiffness import at_start, greatest_load, held
from cablecomp.observer import Observer

Floats = NDArray[np.float64]


class Plays(NamedTuple):
    """The drive with its motor held, in few states: deflection = c + a M + b M² + sum w_i z_i, z_i+ = min(max(z_i,
    M − r_i), M + r_i).

    `weights`: a [rad/Nm], b [rad/Nm²], then w_i [rad/Nm]; `radii_Nm`: r_i; `rms_rad`: error on the loops that
    it was fitted to; `most_Nm`: the greatest load of those; `rest_rad`: c, the deflection before any load (none in a
    plain drive; a weight, or a law of another channel, gives one).
    """

    weights: Floats
    radii_Nm: Floats
    rms_rad: float
    most_Nm: float
    rest_rad: float = 0.0


def fit_plays(config: JointConfig, states: int = 16, load_max_Nm: float | None = None) -> Plays:
    """Fit play operators to nested loops of the observer: w_i >= 0 and a >= 0 by least squares, r_i evenly over
    the loads up to `load_max_Nm` (None = the joint's limit, else R T0)."""
    most_Nm = greatest_load(config, load_max_Nm)
    radii = most_Nm * (np.arange(states) + 0.5) / states
    loads = _loops(most_Nm, config.drive.circuit == "closed")
    observer = Observer(at_start(config))
    rows, wanted, z = [], [], np.zeros(states)
    for k, load in enumerate(loads):
        z = play(z, load, radii)
        rows.append([load, load * load, *z])
        wanted.append(held(observer, k, float(load), most_Nm).deflection_rad)
    rest = wanted[0]  # nothing loads it yet
    A, b = np.array(rows), np.array(wanted) - rest
    size = np.maximum(np.abs(A).max(axis=0), 1e-300)
    least = np.zeros(states + 2)
    least[1] = -np.inf
    weights = (
        lsq_linear(A / size, b / np.abs(b).max(), bounds=(least, np.inf), method="bvls").x
        * np.abs(b).max()
        / size
    )
    return Plays(weights, radii, float(np.sqrt(np.mean((A @ weights - b) ** 2))), most_Nm, rest)


def play(z: Floats, load: float, radii: Floats) -> Floats:
    """Play operators after their input has moved to `load`."""
    return np.clip(z, load - radii, load + radii)


def _loops(most_Nm: float, closed: bool) -> Floats:
    """Loads of ever smaller swings: about zero in a closed circuit, above zero in an open one."""
    turns = [0.0]
    for share in (1.0, 0.75, 0.5, 0.25):
        turns += [share * most_Nm, -share * most_Nm if closed else 0.0]
    parts = [np.linspace(a, b, 60, endpoint=False) for a, b in pairwise(turns)]
    return np.concatenate([*parts, [turns[-1]]])
