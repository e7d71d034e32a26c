"""What a column is by its name, and in which unit: plain names are understood, and nothing is guessed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from springy_joint import joint

from cablecomp.cli.app import main
from cablecomp.cli.shared import console
from cablecomp.recording.column_names import read_name
from cablecomp.recording.inspection import inspect
from cablecomp.recording.reader import read_all
from cablecomp.recording.suggest import suggest
from cablecomp.units import UNITS, unit_named


@pytest.mark.parametrize(
    ("column", "channel", "unit"),
    [
        ("stamp_ms", "time_s", "ms"),
        ("Time (s)", "time_s", "s"),
        ("t", "time_s", None),
        ("motor_pos", "motor_position_rad", None),
        ("MotorAngle[deg]", "motor_position_rad", "deg"),
        ("drive encoder deg", "motor_position_rad", "deg"),
        ("/arm/measured_js.position[elbow]", "joint_position_rad", None),
        ("link.theta_deg", "joint_position_rad", "deg"),
        ("tau_motor", "motor_torque_Nm", None),
        ("joint_trq [mNm]", "joint_torque_Nm", "mNm"),
        ("/ft_sensor.wrench.torque.z", "joint_torque_Nm", None),
        ("iq", "motor_current_A", None),
        ("motor_current_mA", "motor_current_A", "mA"),
        ("jointSpeed_rpm", "joint_velocity_rad_s", "rpm"),
        ("cable tension 1 (N)", "tension_h_N", "N"),
        ("cable tension 2 (N)", "tension_l_N", "N"),
        ("winding_temp", "temperature_degC", None),
        ("motorpos", "motor_position_rad", None),
        ("jointtorque_mNm", "joint_torque_Nm", "mNm"),
        ("ft_sensor", "joint_torque_Nm", None),
        ("load torque [ft-lb]", "joint_torque_Nm", "ft-lb"),
        ("torque (lb·in)", "joint_torque_Nm", "lb·in"),
        ("joint torque oz·in", "joint_torque_Nm", "oz·in"),
        ("joint_torque/cNm", "joint_torque_Nm", "cNm"),
        ("motor angle [gon]", "motor_position_rad", "gon"),
        ("motor_position_grad", "motor_position_rad", "grad"),
        ("joint angle [MDEG]", "joint_position_rad", "mdeg"),
        ("time_hours", "time_s", "hours"),
        ("torque (measured)", "joint_torque_Nm", None),
        ("theta (motor side)", "motor_position_rad", None),
        ("elbow/position", "joint_position_rad", None),
        ("/joint_states.position[left_gripper_finger]", "joint_position_rad", None),
        ("effort[panda_joint1]", "joint_torque_Nm", None),
        ("motor position (shoulder)", "motor_position_rad", None),
        ("position/index", "motor_position_rad", None),
        ("torque/Kistler", "joint_torque_Nm", None),
        ("joint torque (load cell)", "joint_torque_Nm", None),
        ("joint position [rad] (wrapped)", "joint_position_rad", "rad"),
        ("tension (H)", "tension_h_N", None),
        ("time (UTC)", "time_s", None),
        ("Motor current [Arms]", "motor_current_A", "Arms"),
        ("joint torque (in Nm)", "joint_torque_Nm", "Nm"),
        ("joint torque (Nm, filtered)", "joint_torque_Nm", "Nm"),
        ("joint torque [newton metre]", "joint_torque_Nm", "newton metre"),
        ("joint angle in deg", "joint_position_rad", "deg"),
        ("cable force in lbf", "tension_h_N", "lbf"),
        ("tension_1_in_lbf", "tension_h_N", "lbf"),
        ("force_in_lbf", "tension_h_N", "lbf"),
        ("pull_in_ozf", "tension_h_N", "ozf"),
        ("joint_torque_in_lbf", "joint_torque_Nm", "in_lbf"),
        ("joint_load_in_oz", "joint_torque_Nm", "in_oz"),
    ],
)
def test_names_that_people_use_are_understood(column: str, channel: str, unit: str | None) -> None:
    best = read_name(column)[0]
    assert (best.channel, best.unit) == (channel, unit)


@pytest.mark.parametrize(
    ("channel", "column", "unit"),
    [
        ("joint_torque_Nm", "load torque [kgf·m]", "kgf·m"),
        ("joint_torque_Nm", "joint_torque_kNcm", "kNcm"),
        ("joint_torque_Nm", "joint_torque (counts)", "counts"),
        ("motor_position_rad", "motor_position/cycles", "cycles"),
        ("joint_torque_Nm", "joint torque (%)", "%"),
        ("time_s", "time [100ns]", "100ns"),
        ("motor_position_rad", "motor_position_crad", "crad"),
        ("time_s", "time [ticks]", "ticks"),
        ("time_s", "time_days", "days"),
    ],
)
def test_a_unit_that_is_not_known_is_never_guessed(
    channel: str, column: str, unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    true = joint(500)
    log, out = tmp_path / "a.csv", tmp_path / "out.csv"
    pl.DataFrame({column if name == channel else name: values for name, values in true.items()}).write_csv(
        log
    )
    for command in (["inspect", str(log), "--save"], ["convert", str(log), str(out), "--map", "auto"]):
        assert main(command) == 2
        shown, said = capsys.readouterr()
        assert said.count("\n") == 1
        assert ("not yet a recording: column" in shown) == (command[0] == "inspect")
        assert f"{log}: column '{column}': unit '{unit}' is not known; accepted for" in said
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    given = ["--map", "auto", "--map", f"{channel}={column},scale=2"]
    assert main(["convert", str(log), str(out), *given]) == 0
    np.testing.assert_allclose(read_all(out).columns[channel], 2.0 * true[channel], atol=1e-12)


def test_a_further_channel_of_an_unknown_unit_is_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "_width", 200)
    true = joint(500)
    log, out = tmp_path / "a.csv", tmp_path / "out.csv"
    pl.DataFrame({**true, "cable tension 1 (kg)": true["time_s"]}).write_csv(log)
    says = "left out: column 'cable tension 1 (kg)': unit 'kg' is not known; accepted for tension_h are N"
    assert main(["convert", str(log), str(out), "--map", "auto"]) == 0
    assert capsys.readouterr().err.count(f"{log}: {says}") == 1
    assert "tension_h_N" not in read_all(out).columns
    assert main(["inspect", str(log)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.count(f"note: {says}") == 1
    assert "cable tension 1 (kg) 0 0.499 unit kg is not known" in shown


def test_a_column_without_a_number_is_said_to_be_empty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "a.csv"
    pl.DataFrame({**joint(500), "temperature_degC": [""] * 500}).write_csv(log)
    assert main(["inspect", str(log)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "– – is empty" in shown
    assert "nan" not in shown


def test_an_angle_that_begins_anew_at_each_turn_turns_no_sign_round() -> None:
    true = joint(4000)
    turned = (true["motor_position_rad"] + 0.1) % (2.0 * np.pi)
    columns = {**true, "motor_position_rad": turned}
    signs = {s.channel: s.source.sign for s in suggest(columns)}
    assert set(signs.values()) == {1}
    turns = {c.name: c.turns for c in inspect(columns).channels}
    assert turns["motor_position_rad"] == np.count_nonzero(np.abs(np.diff(turned)) > np.pi) > 0
    assert turns["joint_position_rad"] == turns["joint_torque_Nm"] == 0


@pytest.mark.parametrize(
    ("written", "unit", "factor"),
    [
        *((text, "rad_s", 1.0) for text in ("rad/sec", "rad s^-1", "rad·s⁻¹", "radians per second")),
        *((text, "rad_s", math.pi / 180.0) for text in ("deg/sec", "degrees/s", "°/sec", "deg s-1")),
        *((text, "rad_s", math.pi / 30.0) for text in ("r/min", "1/min", "U/min", "min⁻¹", "rev/min")),
        *((text, "Nm", 1.0) for text in ("N∙m", "N×m", "newton metre", "newton-meters")),
        *((text, "rad", math.pi / 180.0) for text in ("º", "deg.")),
        ("revs", "rad", 2.0 * math.pi),
        ("sec.", "s", 1.0),
        ("µs", "s", 1e-6),
        *((text, "degC", 1.0) for text in ("deg C", "℃", "ºC")),
        *((text, "A", 1.0) for text in ("A rms", "Arms", "A_rms")),
    ],
)
def test_a_known_unit_may_be_spelt_in_any_plain_way(written: str, unit: str, factor: float) -> None:
    found = unit_named(written, UNITS[unit])
    assert found is not None
    assert found.factor == pytest.approx(factor)


def test_a_length_is_no_angle() -> None:
    assert read_name("motor position [mm]") == []


@pytest.mark.parametrize("column", ["mode", "battery_voltage", "x", "fault_code", "status"])
def test_names_that_tell_nothing_give_nothing(column: str) -> None:
    assert read_name(column) == []
