"""Channels that are stamped late: what was true a moment ago, between the samples of a run."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from firmware_sim.plant.records import Floats


def read_late(time_s: Floats, values: Floats, delay_s: Floats | float) -> Floats:
    """The channel at `time_s` - `delay_s` [s], on a smooth curve that rises and falls as the samples do: straight lines
    between samples would cut the corners of a motion that bends. Before the first sample that one, after the last
    that."""
    wanted = np.clip(time_s - delay_s, time_s[0], time_s[-1])
    return np.asarray(PchipInterpolator(time_s, values)(wanted))
