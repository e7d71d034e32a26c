"""The bench evaluation on recordings of the simulated plant, whose equations are none of cablecomp's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.errors import InputError
from cablecomp.thesis.bench.evaluate import BenchResult, bench_recording, evaluate_bench
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

JOINTS = Path(__file__).parents[2] / "configs" / "joints"


def bench(name: str, peak: float, effects: tuple[EffectSpec, ...] = (), mu: float = 1.0) -> BenchResult:
    """Load the plant (its friction times `mu`) as on the bench; evaluate with the nominal configuration."""
    data = load_joint(JOINTS / f"{name}.toml").model_dump(by_alias=True)
    data["tolerance"] = {}
    config: JointConfig = parse_joint(data, name)
    for stage in data["drive"]["stage"]:
        stage["mu_output"] *= mu
        stage["mu_input"] *= mu
    t = np.arange(0.0, 240.0, 0.5)
    load = np.interp(t, [20.0, 80.0, 120.0, 180.0], [0.0, peak, peak, 0.0])
    run = simulate(PlantConfig.from_dict(data), t, np.zeros_like(t), load, effects=effects)
    rng = np.random.default_rng(3)
    columns = run.channels()
    columns["joint_position_rad"] = columns["joint_position_rad"] + 2e-5 * rng.standard_normal(len(t))
    columns["joint_torque_Nm"] = columns["joint_torque_Nm"] + 2e-3 * rng.standard_normal(len(t))
    return evaluate_bench(bench_recording(columns, config), config)


@pytest.mark.parametrize(
    ("name", "peak"), [("snow-closed-rig", 2.4), ("snow-open-rig", 1.5), ("snow-open-rig", -0.5)]
)
def test_friction_of_the_plant_is_found(name: str, peak: float) -> None:
    result = bench(name, peak, mu=0.8)
    assert result.unloading is not None
    for branch in (result.loading, result.unloading):
        for measured in (branch.true, branch.acting):
            assert measured is not None
            # 4 sd of noise, and what the plant's own strains and spacing add (3-30: m T0/EA).
            wanted = 0.8 * result.mu_eff_nominal
            assert abs(measured.value - wanted) < 4.0 * measured.sd + 0.015 * wanted


def test_viscous_slip_makes_the_acting_coefficient_exceed_the_true_one() -> None:
    """Table 3.1: the load moves, the cable lags, the drive looks stiffer; at rest the Coulomb
    value is left.
    """
    result = bench("snow-open-rig", 1.5, (EffectSpec("viscous_slip", {"coefficient_Ns_per_m_rad": 1e5}),))
    assert result.unloading is not None
    for branch in (result.loading, result.unloading):
        assert branch.true is not None
        assert branch.acting is not None
        assert branch.true.value == pytest.approx(result.mu_eff_nominal, rel=0.01)
        assert branch.acting.value > 1.04 * branch.true.value
        assert branch.correlation is not None
        assert branch.correlation > 0.99


def test_an_unsettled_peak_widens_what_follows() -> None:
    result = bench("snow-open-rig", -0.5, (EffectSpec("viscous_slip", {"coefficient_Ns_per_m_rad": 3e5}),))
    assert any("drifts" in note for note in result.notes)
    assert result.unloading is not None
    for branch in (result.loading, result.unloading):
        assert branch.true is not None
        assert abs(branch.true.value - result.mu_eff_nominal) < 2.0 * branch.true.sd


@pytest.mark.parametrize(("turn_rad", "said"), [(0.02, False), (2.0, True)])
def test_a_motor_that_turns_meanwhile_is_said(turn_rad: float, said: bool) -> None:
    """The plant with its motor going to and fro in the hold: what it does to the wraps, no bench knows."""
    config = load_joint(JOINTS / "snow-closed-rig.toml")
    t = np.arange(0.0, 240.0, 0.5)
    load = np.interp(t, [20.0, 80.0, 120.0, 180.0], [0.0, 2.4, 2.4, 0.0])
    motor = np.interp(t, [85.0, 95.0, 105.0], [0.0, turn_rad, 0.0])
    run = simulate(PlantConfig.from_dict(config.model_dump(by_alias=True)), t, motor, load)
    result = evaluate_bench(bench_recording(run.channels(), config), config)
    notes = [note for note in result.notes if "the motor turns by" in note]
    assert len(notes) == said
    assert all(f"the motor turns by {turn_rad:.3g} rad" in note for note in notes)


def test_a_missing_channel_is_named() -> None:
    config = load_joint(JOINTS / "snow-open-rig.toml")
    with pytest.raises(InputError, match="joint_torque_Nm"):
        bench_recording({"time_s": np.zeros(3)}, config)
