"""Units: factors against their definitions, and every accepted name means its canonical channel."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import polars as pl
import pytest

from cablecomp.errors import InputError
from cablecomp.recording.channels import (
    CANONICAL,
    QUANTITIES,
    may_be_empty,
    order,
    parse_column,
    parse_header,
)
from cablecomp.recording.reader import read_all

POUND_FORCE_N = Fraction(45359237, 100_000_000) * Fraction(980665, 100_000)  # definitions of lb and of g
INCH_M = Fraction(254, 10_000)


@pytest.mark.parametrize(
    ("column", "value", "canonical"),
    [
        ("time_ms", 1500.0, 1.5),
        ("time_us", 1.0, 1e-6),
        ("motor_position_deg", 180.0, np.pi),
        ("joint_position_rev", -0.25, -np.pi / 2),
        ("joint_torque_inlbf", 1.0, float(POUND_FORCE_N * INCH_M)),
        ("joint_torque_mNm", 2500.0, 2.5),
        ("joint_torque_cNm", 250.0, 2.5),
        ("motor_position_gon", 200.0, np.pi),
        ("motor_position_mdeg", 180e3, np.pi),
        ("time_h", 1.5, 5400.0),
        ("motor_torque_kgfcm", 1.0, 0.0980665),
        ("tension_h_lbf", 1.0, float(POUND_FORCE_N)),
        ("motor_velocity_rpm", 60.0, 2 * np.pi),
        ("joint_velocity_deg_s", 90.0, np.pi / 2),
        ("motor_current_mA", 20.0, 0.02),
        ("temperature_K", 273.15, 0.0),
        ("temperature_degF", 212.0, 100.0),
        ("temperature_degF", -40.0, -40.0),
    ],
)
def test_values_arrive_in_canonical_units(column: str, value: float, canonical: float) -> None:
    meaning = parse_column(column)
    assert meaning.factor * value + meaning.offset == pytest.approx(canonical, rel=1e-15, abs=1e-12)
    assert meaning.name in CANONICAL


def test_every_unit_leads_to_its_canonical_name_and_the_first_is_neutral() -> None:
    for quantity, units in QUANTITIES.items():
        first = next(iter(units))
        assert units[first] == (1.0, 0.0)
        for unit in units:
            assert parse_column(f"{quantity}_{unit}").name == f"{quantity}_{first}"


def test_a_file_in_other_units_reads_in_canonical_ones(tmp_path: object) -> None:
    path = f"{tmp_path}/a.parquet"
    pl.DataFrame(
        {"time_ms": [0, 1], "tension_l_kN": [0.5, 1.0], "other_gripper_lbf": [1, None]}
    ).write_parquet(path)
    table = read_all(path)
    assert table.columns["time_s"] == pytest.approx([0.0, 1e-3])
    assert table.columns["tension_l_N"] == pytest.approx([500.0, 1000.0])
    assert table.columns["other_gripper_lbf"][0] == 1.0
    assert np.isnan(table.columns["other_gripper_lbf"][1])


def test_further_channels_pass_and_may_be_empty() -> None:
    assert parse_column("other_wrist_torque_Nm") == (
        "other_wrist_torque_Nm",
        "other_wrist_torque_Nm",
        1.0,
        0.0,
    )
    assert [name for name in (*CANONICAL, "other_x") if may_be_empty(name)] == ["temperature_degC", "other_x"]
    assert order(["other_b", "joint_torque_Nm", "time_s", "other_a"]) == (
        "time_s",
        "joint_torque_Nm",
        "other_b",
        "other_a",
    )
    with pytest.raises(InputError, match="other_<name>"):
        parse_header(["time_s", "other_a b"])
