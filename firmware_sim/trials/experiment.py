"""Running a proposed experiment on a sealed joint: a further recording, and nothing else comes out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import FINE, EffectSpec, PlantConfig, PlantError, StageConfig
from firmware_sim.trials.courses import Course, draw_neighbour, draw_temperature
from firmware_sim.trials.imperfections import Imperfections
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.measures import PlainDrive
from firmware_sim.trials.protocol import sample_protocol
from firmware_sim.trials.scene import PAUSE_S
from firmware_sim.trials.seal import open_truth
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.spoil import record
from firmware_sim.trials.suspects import Scene
from firmware_sim.trials.writing import write_recording

_LONGEST_S = 1200.0


def run_experiment(sealed: Path, protocol: Path, out: Path, seed: int = 0) -> Path:
    """Play a protocol on the sealed joint of a confounded trial and write the recording that its sensors make.

    The position reference is followed by the motor as if the drive were rigid. Temperature and neighbour go
    their own way meanwhile, as they do from day to day. The clock goes on from the trial's recordings.
    Raises PlantError for a trial with nothing to settle, a protocol that is none or too long, or one that the
    joint cannot follow.
    """
    truth = open_truth(sealed)
    if not truth["partner"]:
        raise PlantError(f"{sealed}: a {truth['kind']} trial; experiments are played on confounded ones")
    rng = np.random.default_rng([seed, 11, truth["trial"]])
    joint = sealed_joint(truth)
    time, position, load = sample_protocol(protocol)
    if time[-1] > _LONGEST_S:
        raise PlantError(f"{protocol}: takes {time[-1]:.0f} s; at most {_LONGEST_S:.0f} s are accepted")
    start = float(np.ceil(truth["recordings"][-1]["ends_s"] + PAUSE_S))
    course = Course(
        "experiment",
        time + start,
        position / joint.true.ratio,
        load,
        draw_temperature(rng, time, 6.0),
        draw_neighbour(rng, time, joint.load_Nm),
    )
    effects = [EffectSpec(e["id"], _numbers(e["parameters"])) for e in truth["effects"]]
    run = run_course(Scene(joint, course, PlainDrive(**truth["plain"])), effects, FINE)
    zeros = truth["recordings"][-1]["zeros"]
    write_recording(out, record(rng, run, joint.sensors, Imperfections(), zeros, truth["other"]).channels)
    return out


def sealed_joint(truth: Mapping[str, Any]) -> DrawnJoint:
    """The joint of a truth."""

    def drive(values: Mapping[str, float]) -> PlantConfig:
        return PlantConfig("blind-joint", truth["circuit"], (StageConfig(**values),))

    return DrawnJoint(
        drive(truth["true"]),
        drive(truth["nominal"]),
        truth["tolerance"],
        truth["load_Nm"],
        truth["travel_rad"],
        truth["recordings"][0]["zeros"]["joint_position"],
        truth["sensors"],
    )


def _numbers(parameters: Mapping[str, Any]) -> dict[str, float]:
    return {k: float(v) for k, v in parameters.items() if not isinstance(v, str)}
