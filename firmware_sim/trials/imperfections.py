"""The world's imperfections: which of them a trial has, and how large; drawn before anything is simulated.

Every number that is drawn goes into the truth. `acts_as` names effects of the catalogue that an imperfection is, in
small: a diagnosis that finds one of them is not wrong.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from firmware_sim.trials.joints import log_uniform

PROBABILITIES = {
    "history": 0.8,  # the joint has been used before the first sample
    "sessions": 0.3,  # taken apart between recordings: zeros and pretension differ
    "motor_torque": 0.2,  # a further output channel
    "noise_misstated": 0.5,  # by up to a factor of 3 either way, each channel
    "coloured_noise": 0.5,
    "quantisation": 0.4,  # coarser, and stated so or not
    "outliers": 0.4,  # 0.2 % of the samples
    "gaps": 0.4,  # rows dropped, NaN in single channels
    "low_pass": 0.25,  # one channel
    "late": 0.25,  # one channel
    "uneven": 0.4,  # sampling
    "configuration": 0.6,  # radii, lengths and wraps off, and one value beyond its tolerance
    "gain": 0.4,  # of the torque sensor
    "companions": 0.3,  # one or two further effects, far smaller
}
"""With which each is drawn where `some` are asked for; `all` has every one that applies."""

CHANNELS = ("joint_position", "motor_position", "joint_torque")
LONGEST_LAG_S = 0.05
ACTS_AS = {"late": ("clock_skew",), "low_pass": ("clock_skew",)}


@dataclass(frozen=True)
class Imperfections:
    """What is imperfect in a trial: each by its name, with the numbers drawn for it."""

    drawn: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __contains__(self, name: str) -> bool:
        return name in self.drawn

    def __getitem__(self, name: str) -> dict[str, Any]:
        return self.drawn[name]

    def having(self, name: str, numbers: dict[str, Any]) -> Imperfections:
        """These and another one."""
        return Imperfections({**self.drawn, name: numbers})

    def truth(self) -> dict[str, Any]:
        """As the truth states them."""
        return {k: {**v, "acts_as": list(ACTS_AS.get(k, ()))} for k, v in self.drawn.items()}


def settled(how: Imperfections, rates: Mapping[str, float], floor_rad: float) -> Imperfections:
    """With the lags of late and filtered channels found: so long that each makes its share of the noise floor in the
    joint angle. `rates` holds the RMS speed (rad/s, in the joint angle) with which each channel moves."""
    found = dict(how.drawn)
    for name in ("low_pass", "late"):
        if name in found:
            numbers = found[name]
            lag = numbers["size_of_floor"] * floor_rad / max(rates[numbers["channel"]], 1e-12)
            found[name] = {**numbers, "lag_s": min(lag, LONGEST_LAG_S)}
    return Imperfections(found)


def draw_imperfections(rng: np.random.Generator, amount: str, kind: str) -> Imperfections:
    """Draw which imperfections a trial of this kind has (`amount`: none, some, all or vague) and their numbers.

    The same numbers are drawn whatever is taken, so that trials with and without differ by nothing else.
    """
    found = {}
    for name, probability in PROBABILITIES.items():
        chosen = bool(rng.uniform() < probability)
        numbers = _NUMBERS[name](rng)
        if name == "companions" and kind not in ("single", "stranger", "motor"):
            continue
        if amount in ("all", "vague") or (amount == "some" and chosen):
            found[name] = numbers
    if amount == "vague":
        (aside,) = rng.spawn(1)
        found["vague"] = _vague(aside)
    return Imperfections(found)


def drawn_numbers(rng: np.random.Generator, name: str) -> dict[str, Any]:
    """Numbers of one imperfection, drawn anew."""
    return _NUMBERS[name](rng)


def _history(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "lasts_s": float(rng.uniform(6.0, 20.0)),
        "course": str(rng.choice(["bench", "moving", "reaching"])),
    }


def _sessions(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "pretension_factor": [float(x) for x in np.exp(rng.normal(0.0, 0.03, 3))],
        "joint_zero_rad": [float(x) for x in rng.normal(0.0, 2e-3, 3)],
        "torque_zero_of_load": [float(x) for x in rng.normal(0.0, 4e-3, 3)],
        "declared": bool(rng.uniform() < 0.5),
    }


def _motor_torque(rng: np.random.Generator) -> dict[str, Any]:
    return {"noise_of_range": log_uniform(rng, 0.002, 0.01)}


def _misstated(rng: np.random.Generator) -> dict[str, Any]:
    return {c: float(math.exp(rng.uniform(-math.log(3.0), math.log(3.0)))) for c in CHANNELS}


def _coloured(rng: np.random.Generator) -> dict[str, Any]:
    return {"share": float(rng.uniform(0.3, 0.8)), "time_s": log_uniform(rng, 0.02, 0.4)}


def _quantisation(rng: np.random.Generator) -> dict[str, Any]:
    which = [c for c in CHANNELS if rng.uniform() < 0.5] or ["joint_position"]
    return {"channels": which, "factor": log_uniform(rng, 2.0, 6.0), "stated": bool(rng.uniform() < 0.5)}


def _outliers(rng: np.random.Generator) -> dict[str, Any]:
    which = [c for c in CHANNELS if rng.uniform() < 0.6] or ["joint_position"]
    return {"channels": which, "share": 0.002, "sigmas": log_uniform(rng, 10.0, 100.0)}


def _gaps(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "bursts": int(rng.integers(1, 6)),
        "longest": int(rng.integers(10, 80)),
        "single_share": float(rng.uniform(0.0, 0.004)),
        "nan_stretches": int(rng.integers(0, 4)),
        "nan_channel": str(rng.choice(CHANNELS)),
    }


def _low_pass(rng: np.random.Generator) -> dict[str, Any]:
    return {"channel": str(rng.choice(CHANNELS)), "size_of_floor": float(rng.uniform(0.3, 1.0))}


def _late(rng: np.random.Generator) -> dict[str, Any]:
    return {"channel": str(rng.choice(CHANNELS)), "size_of_floor": float(rng.uniform(0.2, 0.8))}


def _uneven(rng: np.random.Generator) -> dict[str, Any]:
    return {"jitter": float(rng.uniform(0.1, 0.4))}


def _configuration(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "output_radius_m": float(rng.normal(0.0, 1e-3)),
        "input_radius_m": float(rng.normal(0.0, 1e-3)),
        "free_length_m": float(rng.normal(0.0, 0.015)),
        "wrap_output_rad": float(rng.normal(0.0, 0.2)),
        "wrap_input_rad": float(rng.normal(0.0, 0.2)),
        "beyond_tolerance": str(rng.choice(["EA_N", "pretension_N", "mu_output", "mu_input"])),
        "sigmas": float(rng.uniform(2.0, 3.5) * rng.choice((-1.0, 1.0))),
    }


def _vague(rng: np.random.Generator) -> dict[str, Any]:
    """By what the drive is stated off, each in ln: what one would guess of a machine that one has not built."""
    decades = {"EA_N": 0.4, "pretension_N": 0.25, "mu_output": 0.3, "mu_input": 0.3}
    guessed = {key: float(math.log(10.0) * rng.uniform(-d, d)) for key, d in decades.items()}
    return {**guessed, "input_radius_m": float(rng.normal(0.0, 0.01))}


def _gain(rng: np.random.Generator) -> dict[str, Any]:
    return {"joint_torque_gain": float(math.exp(rng.normal(0.0, 0.01)))}


def _companions(rng: np.random.Generator) -> dict[str, Any]:
    return {"sizes": [log_uniform(rng, 0.005, 0.025) for _ in range(int(rng.integers(1, 3)))]}


_NUMBERS = {
    "history": _history,
    "sessions": _sessions,
    "motor_torque": _motor_torque,
    "noise_misstated": _misstated,
    "coloured_noise": _coloured,
    "quantisation": _quantisation,
    "outliers": _outliers,
    "gaps": _gaps,
    "low_pass": _low_pass,
    "late": _late,
    "uneven": _uneven,
    "configuration": _configuration,
    "gain": _gain,
    "companions": _companions,
}
