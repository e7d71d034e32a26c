"""MCAP, ROS bags: what is in the messages arrives in the channels, joined by the stated rule."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flipped_bits import same_or_refused
from message_files import JOINT_STATE, WRENCH, joint_state, wrench, write_messages

from cablecomp.errors import InputError
from cablecomp.recording.mapping import ColumnMap, mapping_from
from cablecomp.recording.reader import open_recording, read_all

pytest.importorskip("mcap", reason="optional package mcap is not installed")

JSON = ("json", "any", "jsonschema", b"{}")
CDR_JOINT = ("cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
CDR_WRENCH = ("cdr", "geometry_msgs/msg/WrenchStamped", "ros2msg", WRENCH.encode())
T0 = 1_700_000_000_000_000_000
ROS_MAP = mapping_from(
    [
        "motor_position_rad=/arm/measured_js.position[motor]",
        "motor_torque_Nm=/arm/measured_js.effort[motor]",
        "joint_position_rad=/arm/measured_js.position[elbow],sign=-1",
        "joint_torque_Nm=/ft.wrench.torque.z,unit=mNm",
    ]
)


def cdr_messages(count: int, wrench_after_ns: int = 20_000) -> Any:
    """A row every ms: the motor at 0.1 k, the joint at -0.05 k, effort k; the wrench 20 µs later, k mNm."""
    for k in range(count):
        at = T0 + k * 1_000_000
        yield (
            "/arm/measured_js",
            at + 400_000,
            joint_state(at, ["elbow", "motor"], [-0.05 * k, 0.1 * k], [0.0, float(k)]),
        )
        stamp = at + wrench_after_ns
        yield "/ft", stamp + 400_000, wrench(stamp, (7.0, 8.0, float(k)))


def ros(path: Path, count: int = 50, **options: Any) -> Path:
    pytest.importorskip("rosbags", reason="optional package rosbags is not installed")
    write_messages(path, {"/arm/measured_js": CDR_JOINT, "/ft": CDR_WRENCH}, cdr_messages(count), **options)
    return path


def test_ros_2_messages_become_channels_by_joint_name(tmp_path: Path) -> None:
    table = read_all(ros(tmp_path / "a.mcap"), ROS_MAP)
    k = np.arange(50)
    assert table.columns["time_s"] == pytest.approx(k * 1e-3, abs=1e-9)
    assert table.columns["motor_position_rad"] == pytest.approx(0.1 * k)
    assert table.columns["joint_position_rad"] == pytest.approx(0.05 * k)
    assert table.columns["motor_torque_Nm"] == pytest.approx(k)
    assert table.columns["joint_torque_Nm"] == pytest.approx(1e-3 * k)
    assert table.columns["other_age_ft_s"] == pytest.approx(np.full(50, -20e-6), abs=1e-9)
    assert any("a row for each message of /arm/measured_js" in note for note in table.notes)


def test_without_a_mapping_the_fields_found_are_named(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no known channel|no message holds a known channel.*position\[elbow\]"
    ):
        read_all(ros(tmp_path / "a.mcap"))


def test_a_bag_reads_as_its_mcap(tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="optional package rosbags is not installed")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = {"/arm/measured_js": "sensor_msgs/msg/JointState", "/ft": "geometry_msgs/msg/WrenchStamped"}
    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        lines = {t: writer.add_connection(t, kind, typestore=store) for t, kind in kinds.items()}
        for topic, logged, data in cdr_messages(50):
            writer.write(lines[topic], logged, data)
    expected = read_all(ros(tmp_path / "a.mcap"), ROS_MAP).columns
    (storage,) = (tmp_path / "bag").glob("*.db3")
    shutil.copy(storage, tmp_path / "alone.db3")
    for path in (tmp_path / "bag", tmp_path / "alone.db3"):
        found = read_all(path, ROS_MAP).columns
        assert {n: v.tolist() for n, v in found.items()} == {n: v.tolist() for n, v in expected.items()}


def test_a_bag_of_ros_1_reads_too(tmp_path: Path) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="optional package rosbags is not installed")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "std_msgs/msg/Float64"
    with rosbag1.Writer(tmp_path / "a.bag") as writer:
        lines = {
            t: writer.add_connection(t, kind, typestore=store)
            for t in ("/motor_position_deg", "/joint_torque_Nm")
        }
        for k in range(20):
            for topic, value in (("/motor_position_deg", 90.0 * k), ("/joint_torque_Nm", 0.5 * k)):
                data = store.serialize_ros1(store.types[kind](value), kind)
                writer.write(lines[topic], T0 + k * 10**6, data)
    columns = read_all(tmp_path / "a.bag").columns
    assert columns["motor_position_rad"] == pytest.approx(np.pi / 2 * np.arange(20))
    assert columns["joint_torque_Nm"] == pytest.approx(0.5 * np.arange(20))


def test_protobuf_is_read_by_the_schema_in_the_file(tmp_path: Path) -> None:
    """Bytes by hand (protobuf encoding guide): field 1 of kind 1 (64 bit) has tag 0x09, field 2 nested 0x12."""
    descriptor = pytest.importorskip(
        "google.protobuf.descriptor_pb2", reason="optional package protobuf is not installed"
    )
    import struct

    double, message, optional = 1, 11, 1
    file = descriptor.FileDescriptorProto(name="rig.proto", package="rig", syntax="proto3")
    inner = file.message_type.add(name="Load")
    inner.field.add(name="joint_torque_mNm", number=1, type=double, label=optional)
    outer = file.message_type.add(name="State")
    outer.field.add(name="motor_position_rad", number=1, type=double, label=optional)
    outer.field.add(name="load", number=2, type=message, type_name=".rig.Load", label=optional)
    schema = descriptor.FileDescriptorSet(file=[file]).SerializeToString()

    def state(k: int) -> bytes:
        load = b"\x09" + struct.pack("<d", 1.0 * k)
        angle = b"" if k == 0 else b"\x09" + struct.pack("<d", 0.1 * k)  # proto3 leaves zeros out
        return angle + b"\x12" + bytes([len(load)]) + load

    channel = ("protobuf", "rig.State", "protobuf", schema)
    write_messages(tmp_path / "a.mcap", {"/rig": channel}, (("/rig", k * 10**6, state(k)) for k in range(9)))
    columns = read_all(
        tmp_path / "a.mcap", mapping_from(["joint_torque_Nm=/rig.load.joint_torque_mNm,unit=mNm"])
    ).columns
    assert columns["motor_position_rad"] == pytest.approx(0.1 * np.arange(9))
    assert columns["joint_torque_Nm"] == pytest.approx(1e-3 * np.arange(9))


def scalars(path: Path, messages: Any, **options: Any) -> Path:
    topics = ("/motor_position_rad", "/joint_torque_Nm")
    write_messages(path, dict.fromkeys(topics, JSON), messages, **options)
    return path


def test_the_nearest_message_within_the_rule_is_taken_and_its_age_kept(tmp_path: Path) -> None:
    times = {"/motor_position_rad": [0, 10, 20, 30], "/joint_torque_Nm": [-4, 9, 12, 24, 31]}
    messages = sorted((t, topic, t) for topic, row in times.items() for t in row)
    stream = [(topic, T0 + t * 10**6, {"value": float(value)}) for t, topic, value in messages]
    mapping = ColumnMap.model_validate({"join": {"within_s": 0.002, "hold_s": 0.006}})
    columns = read_all(scalars(tmp_path / "a.mcap", stream), mapping).columns
    # at 0: -4 (4 ms old); at 10: 9 is nearer than 12; at 20: 12 is 8 ms old, too old, left out; at 30: 31, 1 ms after
    assert columns["motor_position_rad"].tolist() == [0.0, 10.0, 30.0]
    assert columns["joint_torque_Nm"].tolist() == [-4.0, 9.0, 31.0]
    assert columns["other_age_joint_torque_Nm_s"] == pytest.approx([4e-3, 1e-3, -1e-3], abs=1e-9)
    remarks = [
        r
        for b in open_recording(tmp_path / "a.mcap", mapping).blocks()
        for r in b.remarks
        if r.kind == "stale"
    ]
    assert [r.size for r in remarks] == [1]


def test_topics_of_other_rates_are_interpolated_at_the_slower_one_of_motor_and_joint(tmp_path: Path) -> None:
    """Motor at 1 kHz, joint at 200 Hz, load at 50 Hz, each linear in time: every row is exact, and none is made up. A
    state word is held, and so is the last load before a gap."""
    every_us = {"/motor": (1_000, 0), "/joint": (5_000, 130), "/load": (20_000, 70)}
    slope = {
        "/motor": ("motor_position_rad", 3.0),
        "/joint": ("joint_position_rad", 1.0),
        "/load": ("joint_torque_Nm", -2.0),
    }

    def content(topic: str, at_s: float) -> dict[str, float]:
        name, per_s = slope[topic]
        word = {"other_state": float(at_s > 0.5)} if topic == "/load" else {}
        return {name: per_s * at_s, **word}

    stream = sorted(
        (k * step + after, topic)
        for topic, (step, after) in every_us.items()
        for k in range(1_000_000 // step)
        if not (topic == "/load" and 0.6 < 1e-6 * k * step < 0.79)
    )
    messages = [(topic, T0 + 1_000 * at, content(topic, 1e-6 * at)) for at, topic in stream]
    write_messages(tmp_path / "a.mcap", dict.fromkeys(every_us, JSON), messages)
    table = read_all(tmp_path / "a.mcap")
    time, inner = table.columns["time_s"] + 130e-6, slice(4, -4)
    quiet = (time > 0.6001) & (time < 0.8)
    np.testing.assert_allclose(np.diff(time[~quiet][:100]), 5e-3, atol=1e-9)
    for name, per_s in slope.values():
        known = ~quiet if name == "joint_torque_Nm" else np.ones(len(time), dtype=bool)
        np.testing.assert_allclose(table.columns[name][known][inner], per_s * time[known][inner], atol=1e-9)
    assert time[quiet].max() < 0.75  # then the last load is too old: five of its periods
    np.testing.assert_allclose(table.columns["joint_torque_Nm"][quiet], -2.0 * 0.60007, atol=1e-9)
    assert set(table.columns["other_state"]) == {0.0, 1.0}
    assert any("at another rate: /motor, /load" in note for note in table.notes)


def test_messages_out_of_order_in_the_file_are_sorted(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    times = np.arange(4000) * 10**6 + rng.integers(0, 5_000_000, 4000)
    stream = [("/motor_position_rad", T0 + int(t), {"value": int(t)}) for t in times]
    write_messages(tmp_path / "a.mcap", {"/motor_position_rad": JSON}, stream, chunk_size=4096)
    columns = read_all(tmp_path / "a.mcap").columns
    assert columns["motor_position_rad"].tolist() == sorted(times.tolist())


def test_senders_clocks_are_brought_to_one(tmp_path: Path) -> None:
    """The torque's sender began to count 123 s earlier and runs 50 ppm fast; delays are 0.2 ms and up to 4 ms more."""
    rng = np.random.default_rng(7)
    at = np.arange(10_000) * 0.002
    rows = []
    for topic, begin, rate in (("/motor_position_rad", 500.0, 1.0), ("/joint_torque_Nm", 377.0, 1.0 + 50e-6)):
        logged = at + 2e-4 + rng.exponential(1e-3, len(at)).clip(0.0, 4e-3)
        stamps = begin + rate * at
        rows += [
            (
                T0 + round(g * 1e9),
                topic,
                {"value": float(t), "header": {"stamp": {"sec": int(s), "nanosec": round(s % 1 * 1e9)}}},
            )
            for t, s, g in zip(at, stamps, logged, strict=True)
        ]
    stream = [(topic, logged, content) for logged, topic, content in sorted(rows, key=lambda r: r[0])]
    table = read_all(scalars(tmp_path / "a.mcap", stream))
    assert table.columns["motor_position_rad"] == pytest.approx(at)
    # what was sampled at one instant stands in one row although messages arrived up to 4 ms apart
    assert np.abs(table.columns["joint_torque_Nm"] - at).max() < 1e-9
    assert np.abs(table.columns["other_age_joint_torque_Nm_s"]).max() < 5e-5
    by_log = read_all(tmp_path / "a.mcap", ColumnMap.model_validate({"join": {"clock": "log"}}))
    assert np.abs(by_log.columns["joint_torque_Nm"] - by_log.columns["motor_position_rad"]).max() >= 1e-3


@pytest.mark.parametrize("compression", ["NONE", "ZSTD", "LZ4"])
def test_no_flipped_bit_changes_what_is_read(compression: str, tmp_path: Path) -> None:
    """A bit flipped anywhere gives the same rows, or one line; never other rows."""
    from mcap.writer import CompressionType

    stream = [("/motor_position_rad", T0 + k * 10**6, {"value": 0.1 * k}) for k in range(300)]
    path = tmp_path / "a.mcap"
    kind = CompressionType[compression]
    write_messages(
        path, {"/motor_position_rad": JSON}, stream, chunk_size=2048, compression=kind, enable_data_crcs=True
    )
    whole = path.read_bytes()
    same_or_refused(path, whole, 11)


def test_a_chunk_that_states_more_bytes_than_can_be_counted_is_refused(tmp_path: Path) -> None:
    """The topmost bit of the length of its records: a uint64 behind times, size, CRC, compression (mcap.dev/spec)."""
    path = tmp_path / "a.mcap"
    messages = (("/motor_position_rad", k * 10**6, {"value": 0.1 * k}) for k in range(9))
    write_messages(path, {"/motor_position_rad": JSON}, messages)
    whole, at = bytearray(path.read_bytes()), 8
    while whole[at] != 0x06:
        at += 9 + int.from_bytes(whole[at + 1 : at + 9], "little")
    compression = at + 9 + 8 + 8 + 8 + 4
    length = compression + 4 + int.from_bytes(whole[compression : compression + 4], "little")
    whole[length + 7] |= 0x80
    path.write_bytes(whole)
    with pytest.raises(InputError, match=r"a\.mcap: damaged MCAP \(.*\); run `mcap recover` on it"):
        read_all(path)
