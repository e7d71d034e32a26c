"""What the plant refuses, in one line that says what and where; and what its sensors make of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plant_joints import joint

from firmware_sim.plant import (
    EffectSpec,
    PlantConfig,
    PlantError,
    Resolution,
    SensorSpec,
    StageConfig,
    simulate,
)

GOOD = """
schema = 1
name = "j"
[drive]
circuit = "closed"
[[drive.stage]]
output_radius_m = 0.04
input_radius_m = 0.02
free_length_m = 0.06
EA_N = 20000.0
pretension_N = 50.0
mu_output = 0.1
mu_input = 0.1
wrap_output_rad = 8.0
wrap_input_rad = 8.0
[tolerance]
EA_N = 0.05
[sensors]
joint_position_noise_rad = 2e-5
joint_torque_gain = 1.0
[[effect]]
id = "series_compliance"
compliance_rad_per_Nm = 1e-3
"""


def test_reads_a_joint_file(tmp_path: Path) -> None:
    path = tmp_path / "joint.toml"
    path.write_text(GOOD)
    config = PlantConfig.from_toml(path)
    assert config.ratio == pytest.approx(0.5)
    assert config.effects == (EffectSpec("series_compliance", {"compliance_rad_per_Nm": 1e-3}),)
    assert SensorSpec.from_table(config.sensors).joint_position_noise_rad == 2e-5


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("mu_output = 0.1\n", "", "missing key `mu_output`"),
        ("free_length_m = 0.06", "free_length_m = -1.0", "`free_length_m` is -1.0"),
        ('"closed"', '"ring"', '"open" or "closed"'),
        ("[drive]", "[drive", "not valid TOML"),
        ("[[drive.stage]]", "[[drive.step]]", "missing [[drive.stage]]"),
        ("EA_N = 20000.0", 'EA_N = "stiff"', "`EA_N` is 'stiff'"),
    ],
)
def test_a_bad_joint_file_is_named_with_its_key(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "joint.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(PlantError) as caught:
        PlantConfig.from_toml(path)
    assert says in str(caught.value)
    assert "joint.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PlantError, match="cannot be read"):
        PlantConfig.from_toml(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("effect", "says"),
    [
        (EffectSpec("no_such"), "unknown effect"),
        (EffectSpec("crosstalk", {}), "missing parameter `load_coefficient`"),
        (EffectSpec("crosstalk", {"load_coefficient": 0.1, "k": 1.0}), "unknown parameter `k`"),
        (EffectSpec("strand_break", {"fraction": 2.0, "time_s": 1.0}), "from 0 to 0.95"),
    ],
)
def test_a_bad_effect_is_refused(effect: EffectSpec, says: str) -> None:
    t = np.arange(0, 1, 0.1)
    with pytest.raises(PlantError, match=says):
        simulate(joint(), t, 0 * t, 0 * t, effects=(effect,))
    twice = EffectSpec("crosstalk", {"load_coefficient": 0.1})
    with pytest.raises(PlantError, match="given twice"):
        simulate(joint(), t, 0 * t, 0 * t, effects=(twice, twice))


def test_bad_courses_are_refused() -> None:
    t = np.arange(0, 1, 0.1)
    with pytest.raises(PlantError, match="shape"):
        simulate(joint(), t, t[1:], 0 * t)
    with pytest.raises(PlantError, match="not finite at sample 3"):
        simulate(joint(), t, 0 * t, np.where(t == t[3], np.nan, 0.0))
    with pytest.raises(PlantError, match="increase"):
        simulate(joint(), t[::-1], 0 * t, 0 * t)
    with pytest.raises(PlantError, match="cable is left on a drum"):
        simulate(joint(), t, 40.0 * t, 0 * t)


def test_resolution_is_checked() -> None:
    with pytest.raises(PlantError, match="friction_step"):
        Resolution(friction_step=0.0)
    t = np.arange(0, 1, 0.1)
    with pytest.raises(PlantError, match="material points"):
        simulate(joint(), t, 0 * t, 0 * t, resolution=Resolution(max_nodes=20))


def test_stage_values_are_checked() -> None:
    with pytest.raises(PlantError, match="mu_input"):
        StageConfig(0.1, 0.1, 0.1, 1e4, 10.0, 0.1, float("nan"), 6.0, 6.0)


def test_a_sensors_noise_is_checked() -> None:
    with pytest.raises(PlantError, match="joint_torque_noise_Nm"):
        SensorSpec(joint_torque_noise_Nm=-1.0)
