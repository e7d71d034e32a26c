"""A trial's folder: what a diagnosis may see, and beside it the truth."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import EFFECTS, FINE, EffectSpec
from firmware_sim.plant.records import Floats
from firmware_sim.trials.sizes import Sized, run_course
from firmware_sim.trials.suspects import Scene
from firmware_sim.trials.trial import Trial
from firmware_sim.trials.writing import (
    JOINT_FILE,
    joint_toml,
    observer_parameters,
    recording_name,
    truth_of,
    write_recording,
)

RECORDINGS, TRUTH_FILE, ANGLES_FILE = "recordings", "truth.json", "truth.npz"
_KINDS = {"parameters": "none", "nothing": "none", "unknown": "stranger"}


def write_trial(folder: Path, trial: Trial, seed: int) -> None:
    """Write recordings, configuration and truth; the folder appears whole or not at all."""
    spare = folder.with_name(folder.name + ".part")
    shutil.rmtree(spare, ignore_errors=True)
    (spare / RECORDINGS).mkdir(parents=True)
    for k, channels in enumerate(trial.recordings):
        write_recording(spare / RECORDINGS / recording_name(k), channels)
    text = joint_toml(trial.joint, trial.joint.nominal, tolerance=trial.joint.tolerance)
    (spare / JOINT_FILE).write_text(text, encoding="utf-8")
    truth = json.dumps(full_truth(trial, seed), indent=1) + "\n"
    (spare / TRUTH_FILE).write_text(truth, encoding="utf-8")
    np.savez_compressed(spare / ANGLES_FILE, **true_angles(trial))
    spare.rename(folder)


def full_truth(trial: Trial, seed: int) -> dict[str, Any]:
    """Everything that is true of a trial, as plain data."""
    old = truth_of(trial)
    keep = (
        "trial",
        "circuit",
        "excitation",
        "loop_rad",
        "noise_floor_rad",
        "true",
        "nominal",
        "tolerance",
        "sensors",
        "offset_rad",
        "load_Nm",
        "travel_rad",
        "neighbour",
    )
    return {
        "schema": 1,
        "seed": seed,
        "kind": _KINDS.get(old["kind"], old["kind"]),
        **{k: old[k] for k in keep},
        "effects": [_effect(e) for e in trial.effects],
        "imperfections": {},
        "recordings": [
            {"file": f"{RECORDINGS}/{recording_name(k)}", "session": "1", "samples": len(c.time_s)}
            for k, c in enumerate(trial.courses)
        ],
    }


def _effect(effect: Sized) -> dict[str, Any]:
    kind = EFFECTS[effect.spec.id]
    return {
        "effect": effect.spec.id,
        "form": "catalogue" if kind.listed else "stranger",
        "listed": kind.listed,
        "size": effect.size,
        "parameters": observer_parameters(effect.spec),
        "covariates": [c.replace("other:1", "other:neighbour") for c in kind.covariates],
        "nearest": [effect.spec.id] if kind.listed else [],
    }


def true_angles(trial: Trial) -> dict[str, Any]:
    """Joint angle of the true drive, of the drive without any effect, and (of several) without each; rad.

    `joint_rad_k`, `plain_rad_k`, `without_<effect>_rad_k` on the samples `time_s_k` of recording k = 1, 2, …
    """
    specs = [e.spec for e in trial.effects]
    found: dict[str, Floats] = {}
    for k, course in enumerate(trial.courses, start=1):
        scene = Scene(trial.joint, course, trial.plain)

        def angle(effects: list[EffectSpec], scene: Scene = scene) -> Floats:
            return run_course(scene, effects, FINE).joint_position_rad

        found[f"time_s_{k}"] = course.time_s
        found[f"joint_rad_{k}"] = angle(specs)
        found[f"plain_rad_{k}"] = angle([])
        if len(specs) > 1:
            for spec in specs:
                found[f"without_{spec.id}_rad_{k}"] = angle([s for s in specs if s is not spec])
    return found
