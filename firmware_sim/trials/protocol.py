"""Reading an experiment proposed for a joint: joint position and load over time, out of a protocol file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import PlantError
from firmware_sim.plant.records import Floats


@dataclass
class _Line:
    """Sampled course under construction."""

    step_s: float
    position: list[Floats]
    load: list[Floats]
    at: tuple[float, float]

    def go(self, position: float, load: float, duration_s: float) -> None:
        """Load linearly, position with least jerk, 10 x³ − 15 x⁴ + 6 x⁵."""
        n = round(duration_s / self.step_s)
        if n < 1:
            self.at = (position, load)
            return
        x = np.arange(1, n + 1) / n
        ease = x**3 * (10.0 + x * (6.0 * x - 15.0))
        self.position.append(self.at[0] + ease * (position - self.at[0]))
        self.load.append(self.at[1] + x * (load - self.at[1]))
        self.at = (position, load)

    def travel(self, on_load: bool, value: float, rate: float, dwell_s: float) -> None:
        """To a value of load or position at a mean rate, then rest."""
        place, load = self.at
        distance = abs(value - (load if on_load else place))
        self.go(place if on_load else value, value if on_load else load, distance / rate)
        self.go(*self.at, dwell_s)


def _ramp(line: _Line, s: Mapping[str, Any]) -> None:
    line.go(s.get("position_rad", line.at[0]), s.get("load_Nm", line.at[1]), s["duration_s"])


def _hold(line: _Line, s: Mapping[str, Any]) -> None:
    line.go(*line.at, s["duration_s"])


def _sine(line: _Line, s: Mapping[str, Any]) -> None:
    low, high, length = s["from_Hz"], s["to_Hz"], s["duration_s"]
    n = round(length / line.step_s)
    x = np.arange(1, n + 1) / n
    growth = high / low
    mean = (high - low) / math.log(growth) if growth != 1.0 else low
    share = (growth**x - 1.0) / (growth - 1.0) if growth != 1.0 else x
    wave = s["amplitude"] * np.sin(2.0 * math.pi * math.ceil(mean * length) * share)
    on_load = s.get("channel", "load") == "load"
    line.position.append(np.full(n, line.at[0]) + (0.0 if on_load else wave))
    line.load.append(np.full(n, line.at[1]) + (wave if on_load else 0.0))


def _nested(line: _Line, s: Mapping[str, Any]) -> None:
    on_load = s.get("channel", "load") == "load"
    start = line.at[1] if on_load else line.at[0]
    for value in (*s["peaks"], start):
        line.travel(on_load, value, s["rate"], s.get("dwell_s", 0.0))


def _rates(line: _Line, s: Mapping[str, Any]) -> None:
    on_load = s.get("channel", "load") == "load"
    start = line.at[1] if on_load else line.at[0]
    for rate in s["rates"]:
        for value in (start + s["amplitude"], start - s["amplitude"], start):
            line.travel(on_load, value, rate, s.get("dwell_s", 0.0))


def _angles(line: _Line, s: Mapping[str, Any]) -> None:
    if "load_Nm" in s:
        line.travel(True, s["load_Nm"], s.get("load_rate_Nm_s", 1.0), 0.0)
    for value in (s["from_rad"], *((s["to_rad"], s["from_rad"]) * s.get("cycles", 1))):
        line.travel(False, value, s["speed_rad_s"], 0.0)


def _unload(line: _Line, s: Mapping[str, Any]) -> None:
    line.travel(True, 0.0, s["rate_Nm_s"], s.get("dwell_s", 0.0))


_SEGMENTS: dict[str, Callable[[_Line, Mapping[str, Any]], None]] = {
    "ramp": _ramp,
    "hold": _hold,
    "wait": _hold,
    "sine_sweep": _sine,
    "nested_reversals": _nested,
    "rate_pair": _rates,
    "angle_sweep": _angles,
    "unload": _unload,
}


def sample_protocol(path: Path, rate_Hz: float = 100.0) -> tuple[Floats, Floats, Floats]:
    """Time (s), joint position (rad) and load (N·m) that a protocol file asks for, sampled evenly.

    Raises PlantError with one line that says what is wrong with the file.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        line = _Line(
            1.0 / rate_Hz,
            [np.array([float(data.get("start_position_rad", 0.0))])],
            [np.array([float(data.get("start_load_Nm", 0.0))])],
            (float(data.get("start_position_rad", 0.0)), float(data.get("start_load_Nm", 0.0))),
        )
        for segment in data["segment"]:
            _SEGMENTS[segment["kind"]](line, segment)
    except OSError as error:
        raise PlantError(f"{path}: cannot be read ({error.strerror}); give a protocol file") from None
    except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        raise PlantError(f"{path}: is no protocol: {type(error).__name__} {error}") from None
    position, load = np.concatenate(line.position), np.concatenate(line.load)
    return np.arange(len(position)) / rate_Hz, position, load
