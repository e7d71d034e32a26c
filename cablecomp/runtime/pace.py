"""Whether a configuration keeps its rate, measured before anything is enabled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi, sin
from time import perf_counter
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator, Gains
from cablecomp.control.options import CompensatorOptions
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.observer.refusal import SampleRefused
from cablecomp.signals import Sample

SHARE: Final = 0.8
"""Of the period, for the steps of all joints; the rest is for receiving, judging, sending and recording."""
SAMPLES: Final = 120
REPEATS: Final = 3
BUDGET_S: Final = 0.3
"""Time for one repeat of one joint; who has not come to the end of the motion by then is measured by what it did."""


class Pace(NamedTuple):
    """One joint as it is to run."""

    name: str
    config: JointConfig
    options: CompensatorOptions
    gains: Gains
    bounds: bool


Cost = Callable[[Sequence[Pace]], float]
"""Time [s] that one cycle's steps take."""


def motion(config: JointConfig, period_s: float) -> list[Sample]:
    """Both pulleys turn and the load reverses, within what the joint bears; all sources of the load agree."""
    drive = config.drive
    load_Nm = 0.4 * drive.stage[-1].pretension_moment_Nm
    turn_rad = min(0.2, 0.1 * min(min(s.wrap_input_rad, s.wrap_output_rad) for s in drive.stage))
    plain = config.model_copy(
        update={"observer": config.observer.model_copy(update={"load": "joint_torque"})}
    )
    observer = Observer(plain)
    found: list[Sample] = []
    for k in range(SAMPLES):
        phase = 2.0 * pi * k / SAMPLES
        load = load_Nm * sin(3.0 * phase) * cos(phase)
        motor_torque = config.motor_zero_Nm - drive.ratio * load
        sample = Sample(
            k * period_s, turn_rad * sin(2.0 * phase), load, 0.0, motor_torque, 20.0,
            (0.0,) * len(observer.channels),
        )  # fmt: skip
        try:
            joint = observer.step(sample).joint_position_rad
        except SampleRefused:
            break  # a joint that bears less than that is measured up to here
        found.append(sample._replace(joint_position_rad=joint))
    return found


def measured_s(paces: Sequence[Pace], period_s: float) -> float:
    """What the steps of all joints take in one cycle: 95th percentile over a motion; of each sample the quickest of
    several repeats, so that other work on the computer does not count.
    """
    total: NDArray[np.float64] = np.zeros(SAMPLES)
    for pace in paces:
        total += _one_joint(pace, period_s)
    return float(np.quantile(total, 0.95))


def _one_joint(pace: Pace, period_s: float) -> NDArray[np.float64]:
    samples = motion(pace.config, period_s)
    best = np.full(max(len(samples), 1), np.inf)
    for _ in range(REPEATS):
        observer = Observer(pace.config, bounds=pace.bounds)
        compensator = Compensator(pace.config, pace.options, period_s, observer, gains=pace.gains)
        began = perf_counter()
        for k, sample in enumerate(samples):
            begin = perf_counter()
            try:
                compensator.step(sample, Reference(sample.joint_position_rad))
            except SampleRefused:
                break
            best[k] = min(best[k], perf_counter() - begin)
            if begin - began > BUDGET_S:
                break
    done = best[np.isfinite(best)]
    return np.resize(done, SAMPLES) if len(done) else np.zeros(SAMPLES)


def check_pace(paces: Sequence[Pace], period_s: float, cost: Cost | None = None) -> None:
    """Raise InputError that says what to leave out unless the steps of all joints fit into the period.

    `cost`: what a cycle takes (None = it is measured on this computer, now).
    """
    of = (lambda p: measured_s(p, period_s)) if cost is None else cost
    takes = of(paces)
    if takes <= SHARE * period_s:
        return
    joints = paces[0].name if len(paces) == 1 else f"{len(paces)} joints"
    raise InputError(
        f"{joints}: one cycle's steps take {1e3 * takes:.3g} ms here, and {1e3 * SHARE * period_s:.3g} ms of the "
        f"{1e3 * period_s:.3g} ms of a period are for them; {_advice(paces, period_s, takes, of)}"
    )


def _advice(paces: Sequence[Pace], period_s: float, takes: float, of: Cost) -> str:
    """The least to leave out: the bounds, else the dearest effect, else both; else a lower rate."""
    bare = [pace._replace(bounds=False) for pace in paces]
    ids = list(dict.fromkeys(entry.id for pace in paces for entry in pace.config.effect))
    tried = [("the bounds (--no-bounds)", bare)] if any(pace.bounds for pace in paces) else []
    tried += [(f"the effect `{name}`", [_without(pace, name) for pace in paces]) for name in ids]
    if tried and any(pace.bounds for pace in paces):
        tried += [(f"the bounds and `{name}`", [_without(pace, name) for pace in bare]) for name in ids]
    for words, fewer in tried:
        left = of(fewer)
        if left <= SHARE * period_s:
            return f"leave out {words}: {1e3 * left:.3g} ms"
    return f"set rate_Hz to {max(int(SHARE / takes), 1)} or lower"


def _without(pace: Pace, effect: str) -> Pace:
    kept = tuple(entry for entry in pace.config.effect if entry.id != effect)
    return pace._replace(config=pace.config.model_copy(update={"effect": kept}))
