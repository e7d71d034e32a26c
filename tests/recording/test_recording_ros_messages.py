"""A recording as ROS 2's messages: bytes by the specification, and as others read them."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from message_files import Cdr
from springy_joint import joint

from cablecomp.cli.app import main
from cablecomp.recording.reader import read_all
from cablecomp.recording.ros_messages import DYNAMIC_JOINT_STATES, JOINT_STATES, TYPES, RosRows

ROW = {
    "time_s": 1.25,
    "motor_position_rad": 0.5,
    "joint_position_rad": -0.125,
    "joint_torque_Nm": 2.0,
    "tension_h_N": 35.5,
    "other_fan": nan,
}


def test_joint_states_lie_byte_by_byte_where_cdr_puts_them() -> None:
    found = RosRows(tuple(ROW)).messages(1_250_000_000, ROW)
    expected = Cdr().header(1_250_000_000, "").put("I", 2).text("joint").text("motor")
    expected = expected.sequence([-0.125, 0.5]).sequence([nan, nan]).sequence([2.0, nan])
    assert found[JOINT_STATES] == expected.data
    expected = Cdr().header(1_250_000_000, "").put("I", 4)
    for part in ("motor", "joint", "cable_h", "other"):
        expected = expected.text(part)
    expected = expected.put("I", 4).put("I", 1).text("position").sequence([0.5])
    expected = expected.put("I", 2).text("position").text("effort").sequence([-0.125, 2.0])
    expected = expected.put("I", 1).text("force").sequence([35.5]).put("I", 1).text("fan").sequence([nan])
    assert found[DYNAMIC_JOINT_STATES] == expected.data


def decoded(path: Path) -> dict[str, list[Any]]:
    """Topic -> messages, by the packages `mcap` and `rosbags` alone."""
    make_reader = pytest.importorskip(
        "mcap.reader", reason="optional package mcap is not installed"
    ).make_reader
    typesys = pytest.importorskip("rosbags.typesys", reason="optional package rosbags is not installed")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    found: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            store.register(typesys.get_types_from_msg(schema.data.decode(), schema.name))
            content = store.deserialize_cdr(message.data, schema.name)
            stamp = content.header.stamp
            assert stamp.sec * 10**9 + stamp.nanosec == message.log_time
            found.setdefault(channel.topic, []).append(content)
    return found


def test_a_converted_recording_is_read_by_others_and_by_us(tmp_path: Path) -> None:
    rows = ["time_s,motor_position_rad,joint_position_rad,joint_torque_Nm,motor_torque_Nm"]
    rows += [f"{0.001 * k},{0.1 * k},{-0.05 * k},{k},{-2 * k}" for k in range(40)]
    (tmp_path / "a.csv").write_text("\n".join(rows) + "\n")
    assert main(["convert", str(tmp_path / "a.csv"), str(tmp_path / "a.mcap"), "--ros2"]) == 0
    topics = decoded(tmp_path / "a.mcap")
    assert set(topics) == set(TYPES)
    for k, (plain, full) in enumerate(zip(topics[JOINT_STATES], topics[DYNAMIC_JOINT_STATES], strict=True)):
        assert plain.name == ["joint", "motor"]
        assert plain.position.tolist() == pytest.approx([-0.05 * k, 0.1 * k])
        assert plain.effort.tolist() == [k, -2.0 * k]
        assert all(isnan(v) for v in plain.velocity)
        told = {
            (part, kind): value
            for part, values in zip(full.joint_names, full.interface_values, strict=True)
            for kind, value in zip(values.interface_names, values.values, strict=True)
        }
        assert told["motor", "effort"] == -2.0 * k
        assert len(told) == 4
    words = [
        "motor_position_rad=/joint_states.position[motor]",
        "motor_torque_Nm=/joint_states.effort[motor]",
    ]
    words += [
        "joint_position_rad=/joint_states.position[joint]",
        "joint_torque_Nm=/joint_states.effort[joint]",
    ]
    back = [word for text in words for word in ("--map", text)]
    assert main(["convert", str(tmp_path / "a.mcap"), str(tmp_path / "b.csv"), *back]) == 0
    ours, theirs = (np.genfromtxt(tmp_path / n, delimiter=",", names=True) for n in ("b.csv", "a.csv"))
    for name in theirs.dtype.names:
        assert ours[name] == pytest.approx(theirs[name], abs=1e-9)


def test_what_is_suggested_of_joint_states_reads_them_though_some_hold_no_reading(tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="optional package mcap is not installed")
    pytest.importorskip("rosbags", reason="optional package rosbags is not installed")
    true = joint(400)
    del true["motor_torque_Nm"]
    pl.DataFrame(true).write_csv(tmp_path / "a.csv")
    assert main(["convert", str(tmp_path / "a.csv"), str(tmp_path / "a.mcap"), "--ros2"]) == 0
    assert main(["convert", str(tmp_path / "a.mcap"), str(tmp_path / "b.csv"), "--map", "auto"]) == 0
    assert main(["inspect", str(tmp_path / "a.mcap"), "--save"]) == 0
    for read in (read_all(tmp_path / "b.csv").columns, read_all(tmp_path / "a.mcap").columns):
        assert not [name for name in read if "velocity" in name or name == "motor_torque_Nm"]
        for name, values in true.items():
            np.testing.assert_allclose(read[name], values, atol=1e-9, err_msg=name)


def test_ros_messages_go_into_mcap_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("time_s,motor_position_rad,joint_torque_Nm\n0,0,0\n1,0,0\n")
    assert main(["convert", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--ros2"]) == 2
    assert "ROS 2's messages go into .mcap" in capsys.readouterr().err
