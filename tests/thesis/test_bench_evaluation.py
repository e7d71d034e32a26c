"""The thesis's bench evaluation recovers the friction that made a recording, within what it states."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from cablecomp.cli import main
from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.errors import InputError
from cablecomp.thesis.bench.evaluate import BenchRecording, evaluate_bench
from cablecomp.thesis.bench.segments import segments_of
from cablecomp.thesis.bench.vectors import DriveOnBench
from cablecomp.thesis.closed_forms.stage import equivalent_of
from cablecomp.thesis.geometry import sensor_deflection_rad

JOINTS = Path(__file__).parents[2] / "configs" / "joints"
RATE = 11.0  # the thesis's logger, Hz


def joint(name: str, **tolerance: float) -> JointConfig:
    data = load_joint(JOINTS / f"{name}.toml").model_dump(by_alias=True)
    data["tolerance"] = tolerance
    return parse_joint(data, name)


def protocol(
    levels: list[float], ramp_s: float = 60.0, hold_s: float = 30.0
) -> tuple[np.ndarray, np.ndarray]:
    """Hold at zero, then ramp to each level in turn and hold there."""
    knots_t, knots_m = [0.0, hold_s], [0.0, 0.0]
    for level in levels:
        knots_t += [knots_t[-1] + ramp_s, knots_t[-1] + ramp_s + hold_s]
        knots_m += [level, level]
    t = np.arange(0.0, knots_t[-1], 1.0 / RATE)
    return t, np.interp(t, knots_t, knots_m)


def record(
    config: JointConfig,
    scale: float,
    levels: list[float],
    *,
    noise: float = 1.0,
    seed: int = 0,
    sensor: float = math.inf,
    creep_s: float = 0.0,
) -> BenchRecording:
    """A recording made from the closed forms with friction `scale` times nominal."""
    rng = np.random.default_rng(seed)
    t, load = protocol(levels)
    bench = DriveOnBench(config.drive)
    peak = max(levels, key=abs)
    turn = int(np.argmax(np.abs(load)))
    theta = np.concatenate([bench.deflection(load[:turn], scale), bench.deflection(load[turn:], scale, peak)])
    if creep_s > 0.0:  # deflection follows late: a one-pole lag
        follow, step = theta.copy(), 1.0 / RATE / creep_s
        for i in range(1, len(follow)):
            follow[i] = follow[i - 1] + step * (theta[i] - follow[i - 1])
        theta = follow
    theta = theta + sensor_deflection_rad(load, config.drive.ratio, sensor)
    theta = theta + noise * 3e-5 * rng.standard_normal(len(t)) + 0.37e-3  # encoder's zero is anywhere
    theta = np.round(theta / 6.283e-5) * 6.283e-5 if noise else theta
    reading = load + noise * 4e-3 * rng.standard_normal(len(t))
    return BenchRecording(t, reading, theta)


CASES = [
    ("snow-closed-rig", [2.6, 0.0]),
    ("snow-closed-rig", [-2.6, 0.0]),
    ("snow-open-rig", [1.8, 0.0]),
    ("snow-open-rig", [-0.6, 0.0]),
    ("snow-open-rig", [0.6, 1.2, 1.8, 0.9, 0.0]),
    ("two-stage-series", [8.0, 0.0]),
    ("two-stage-parallel", [6.0, 0.0]),
]


@pytest.mark.parametrize(("name", "levels"), CASES)
@pytest.mark.parametrize("scale", [0.6, 1.5])
def test_without_noise_the_friction_comes_back_exactly(name: str, levels: list[float], scale: float) -> None:
    config = joint(name)
    result = evaluate_bench(record(config, scale, levels, noise=0.0), config)
    assert result.unloading is not None
    for branch in (result.loading, result.unloading):
        assert branch.true is not None
        assert branch.acting is not None
        assert branch.true.value == pytest.approx(scale * result.mu_eff_nominal, rel=2e-3)
        assert branch.acting.value == pytest.approx(scale * result.mu_eff_nominal, rel=2e-3)
        assert branch.correlation == pytest.approx(1.0, abs=1e-5)
    assert result.pulleys[0].mu_output.value == pytest.approx(
        scale * config.drive.stage[0].mu_output, rel=2e-3
    )
    assert result.peak_Nm == pytest.approx(max(levels, key=abs), rel=1e-6)


@pytest.mark.parametrize(("name", "levels"), CASES[:5])
def test_with_noise_the_truth_lies_within_the_stated_uncertainty(name: str, levels: list[float]) -> None:
    config = joint(name)
    misses, pulls = 0, []
    for seed in range(6):
        result = evaluate_bench(record(config, 0.8, levels, seed=seed), config)
        assert result.unloading is not None
        for branch in (result.loading, result.unloading):
            assert branch.correlation is not None
            assert branch.correlation > 0.99
            for measured in (branch.true, branch.acting):
                assert measured is not None
                pull = (measured.value - 0.8 * result.mu_eff_nominal) / measured.sd
                pulls.append(pull)
                misses += abs(pull) > 3.5
    assert misses == 0
    assert np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_tolerances_of_the_configuration_widen_the_result() -> None:
    """mu goes as T0/EA: their tolerances add in quadrature (open circuit, wrap deflection well above the
    span's).
    """
    levels = [1.8, 0.0]
    sharp, plain = joint("snow-open-rig"), joint("snow-open-rig", EA_N=0.04, pretension_N=0.03)
    recording = record(sharp, 1.0, levels)
    wide, narrow = evaluate_bench(recording, plain), evaluate_bench(recording, sharp)
    assert wide.loading.acting is not None
    assert narrow.loading.acting is not None
    added = math.sqrt(wide.loading.acting.sd**2 - narrow.loading.acting.sd**2) / wide.loading.acting.value
    stage = equivalent_of(plain.drive.stage[0])
    # Both EA and the span shift the wrap's share of the deflection; the span's is GF m of GF m + (m - ln(1 +
    # m)).
    assert 0.04 < added < 0.05 * (1.0 + 3.0 * stage.GF) + 0.02


def test_sensor_twist_is_taken_out() -> None:
    config, stiffness = joint("snow-closed-rig"), 1205 * 0.1129848
    recording = record(config, 1.0, [2.6, 0.0], noise=0.0, sensor=stiffness)
    removed = evaluate_bench(recording, config, sensor_stiffness_Nm_per_rad=stiffness)
    left_in = evaluate_bench(recording, config)
    assert removed.mu_eff.value == pytest.approx(0.07, rel=2e-3)
    assert left_in.loading.acting is not None
    assert left_in.loading.acting.value < 0.05
    data = config.model_dump(by_alias=True)
    data["effect"] = ({"id": "series_compliance", "compliance_rad_per_Nm": 1.0 / stiffness},)
    by_effect = evaluate_bench(recording, parse_joint(data, "x"))
    assert by_effect.mu_eff.value == pytest.approx(removed.mu_eff.value, rel=1e-9)


def test_creep_shows_as_acting_above_true_and_as_unsettled() -> None:
    """A deflection that lags makes the drive look stiffer while the load moves: acting above true, as in
    Table 3.1.
    """
    config = joint("snow-open-rig")
    slow = evaluate_bench(record(config, 1.0, [1.8, 0.0], noise=0.3, creep_s=3.0), config)
    for branch in (slow.loading, slow.unloading):
        assert branch is not None
        assert branch.true is not None
        assert branch.true.value == pytest.approx(slow.mu_eff_nominal, rel=0.02)
    assert slow.loading.acting is not None
    assert slow.loading.true is not None
    assert slow.loading.acting.value > slow.loading.true.value
    very = evaluate_bench(record(config, 1.0, [1.8, 0.0], noise=0.3, creep_s=25.0), config)
    assert any("drifts" in note for note in very.notes)


def test_narrow_tensions_of_the_thesis_agree_where_GF_is_small() -> None:
    config = joint("snow-closed-rig")
    recording = record(config, 1.0, [2.6, 0.0], noise=0.0)
    exact, thesis = evaluate_bench(recording, config), evaluate_bench(recording, config, narrow_tensions=True)
    assert thesis.mu_eff.value == pytest.approx(exact.mu_eff.value, rel=0.02)
    assert thesis.loading.correlation == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("noise", [0.0, 4e-3, 0.05])
def test_ramps_and_holds_are_found_under_noise(noise: float) -> None:
    t, load = protocol([1.0, 2.0, 1.2, 0.0])
    rng = np.random.default_rng(5)
    segments, smoothed = segments_of(t, load + noise * rng.standard_normal(len(t)))
    assert [s.direction for s in segments] == [0, 1, 0, 1, 0, -1, 0, -1, 0]
    edges = np.array([t[s.start] for s in segments[1:]])
    wanted = 30.0 + np.array([0, 60, 90, 150, 180, 240, 270, 330])
    assert np.max(np.abs(edges - wanted)) <= 0.6 * smoothed.window / RATE + 0.2
    assert segments[-1].stop == len(t)


def test_later_cycles_are_left_out_and_said_so() -> None:
    config = joint("snow-closed-rig")
    once = record(config, 1.0, [2.6, 0.0], noise=0.0)
    t = np.concatenate([once.time_s, once.time_s[-1] + 1.0 / RATE + once.time_s])
    twice = BenchRecording(
        t, np.tile(once.load_Nm, 2), np.concatenate([once.deflection_rad, once.deflection_rad * 1.1])
    )
    result = evaluate_bench(twice, config)
    assert result.mu_eff.value == pytest.approx(0.07, rel=3e-3)
    assert any("left out" in note for note in result.notes)


def test_a_recording_without_holds_gives_acting_values_only() -> None:
    config = joint("snow-closed-rig")
    full = record(config, 1.0, [2.6, 0.0], noise=0.0)
    keep = np.concatenate([[True], np.abs(np.diff(full.load_Nm)) > 1e-9])
    bare = BenchRecording(np.arange(keep.sum()) / RATE, full.load_Nm[keep], full.deflection_rad[keep])
    result = evaluate_bench(bare, config)
    assert result.loading.true is None
    assert result.loading.acting is not None
    assert result.loading.acting.value == pytest.approx(0.07, rel=0.01)
    assert any("no hold" in note for note in result.notes)


def test_a_recording_that_is_no_bench_s_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "a.csv"
    for head, says in (
        (
            "time_s,motor_position_rad,joint_position_rad,joint_torque_Nm",
            "bench recording has 1 sample; 30 or",
        ),
        ("time_s,motor_position_rad,joint_position_rad,other_x", "recording has no channel joint_torque_Nm"),
    ):
        log.write_text(f"{head}\n0,0,0,0\n")
        assert main(["identify", str(log), "--config", "snow-closed-rig"]) == 2
        assert capsys.readouterr().err.startswith(f"cablecomp: {log}: {says}")


def test_bad_recordings_are_refused_in_one_line() -> None:
    config, open_config = joint("snow-closed-rig"), joint("snow-open-rig")
    good = record(config, 1.0, [2.6, 0.0])
    t, load, theta = good.time_s, good.load_Nm, good.deflection_rad
    with pytest.raises(InputError, match="does not rise"):
        BenchRecording(t[::-1].copy(), load, theta)
    with pytest.raises(InputError, match="not finite at sample 7"):
        BenchRecording(t, load, np.where(np.arange(len(t)) == 7, np.nan, theta))
    with pytest.raises(InputError, match="equal numbers"):
        BenchRecording(t[:-1], load, theta)
    with pytest.raises(InputError, match="noise"):
        evaluate_bench(BenchRecording(t, load - load + 1e-3 * np.sin(40 * t), theta), config)
    with pytest.raises(InputError, match="falls where"):
        evaluate_bench(BenchRecording(t, load, -theta), config)
    with pytest.raises(InputError, match="starts at zero load"):
        evaluate_bench(BenchRecording(t, load + 1.0, theta), config)
    with pytest.raises(InputError, match="slack"):
        evaluate_bench(BenchRecording(t, -load, -theta), open_config)
    with pytest.raises(InputError, match="above 0"):
        evaluate_bench(good, config, sensor_stiffness_Nm_per_rad=0.0)
