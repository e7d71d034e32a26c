"""What the replay page shows, gathered while the recording streams past: bounded, whatever its length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.recording.replay import Replayed
from cablecomp.recording.streams import Bins, Density, Histogram, Moments, Spectrum
from cablecomp.recording.table import FloatArray
from cablecomp.recording.thinning import RowThinner

_CHANNELS: Final = (
    "time_s",
    "load_Nm",
    "deflection_measured_rad",
    "deflection_rad",
    "deflection_low_rad",
    "deflection_high_rad",
    "residual_rad",
    "motor_position_rad",
    "joint_position_rad",
    "tension_h_N",
    "tension_l_N",
    "tension_h_measured_N",
    "tension_l_measured_N",
)
_KEYS: Final = ("load_Nm", "deflection_measured_rad", "deflection_rad", "residual_rad")
_UNEVEN: Final = 0.02


@dataclass(frozen=True)
class Display:
    """`rows`: chosen rows of every channel (all NaN where absent); histogram and spectra are of all rows.

    Spectra are None where there is no measured joint position, not in every row, or the sampling is uneven.
    """

    rows: dict[str, FloatArray]
    histogram: Bins | None
    residual_density: Density | None
    deflection_density: Density | None

    def has(self, channel: str) -> bool:
        """Whether a channel holds any number."""
        return not bool(np.isnan(self.rows[channel]).all())


class DisplaySink:
    """Sink that gathers a `Display`."""

    def __init__(self) -> None:
        self._rows = RowThinner(_CHANNELS, _KEYS, buckets=350)
        self._histogram = Histogram()
        self._residual, self._deflection = Spectrum(), Spectrum()
        self._steps = Moments()
        self._complete = True
        self._last_time: float | None = None

    def take(self, replayed: Replayed) -> None:
        """Take in one replayed block."""
        measured, predicted = replayed.block.columns, replayed.predicted
        times = measured["time_s"]
        absent = np.full(len(times), np.nan)
        found = {
            **predicted,
            "time_s": times,
            "load_Nm": replayed.load_Nm,
            "deflection_measured_rad": replayed.deflection_measured_rad,
            "residual_rad": replayed.residual_rad,
            "motor_position_rad": measured.get("motor_position_rad"),
            "joint_position_rad": measured.get("joint_position_rad"),
            "tension_h_measured_N": measured.get("tension_h_N"),
            "tension_l_measured_N": measured.get("tension_l_N"),
        }
        self._rows.add({name: absent if (v := found.get(name)) is None else v for name in _CHANNELS})
        self._steps.add(
            np.diff(times) if self._last_time is None else np.diff(times, prepend=self._last_time)
        )
        self._last_time = float(times[-1])
        if replayed.residual_rad is not None and replayed.deflection_measured_rad is not None:
            told = np.isfinite(replayed.residual_rad)
            self._complete &= bool(told.all())
            self._histogram.add(replayed.residual_rad[told])
            if self._complete:
                self._residual.add(replayed.residual_rad)
                self._deflection.add(replayed.deflection_measured_rad)

    def display(self) -> Display:
        """Return what was gathered."""
        bins = self._histogram.bins()
        compared = bool(bins.counts.sum() > 0)
        step = self._steps.mean if self._steps.count else 0.0
        even = self._complete and step > 0.0 and self._steps.sd < _UNEVEN * step
        return Display(
            self._rows.rows(),
            bins if compared else None,
            self._residual.density(step) if compared and even else None,
            self._deflection.density(step) if compared and even else None,
        )
