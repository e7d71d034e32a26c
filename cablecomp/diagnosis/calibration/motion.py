"""Which motion would tell a parameter that recordings did not: its expected 1-sigma under motions within the limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.control.protocol import Protocol, Segment
from cablecomp.control.standard import calibration_protocol, loops_at_rest, turning_under_load
from cablecomp.diagnosis.calibration.every_sample import trusted
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit, covariance
from cablecomp.estimation.parameter import Parameter, of_drive
from cablecomp.estimation.problem import Problem, Weighing

RATE_HZ = 50.0
"""Samples of a motion that is only thought of."""
WORTH = 0.7
"""A motion is worth proposing where it brings the sd down to this share of the prior's."""


@dataclass(frozen=True)
class Advice:
    """A motion, in words; `sd`: the parameter's expected 1-sigma afterwards (relative where its prior is)."""

    motion: str
    sd: float


def what_would_tell(config: JointConfig, parameter: Parameter, noise_rad: float) -> Advice | None:
    """The motion within the joint's limits that tells most of a parameter; None where none tells anything."""
    best: Advice | None = None
    for words, segments in _motions(config):
        sd = _expected(config, parameter.base, segments, noise_rad)
        if sd is not None and sd < WORTH * parameter.sd and (best is None or sd < 0.7 * best.sd):
            best = Advice(words, sd)
    return best


def _motions(config: JointConfig) -> tuple[tuple[str, tuple[Segment, ...]], ...]:
    """Simplest first."""
    return (
        ("load loops within loops, the motor at rest", loops_at_rest(config)),
        ("turning through the range under a load that is held", turning_under_load(config)),
        ("`cablecomp run --protocol calibrate`", calibration_protocol(config).segment),
    )


def _expected(
    config: JointConfig, name: str, segments: tuple[Segment, ...], noise_rad: float
) -> float | None:
    protocol = Protocol(name="motion", segment=segments)
    time = np.arange(0.0, protocol.duration_s, 1.0 / RATE_HZ)
    asked = [protocol.reference(float(t)) for t in time]
    columns = {
        "time_s": time,
        "motor_position_rad": np.array([a.joint_position_rad for a in asked]) / config.drive.ratio,
        "joint_torque_Nm": np.array([a.joint_torque_Nm for a in asked]),
        JOINT: np.zeros(len(time)),
    }
    plain = config.model_copy(
        update={"observer": config.observer.model_copy(update={"load": "joint_torque"}), "effect": ()}
    )
    rows = np.arange(len(time))
    e = Evidence(
        "motion",
        "all",
        {},
        columns,
        rows,
        {JOINT: np.ones(len(rows), dtype=np.bool_)},
        np.ones(len(rows)),
        samples=len(rows),
    )
    try:
        problem = Problem(plain, of_drive(plain), (e,), Weighing({JOINT: noise_rad}, {JOINT: 0.0}))
        seen = {**columns, JOINT: -problem.misfits(problem.start)[JOINT][0]}
        problem = problem.with_evidence([Evidence("motion", "all", {}, seen, rows, e.counted, e.weight)])
        sigma = float(np.hypot(noise_rad, trusted(problem)[JOINT]))
        problem = problem.with_weighing(Weighing({JOINT: sigma}, {JOINT: 0.0}))
        x = problem.start
        fit = Fit(problem, x, problem.residual(x), problem.jacobian(x))
    except InputError:
        return None
    place = next((k for k, p in enumerate(problem.parameters) if p.name == name), None)
    return None if place is None else float(np.sqrt(covariance(fit)[place, place]))
