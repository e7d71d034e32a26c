"""The design sheet against the thesis's rules and against the closed forms it is made of."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.errors import InputError
from cablecomp.thesis import geometry
from cablecomp.thesis.closed_forms.stage import equivalent_of
from cablecomp.thesis.design import design_sheet

JOINTS = sorted((Path(__file__).parents[2] / "configs" / "joints").glob("*.toml"))
CLOSED = "capstan-arm"


def joint(name: str) -> JointConfig:
    return load_joint(next(path for path in JOINTS if path.stem == name))


def changed(config: JointConfig, **stage: float) -> JointConfig:
    data = config.model_dump(by_alias=True)
    data["drive"]["stage"] = tuple({**part, **stage} for part in data["drive"]["stage"])
    return parse_joint(data, "changed")


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_every_shipped_joint_is_a_sound_design(path: Path) -> None:
    config = load_joint(path)
    assert config.name == path.stem
    assert {"EA_N", "pretension_N", "mu_output", "mu_input"} <= set(config.tolerance)
    sheet = design_sheet(config)
    assert sheet.load_max_Nm == config.limits.joint_torque_max_Nm
    assert [note for note in sheet.notes if "ease" not in note] == []
    assert 0.0 < sheet.loaded_stiffness_Nm_per_rad < sheet.zero_load_stiffness_Nm_per_rad
    assert 0.0 < sheet.hysteresis_rad < sheet.deflection_rad
    assert 0.96 < sheet.efficiency <= sheet.efficiency_limit + 1e-4 < 1.0
    for stage in sheet.stages:
        assert stage.breaking_margin is not None
        assert stage.breaking_margin > 1.6
        assert all(use.used < 1.0 for use in stage.wraps)


def test_snow_rigs_reproduce_the_thesis_numbers() -> None:
    rig, open_rig = joint("snow-closed-rig"), joint("snow-open-rig")
    assert design_sheet(rig).mu_eff == pytest.approx(0.070, abs=1e-3)
    assert design_sheet(open_rig).mu_eff == pytest.approx(0.045, abs=1e-3)
    peak = 1.3 * 7.54 * 4.448222 * 2.438 * 0.0254
    sheet = design_sheet(rig, peak)
    # Trial 19 (Fig. 4.16): about 6 mrad at m = 1.3
    assert sheet.deflection_rad == pytest.approx(6e-3, rel=0.15)
    assert sheet.zero_load_tension_N / sheet.stages[0].pretension_N == pytest.approx(1.036, abs=1e-3)
    # Trial 145 (Fig. 3.6, 3.7): wrap deflection of about 32 mrad at m = 2.1
    stage = equivalent_of(open_rig.drive.stage[0])
    span = stage.GF * stage.angle_scale_rad * 1.85 / stage.moment_scale_Nm
    assert design_sheet(open_rig).deflection_rad - span == pytest.approx(0.032, rel=0.05)


def test_zero_load_stiffness_is_the_free_spans_alone() -> None:  # 2 EA R^2/L (4-47)
    stage = joint(CLOSED).drive.stage[0]
    wanted = 2.0 * stage.EA_N * stage.output_radius_m**2 / stage.free_length_m
    assert design_sheet(joint(CLOSED)).zero_load_stiffness_Nm_per_rad == pytest.approx(wanted, rel=1e-12)
    tiny = design_sheet(joint(CLOSED), 1e-6)
    assert tiny.loaded_stiffness_Nm_per_rad == pytest.approx(wanted, rel=1e-4)


def test_more_pretension_is_stiffer_and_leaves_less_hysteresis() -> None:
    sheets = [design_sheet(changed(joint(CLOSED), pretension_N=T0)) for T0 in (120.0, 180.0, 300.0)]
    assert sorted(sheets, key=lambda s: s.loaded_stiffness_Nm_per_rad) == sheets
    assert sorted(sheets, key=lambda s: -s.hysteresis_rad) == sheets


def test_pretension_limits_are_where_slack_and_slip_begin() -> None:
    config = changed(joint(CLOSED), wrap_output_rad=2.0, wrap_input_rad=3.0)
    first = design_sheet(config)
    at = design_sheet(changed(config, pretension_N=first.pretension.no_slack_N))
    assert at.slack_moment_Nm == pytest.approx(at.load_max_Nm, rel=1e-9)
    at = design_sheet(changed(config, pretension_N=first.pretension.no_slip_N))
    assert at.slip_moment_Nm == pytest.approx(at.load_max_Nm, rel=1e-9)
    assert first.pretension.rule_wide_N == pytest.approx(2.0 * first.pretension.rule_narrow_N)
    weak = design_sheet(changed(config, pretension_N=0.9 * first.pretension.no_slack_N))
    assert any("slack" in note for note in weak.notes)
    low = design_sheet(changed(config, pretension_N=0.9 * first.pretension.no_slip_N))
    assert any("slips" in note for note in low.notes)


def test_travel_uses_up_wrap() -> None:
    config = joint(CLOSED)
    out, inn = design_sheet(config).stages[0].wraps
    assert out.available_least_rad == pytest.approx(5.0 - 1.6)
    assert inn.available_least_rad == pytest.approx(20.0 - 1.6 / (0.012 / 0.09))
    short = design_sheet(changed(config, wrap_input_rad=11.0))
    assert any("unwound" in note for note in short.notes)


def test_series_and_parallel_stages_carry_their_share() -> None:
    series, parallel = design_sheet(joint("two-stage-series")), design_sheet(joint("two-stage-parallel"))
    assert series.equivalent is None
    assert [s.moment_Nm for s in series.stages] == pytest.approx([0.2 * 9.0, 9.0])
    assert parallel.equivalent is not None
    ratio = [s.tension_greatest_N / s.pretension_N for s in parallel.stages]
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-12)
    config = joint("two-stage-parallel")
    data = config.model_dump(by_alias=True)
    data["drive"]["stage"][0]["pretension_N"] = 70.0
    with pytest.raises(InputError, match="80"):
        design_sheet(parse_joint(data, "x"))


def test_a_load_must_be_known_and_sane() -> None:
    data = joint(CLOSED).model_dump(by_alias=True)
    data["limits"] = {}
    config = parse_joint(data, "x")
    with pytest.raises(InputError, match="joint_torque_max_Nm"):
        design_sheet(config)
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="above 0"):
            design_sheet(config, bad)


def test_sensor_twist_reaches_the_joint_by_the_square_of_the_ratio() -> None:
    ratio, stiffness, M = 1.7, 136.1, 2.0
    twist = ratio * M / stiffness  # of the held input pulley under its moment (r/R) M
    assert geometry.sensor_deflection_rad(M, ratio, stiffness) == pytest.approx(ratio * twist)
    assert geometry.sensor_deflection_rad(M, ratio, math.inf) == 0.0
