"""What the observer is given, cleaned of noise, and replicas of it with the noise of the sensors once more.

Friction remembers noise: a load that shakes at a turning point leaves a deflection that stays. How much of a
residual that makes, and how far it moves a fit, is found by simulating it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.identification.misfit import Prepared, groups_for, prepare
from cablecomp.signal.noise import channel_noise
from cablecomp.signal.smoothing import FloatArray, group_means, keep_corners

SIMULATED = 20_000  # steps of all recordings together
MEASURED = "joint_position_rad"  # what is predicted; all other channels are inputs


@dataclass(frozen=True)
class Noise:
    """Noise of one input in the steps of a simulation: 1-sigma of what is white, and the resolution."""

    white: float
    resolution: float

    @property
    def sigma(self) -> float:
        """1-sigma of a step's reading."""
        return float(np.hypot(self.white, self.resolution / sqrt(12.0)))


def observe(
    columns: Mapping[str, FloatArray], config: JointConfig, finest: int, each: int
) -> tuple[Prepared, dict[str, Noise]]:
    """Rows to be fitted, each the mean of `each` simulated steps of `finest` samples, and the inputs' noise.

    Samples at the end that fill no row are left out: means of unlike numbers of samples would not compare.
    Raises InputError if a channel is missing.
    """
    samples = len(columns["time_s"])
    whole = samples - samples % (finest * each) if samples > finest * each else samples
    columns = {k: np.asarray(v)[:whole] for k, v in columns.items()}
    part = prepare(columns, config, finest * each, 0.0)
    inputs = {k: group_means(np.asarray(v, dtype=np.float64), finest) for k, v in columns.items()}
    noise = {}
    for name, values in inputs.items():
        if name in ("time_s", MEASURED) or not np.all(np.isfinite(values)) or np.ptp(values) == 0.0:
            continue
        noise[name] = _noise(config, np.asarray(columns["time_s"]), columns[name], name, finest)
        inputs[name] = keep_corners(inputs["time_s"], values, noise[name].sigma)
    return replace(part, inputs=inputs, each=each), noise


def steps_for(recordings: Sequence[Mapping[str, FloatArray]], rows: int) -> tuple[int, int]:
    """Samples to a simulated step, and steps to a row, for at most about `rows` rows in all."""
    finest = groups_for(recordings, SIMULATED)
    return finest, max(1, -(-groups_for(recordings, rows) // finest))


def shaken(part: Prepared, noise: Mapping[str, Noise], rng: np.random.Generator) -> Prepared:
    """The recording as it might have been read: noise put on its cleaned inputs, and cleaned again."""
    inputs = dict(part.inputs)
    for name, n in noise.items():
        read = inputs[name] + n.white * rng.standard_normal(len(inputs[name]))
        if n.resolution > 0.0:
            read = n.resolution * np.round(read / n.resolution)
        inputs[name] = keep_corners(inputs["time_s"], read, n.sigma)
    return replace(part, inputs=inputs)


def _noise(config: JointConfig, time: FloatArray, channel: FloatArray, name: str, group: int) -> Noise:
    """As [sensors] states it, else as the channel shows it; white noise averages, a resting quantised signal
    does not."""
    quantity, _, unit = name.rpartition("_")
    white = getattr(config.sensors, f"{quantity}_noise_{unit}", None)
    step = getattr(config.sensors, f"{quantity}_resolution_{unit}", None)
    if white is None and step is None:
        found = channel_noise(time, np.asarray(channel, dtype=np.float64))
        white, step = found.white, found.resolution
    white, step = white or 0.0, step or 0.0
    if white > step / sqrt(12.0):
        return Noise(float(np.hypot(white, step / sqrt(12.0))) / sqrt(group), 0.0 if group > 1 else step)
    return Noise(white / sqrt(group), step / sqrt(min(group, 3)))
