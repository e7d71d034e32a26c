"""Recordings each after another mounting: cables that are tightened anew hide no physics and are none."""

from __future__ import annotations

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed
from small_drive import course

from cablecomp.config import parse_joint
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Diagnosis
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

FACTORS = (1.0, 1.05, 0.96, 1.03)
RUBS = EffectSpec("bearing_friction", {"torque_Nm": 0.008, "presliding_rad": 1e-3})


def mounted(factor: float, seed: int, effects: list[EffectSpec]) -> dict[str, FloatArray]:
    """What the plant shows whose cables are so many times as tight."""
    stage = {**SMALL, "pretension_N": factor * SMALL["pretension_N"]}
    time, motor, load = course(30.0)
    found = simulate(PlantConfig.from_dict(closed(stage)), time, motor, load, effects=effects).channels()
    rng = np.random.default_rng(seed)
    noisy = {k: found[k] + sd * rng.standard_normal(len(time)) for k, sd in SMALL_NOISE.items()}
    return {"time_s": time, **noisy}


def said(effects: list[EffectSpec]) -> Diagnosis:
    """The diagnosis of a recording of each mounting."""
    known = {"EA_N": 0.03, "pretension_N": 0.08, "mu_output": 0.2, "mu_input": 0.2}
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": known}, "small")
    return diagnose(joint, {f"s{k}/1": mounted(f, k, effects) for k, f in enumerate(FACTORS)})


def test_physics_is_named_though_nobody_says_that_the_sessions_pretensions_differ() -> None:
    found = said([RUBS])
    assert [n.effect for n in found.named] == ["bearing_friction"]
    assert found.verdict == "explained"
    assert found.augmented.heldout_rmse_rad < 1.2 * found.noise_floor_rad


def test_how_tight_cables_are_is_no_physics() -> None:
    found = said([])
    assert not found.named
    assert found.verdict == "recalibrate"
    assert any("of a reading's noise, and errors are of such rows" in note for note in found.notes)
    assert found.baseline.heldout_rmse_rad < 1.2 * found.noise_floor_rad
    told = {v.session: v.value for v in found.calibration if v.name.startswith("pretension_N")}
    apart = np.array([told[f"s{k}"] for k in range(len(FACTORS))]) / told["s0"]
    assert apart == pytest.approx(FACTORS, rel=0.01)
