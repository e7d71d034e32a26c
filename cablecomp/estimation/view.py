"""A recording's rows as a check before belief looks at them, beside what the linear nominal drive makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.control.stiffness import plain, stiffness_range
from cablecomp.errors import CablecompError
from cablecomp.estimation.evidence import INPUT, JOINT
from cablecomp.estimation.simulate import load_of
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Suspicion:
    """`kind`: sign, ratio, unit, scale, delay, gap, stuck, wrapped, clipped, unread or made up; `channel`: which one is
    meant first; `text`: one line with the numbers; `numbers`: those."""

    kind: str
    channel: str
    text: str
    numbers: Mapping[str, float]


class View:
    """One recording's rows: time [s], motor angle q and joint angle y [rad], load M [N m] read from `channel`."""

    def __init__(self, config: JointConfig, rows: Mapping[str, FloatArray], channel: str | None) -> None:
        self.config, self.rows, self.channel = config, rows, channel
        self.ratio = config.drive.ratio
        self.time, self.q, self.y = rows["time_s"], rows[INPUT], rows[JOINT]
        self.M = np.zeros(len(self.q)) + (0.0 if channel is None else load_of(config, rows))
        self.compliance = _compliance(config)
        self.slope, self.sure = partial(self.y, self.q, self.M)

    def left(self, turn: float = 1.0, ratio: float | None = None, scale: float = 1.0) -> float:
        """RMS that the linear nominal drive leaves of the joint angle, zero taken off."""
        r = self.ratio if ratio is None else ratio
        return rms(self.y - r * self.q - turn * scale * self.compliance * self.M)

    def shifted(self, delay: Suspicion) -> View:
        """The rows with that channel brought in time."""
        moved = np.interp(self.time + delay.numbers["late_s"], self.time, self.rows[delay.channel])
        return View(self.config, {**self.rows, delay.channel: moved}, self.channel)


def bare(config: JointConfig) -> JointConfig:
    """The drive alone, loaded by a known torque."""
    return plain(config).model_copy(update={"effect": (), "empirical": ()})


def partial(y: FloatArray, x: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Slope of y on x, `other` held, and their partial correlation; zero where x does not move."""
    A = np.column_stack((np.ones_like(x), other - other.mean()))
    left = [v - A @ np.linalg.lstsq(A, v, rcond=None)[0] for v in (y, x)]
    yy, xx, xy = float(left[0] @ left[0]), float(left[1] @ left[1]), float(left[0] @ left[1])
    if xx <= 1e-12 * float(x @ x) or yy <= 0.0:
        return 0.0, 0.0
    return xy / xx, xy / float(np.sqrt(xx * yy))


def rms(values: FloatArray) -> float:
    """RMS about the mean."""
    return float(np.std(values))


def mrad(value: float) -> str:
    """An angle [rad] in words."""
    return f"{1e3 * value:.3g} mrad"


def _compliance(config: JointConfig) -> float:
    """Deflection per load of the nominal drive at its greatest load [rad/Nm]."""
    try:
        return 1.0 / stiffness_range(bare(config)).secant_Nm_per_rad
    except CablecompError:  # effects that the walk cannot take: the cable alone
        last = config.drive.stage[-1]
        wrapped = last.free_length_m / (last.EA_N * last.output_radius_m**2)
        return wrapped * (0.5 if config.drive.circuit == "closed" else 1.0)
