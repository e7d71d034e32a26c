"""What a neighbouring joint does to this one: in the load of the cables, or in the joint's reading."""

from __future__ import annotations

import numpy as np
import pytest
from effect_cases import excitation, fed_with, joint, run
from scipy.signal import lsim

JOINTS = ("snow-closed-rig", "tendon-finger", "snow-open-rig", "two-stage-series")


@pytest.mark.parametrize("name", JOINTS)
def test_crosstalk_is_the_other_channel_in_the_load(name: str) -> None:
    config = joint(name)
    columns = excitation(config)
    effect = ("crosstalk", {"channel": "other_neighbour_Nm", "load_coefficient": 0.3})
    found = run(config, columns, effect)["joint_position_rad"]
    expected = fed_with(config, columns, columns["joint_torque_Nm"] + 0.3 * columns["other_neighbour_Nm"])
    assert found == pytest.approx(expected, abs=1e-11)


def test_two_neighbours_are_told_apart() -> None:
    config = joint()
    columns = excitation(config)
    columns["other_wrist_Nm"] = columns["joint_torque_Nm"] ** 2
    found = run(
        config,
        columns,
        ("crosstalk", {"channel": "other_wrist_Nm", "load_coefficient": 0.2}),
        ("crosstalk", {"channel": "other_neighbour_Nm", "load_coefficient": -0.1}),
    )["joint_position_rad"]
    load = columns["joint_torque_Nm"] + 0.2 * columns["other_wrist_Nm"] - 0.1 * columns["other_neighbour_Nm"]
    assert found == pytest.approx(fed_with(config, columns, load), abs=1e-11)


def test_a_missing_reading_of_the_neighbour_is_no_load() -> None:
    config = joint()
    columns = excitation(config)
    columns["other_neighbour_Nm"] = np.full(len(columns["time_s"]), np.nan)
    effect = ("crosstalk", {"channel": "other_neighbour_Nm", "load_coefficient": 0.3})
    assert run(config, columns, effect)["joint_position_rad"] == pytest.approx(
        run(config, columns)["joint_position_rad"], abs=1e-12
    )


def test_a_neighbours_load_counts_by_the_pose() -> None:
    """At each angle of the joint as a coefficient of its own: k (1 + p q)."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    other = columns["other_neighbour_Nm"]
    values = {"channel": "other_neighbour_Nm", "load_coefficient": 0.4, "growth_per_rad": 0.8}
    found = run(config, columns, ("crosstalk", values))["joint_position_rad"]
    expected = fed_with(config, columns, columns["joint_torque_Nm"] + 0.4 * (1.0 + 0.8 * found) * other)
    assert found == pytest.approx(expected, abs=1e-10)


def test_a_neighbours_load_may_count_more_one_way_than_the_other() -> None:
    """k other (1 + b other), which is a channel like any other."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    other = columns["other_neighbour_Nm"]
    values = {"channel": "other_neighbour_Nm", "load_coefficient": 0.4, "bend_per_unit": -0.7}
    found = run(config, columns, ("crosstalk", values))["joint_position_rad"]
    expected = fed_with(config, columns, columns["joint_torque_Nm"] + 0.4 * other * (1.0 - 0.7 * other))
    assert found == pytest.approx(expected, abs=1e-11)
    straight = fed_with(config, columns, columns["joint_torque_Nm"] + 0.4 * other)
    assert np.ptp(found - straight) > 0.1 * np.ptp(
        straight - fed_with(config, columns, columns["joint_torque_Nm"])
    )


@pytest.mark.parametrize(("rubs", "play"), [(0.0, 0.3), (1.0, 0.1)])
def test_a_neighbour_draws_this_joint_along_or_rubs_on_it(rubs: float, play: float) -> None:
    """What is drawn along is as far behind as the play once the neighbour has turned back by twice that."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    other = columns["other_neighbour_Nm"]
    drawn = [other[0]]
    for x in other[1:]:
        drawn.append(max(x - play, drawn[-1]) if x > drawn[-1] else min(x + play, drawn[-1]))
    arrives = other - np.array(drawn) if rubs else np.array(drawn)
    assert np.ptp(other) > 4.0 * play
    law = {"load_coefficient": 0.4, "play_units": play, "rubs": rubs}
    found = run(config, columns, ("crosstalk", {"channel": "other_neighbour_Nm", **law}))
    expected = fed_with(config, columns, columns["joint_torque_Nm"] + 0.4 * arrives)
    assert found["joint_position_rad"] == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("amount", ["load_coefficient", "turn_rad_per_unit"])
def test_what_a_neighbour_does_may_arrive_late_and_beyond_a_slack_alone(amount: str) -> None:
    """Of a first lag, started at rest, what goes beyond the slack."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    time, other = columns["time_s"], columns["other_neighbour_Nm"]
    lag, slack, k = 0.3, 0.2 * float(np.max(np.abs(other))), 0.4
    _, y, _ = lsim(([1.0], [lag, 1.0]), other - other[0], time)
    y = y + other[0]
    z = np.where(y > slack, y - slack, np.where(y < -slack, y + slack, 0.0))
    values = {"channel": "other_neighbour_Nm", amount: k, "lag_s": lag, "slack_units": slack}
    found = run(config, columns, ("crosstalk", values))["joint_position_rad"]
    if amount == "load_coefficient":
        expected = fed_with(config, columns, columns["joint_torque_Nm"] + k * z)
    else:
        expected = run(config, columns)["joint_position_rad"] + k * z
    assert found == pytest.approx(expected, abs=1e-9)
    at_once = run(config, columns, ("crosstalk", {**values, "lag_s": 0.0, "slack_units": 0.0}))
    plainly = at_once["joint_position_rad"] - run(config, columns)["joint_position_rad"]
    assert np.ptp(found - at_once["joint_position_rad"]) > 0.3 * np.ptp(plainly)


def test_a_late_neighbour_goes_on_from_where_it_stood_after_readings_that_are_missing() -> None:
    """Straight from the reading before the gap to the one after it; in the gap nothing arrives."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    time, other = columns["time_s"], columns["other_neighbour_Nm"].copy()
    gap = slice(len(time) // 3, len(time) // 3 + 40)
    kept = np.ones(len(time), dtype=bool)
    kept[gap] = False
    _, y, _ = lsim(([1.0], [0.3, 1.0]), np.interp(time, time[kept], other[kept]) - other[0], time)
    values = {"channel": "other_neighbour_Nm", "turn_rad_per_unit": 0.4, "lag_s": 0.3}
    holed = {**columns, "other_neighbour_Nm": np.where(kept, other, np.nan)}
    turned = (
        run(config, holed, ("crosstalk", values))["joint_position_rad"]
        - run(config, columns)["joint_position_rad"]
    )
    assert turned == pytest.approx(np.where(kept, 0.4 * (y + other[0]), 0.0), abs=1e-9)


def test_a_neighbour_may_turn_the_joint_and_load_no_cable() -> None:
    """d other (1 + b other) on the joint's angle, tensions as without it; where that is not read, nothing."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    other = columns["other_neighbour_Nm"].copy()
    other[50:60] = np.nan
    columns["other_neighbour_Nm"] = other
    values = {"channel": "other_neighbour_Nm", "turn_rad_per_unit": 2e-3, "bend_per_unit": -0.7}
    found, plain = run(config, columns, ("crosstalk", values)), run(config, columns)
    turned = 2e-3 * np.nan_to_num(other * (1.0 - 0.7 * other))
    assert np.ptp(turned) > 1e-3
    assert found["joint_position_rad"] == pytest.approx(plain["joint_position_rad"] + turned, abs=1e-12)
    assert found["tension_h_N"] == pytest.approx(plain["tension_h_N"], abs=1e-9)
    both = run(config, columns, ("crosstalk", {**values, "load_coefficient": 0.3}))["joint_position_rad"]
    loaded = run(
        config, columns, ("crosstalk", {**values, "load_coefficient": 0.3, "turn_rad_per_unit": 0.0})
    )
    assert both == pytest.approx(loaded["joint_position_rad"] + turned, abs=1e-12)
