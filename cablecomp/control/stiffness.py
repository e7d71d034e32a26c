"""The drive's stiffness over its range, history included, as the observer finds it."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import EffectEntry, Empirical, JointConfig, Sensors
from cablecomp.effects.catalogue import acts_through
from cablecomp.errors import InputError
from cablecomp.observer import Observer, SampleRefused
from cablecomp.observer.refusal import REASONS
from cablecomp.signals import Estimate, Sample

Floats = NDArray[np.float64]


class StiffnessRange(NamedTuple):
    """Tangent stiffness dM/dtheta (Nm/rad) along the greatest load cycle: 0, +max, -max, +max (open circuit: 0, +max,
    0, +max).

    `zero_Nm_per_rad` before any load, `low_Nm_per_rad` and `high_Nm_per_rad` the extremes, `secant_Nm_per_rad`
    load over deflection at the peak, `width_rad` the greatest width of the loop, first touch left out; the arrays
    are the cycle itself, a fifth of it first touch.
    """

    zero_Nm_per_rad: float
    low_Nm_per_rad: float
    high_Nm_per_rad: float
    secant_Nm_per_rad: float
    width_rad: float
    load_Nm: Floats
    deflection_rad: Floats
    stiffness_Nm_per_rad: Floats

    def spread(self, count: int = 5) -> tuple[float, ...]:
        """`count` stiffnesses over the range, geometrically spaced, lowest first."""
        return tuple(float(k) for k in np.geomspace(self.low_Nm_per_rad, self.high_Nm_per_rad, count))


def greatest_load(config: JointConfig, load_max_Nm: float | None = None) -> float:
    """The load to design for: as given, else the joint's limit, else half of what slackens a cable (R T0)."""
    if load_max_Nm is not None:
        if not 0.0 < load_max_Nm < inf:
            raise InputError(f"load_max_Nm is {load_max_Nm}; a number above 0 is accepted")
        return load_max_Nm
    if config.limits.joint_torque_max_Nm is not None:
        return config.limits.joint_torque_max_Nm
    return config.drive.stage[-1].pretension_moment_Nm


def plain(config: JointConfig) -> JointConfig:
    """The same joint, loaded by a known torque, without input filter and sensors' errors: what the design looks at."""
    options = config.observer.model_copy(update={"load": "joint_torque", "input_filter_Hz": 0.0})
    return config.model_copy(update={"observer": options, "sensors": Sensors()})


def at_start(config: JointConfig) -> JointConfig:
    """`plain`, and as the joint is when it starts: without what goes by the time itself (relaxation, creep, events,
    empirical laws of time). A load cycle here takes 1000 s a step, so that all that flows or lags comes to rest."""
    effects = tuple(entry for entry in config.effect if not is_of_time(entry))
    laws = tuple(law for law in config.empirical if not is_of_time(law))
    return plain(config).model_copy(update={"effect": effects, "empirical": laws})


def is_of_time(entry: EffectEntry | Empirical) -> bool:
    """Whether an effect, or an empirical law, goes by the time above all."""
    if isinstance(entry, Empirical):
        return entry.of == "time_s"
    return acts_through(entry)[:1] == ("time",)


def stiffness_range(
    config: JointConfig, load_max_Nm: float | None = None, samples: int = 400
) -> StiffnessRange:
    """Walk the greatest load cycle with the motor held and note the tangent stiffness at every step."""
    most = greatest_load(config, load_max_Nm)
    lowest = -most if config.drive.circuit == "closed" else 0.0
    way = np.concatenate(
        [
            np.linspace(0, most, samples // 4),
            np.linspace(most, lowest, samples // 2),
            np.linspace(lowest, most, samples // 2),
        ]
    )
    observer = Observer(at_start(config))
    rows: list[tuple[float, float]] = []
    for k, load in enumerate(way):
        found = held(observer, k, float(load), most)
        rows.append((found.deflection_rad, observer.stiffness()))
    deflection, stiffness = (np.array(c) for c in zip(*rows, strict=True))
    n = samples // 4
    down, up = deflection[n : n + samples // 2][::-1], deflection[n + samples // 2 :]
    width = float(np.max(np.abs(down - up)))
    peak = float(deflection[n - 1])
    useful = stiffness[np.isfinite(stiffness) & (stiffness > 0)]
    return StiffnessRange(
        float(useful[0]),
        float(useful.min()),
        float(useful.max()),
        most / peak,
        width,
        way,
        deflection,
        stiffness,
    )


def held(observer: Observer, k: int, load_Nm: float, most_Nm: float) -> Estimate:
    """Step k of a load cycle up to `most_Nm` with the motor held; InputError if the joint cannot bear the load."""
    try:
        return observer.step(full(Sample(1e3 * k, 0.0, load_Nm, 0.0, 0.0, 20.0), observer))
    except SampleRefused as error:
        raise InputError(
            f"{load_Nm:.4g} Nm, of the +-{most_Nm:.4g} Nm that are designed for (joint_torque_max_Nm, else R T0): "
            f"{REASONS[error.reason]}"
        ) from None


def full(sample: Sample, observer: Observer) -> Sample:
    """The sample with a zero on every further channel that the observer's effects read."""
    return sample._replace(other=(0.0,) * len(observer.channels))
