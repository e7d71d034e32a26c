"""What foreign columns may mean is suggested from what they do: names, units, counts, signs, axes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from message_files import write_messages
from springy_joint import RATIO, joint

from cablecomp.cli.app import main
from cablecomp.recording.mapping import (
    column_of,
    load_mapping,
)
from cablecomp.recording.reader import read_all
from cablecomp.recording.suggest import as_mapping, suggest


@settings(max_examples=40, deadline=None)
@given(
    degrees=st.tuples(st.booleans(), st.booleans()),
    signs=st.tuples(st.sampled_from([1, -1]), st.sampled_from([1, -1]), st.sampled_from([1, -1])),
    time=st.sampled_from([("t", 1.0), ("t", 1e3), ("t", 1e6), ("stamp_ms", 1e3), ("time_us", 1e6)]),
    named=st.booleans(),
)
def test_a_disguised_joint_is_seen_through(
    degrees: tuple[bool, bool], signs: tuple[int, int, int], time: tuple[str, float], named: bool
) -> None:
    """Units and signs of joint, load and motor torque turned at random: the suggestion undoes them all."""
    true = joint()
    turn = [180.0 / math.pi if d else 1.0 for d in degrees]
    suffix = ["_deg" if d and named else "" for d in degrees]
    disguised = {
        time[0]: 1.7e9 * (time[1] == 1e3) + true["time_s"] * time[1],
        f"act_pos{suffix[0]}": true["motor_position_rad"] * turn[0],
        f"out_angle{suffix[1]}": signs[0] * true["joint_position_rad"] * turn[1],
        "load_torque": signs[1] * true["joint_torque_Nm"],
        "motor_effort": signs[2] * true["motor_torque_Nm"],
        "setpoint_motor_pos": true["motor_position_rad"] + 1.0,
    }
    mapping = as_mapping(suggest(disguised, RATIO))
    if degrees == (True, True) and not named:
        return  # a common factor of both angles cannot be told from a longer swing
    for channel, values in true.items():
        column = column_of(channel, mapping.channel[channel])
        found = disguised[column.column] * column.factor + column.offset
        np.testing.assert_allclose(found, values, atol=1e-3 if channel == "time_s" else 1e-9, err_msg=channel)


@pytest.mark.parametrize("turned", ["", "joint_torque_Nm", "motor_torque_Nm"])
def test_of_two_torques_that_disagree_the_one_is_turned_without_which_friction_would_do_work(
    turned: str,
) -> None:
    """A joint on a spring of 1 N m/rad: what it gives way follows its angle, and is no other than a ratio not known. Of
    the work that the motor puts in, 0.2 N m of friction on the way keeps all."""
    angle = np.sin(0.1 * np.arange(600.0))
    motion = np.sign(np.cos(0.1 * np.arange(600.0)))
    columns = {
        "time_s": 0.02 * np.arange(600.0),
        "motor_position_rad": (angle + 0.02 * angle + 0.001 * motion) / RATIO,
        "joint_position_rad": angle,
        "joint_torque_Nm": -angle,
        "motor_torque_Nm": RATIO * (angle + 0.2 * motion),
    }
    if turned:
        columns[turned] = -columns[turned]
    said = {s.channel for s in suggest(columns) if s.source.sign < 0}
    assert said == ({turned} if turned else set())


@pytest.mark.parametrize(("turned", "sign"), [("joint_position_rad", -1.0), ("motor_position_rad", 1.0)])
def test_an_angle_in_degrees_under_a_name_in_radians_turns_no_torque(turned: str, sign: float) -> None:
    """What does not follow from the ratio is the wrong unit's then, and no give: a load that goes with the angle keeps
    its sign, and the reason names the angle's unit."""
    true = joint()
    true["joint_torque_Nm"] = 0.3 * true["joint_torque_Nm"] + sign * true["motor_position_rad"]
    true["joint_position_rad"] = RATIO * true["motor_position_rad"] + 4e-3 * true["joint_torque_Nm"]
    true["motor_torque_Nm"] = -RATIO * true["joint_torque_Nm"]
    true[turned] = np.degrees(true[turned])
    found = {s.channel: s for s in suggest(true, RATIO)}
    assert [c for c, s in found.items() if s.source.sign < 0] == []
    assert f"is {turned} in degrees?" in " ".join(found["joint_position_rad"].why)


def test_counts_per_turn_follow_from_the_other_encoder() -> None:
    true = joint()
    counts = np.round(true["motor_position_rad"] * 8192 / (2.0 * math.pi)) + 5000
    found = {
        s.channel: s
        for s in suggest(
            {"time_s": true["time_s"], "motor_enc": counts, "joint_pos_rad": true["joint_position_rad"]},
            RATIO,
        )
    }
    assert found["motor_position_rad"].source.counts_per_rev == 8192.0


def test_units_that_the_file_states_count_in_a_suggestion(tmp_path: Path) -> None:
    columns = {"t": np.arange(5.0), "m_pos": np.arange(5.0)}
    found = {s.channel: s.source for s in suggest(columns, units={"t": "ms", "m_pos": "deg"})}
    assert found["time_s"].unit == "ms"
    assert found["motor_position_rad"].unit == "deg"


def test_of_a_wrench_the_axis_is_taken_that_the_joint_gives_way_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Six channels are named alike; what is saved reads the log as it is."""
    pytest.importorskip("mcap", reason="optional package mcap is not installed")
    step_ns, messages = 20_000_000, []
    true = joint(400)
    rows = zip(
        *(true[n].tolist() for n in ("motor_position_rad", "joint_position_rad", "joint_torque_Nm")),
        strict=True,
    )
    for k, (motor, angle, load) in enumerate(rows):
        state = {"name": ["motor", "wrist"], "position": [motor, angle], "velocity": [], "effort": []}
        axes = {"x": 0.0, "y": 0.1 * math.sin(9.0 * k), "z": load}
        wrench = {"force": {"x": 1.0 * k, "y": 0.0, "z": 0.0}, "torque": axes}
        messages += [("/joints", k * step_ns, state), ("/ft", k * step_ns, {"wrench": wrench})]
    path = tmp_path / "a.mcap"
    kinds = {
        t: ("json", kind, "jsonschema", b"{}") for t, kind in (("/joints", "JointState"), ("/ft", "Wrench"))
    }
    write_messages(path, kinds, messages)
    assert main(["inspect", str(path), "--save"]) == 0
    assert "stuck" not in capsys.readouterr().out  # the age of a topic's values is no sensor
    saved = load_mapping(tmp_path / "cablecomp.map.toml")
    assert saved.channel["joint_torque_Nm"].column == "/ft.wrench.torque.z"
    read = read_all(path, saved).columns
    np.testing.assert_allclose(np.abs(read["joint_torque_Nm"]), np.abs(true["joint_torque_Nm"]))
    assert not [name for name in read if name.startswith(("tension", "motor_torque"))]
