"""Readings that are there twice are said to be, and what merely comes back is not."""

from __future__ import annotations

import numpy as np
import pytest
from turning import recorded

from cablecomp.estimation.copies import same_readings
from cablecomp.signal.smoothing import FloatArray

COLUMNS = recorded()
ROWS = len(COLUMNS["time_s"])
Columns = dict[str, FloatArray]


def part(begin: int, end: int, later_s: float = 0.0) -> Columns:
    """Rows of it; their times moved."""
    cut = {name: values[begin:end].copy() for name, values in COLUMNS.items()}
    return {**cut, "time_s": cut["time_s"] + later_s}


def after(one: Columns, other: Columns) -> Columns:
    return {name: np.concatenate((one[name], other[name])) for name in one}


@pytest.mark.parametrize("later_s", [0.0, 100.0])
def test_a_copy_under_another_name_is_said_whatever_its_times(later_s: float) -> None:
    other = {**COLUMNS, "joint_position_rad": 1.0001 * COLUMNS["joint_position_rad"]}
    copy = dict(reversed(part(0, ROWS, later_s).items()))
    (said,) = same_readings({"a": COLUMNS, "b": other, "c": copy})
    assert said.startswith("c: holds the same readings as a, ")


def test_a_recording_that_was_appended_to_itself_is_said_with_its_times() -> None:
    """Its time goes on."""
    time = COLUMNS["time_s"]
    lasts = float(time[-1] - time[0] + time[1] - time[0])
    (said,) = same_readings({"a": after(COLUMNS, part(0, ROWS, lasts))})
    assert said.startswith(
        f"a: {time[0] + lasts:.6g} to {time[-1] + lasts:.6g} s hold the same readings as "
        f"{time[0]:.6g} to {time[-1]:.6g} s, which count twice so"
    )


def test_two_exports_that_overlap_are_said_with_the_times_of_both() -> None:
    time, third = COLUMNS["time_s"], ROWS // 3
    exports = {"a": part(0, 2 * third), "b": part(third, ROWS)}
    (said,) = same_readings(exports)
    assert said.startswith(
        f"b: {time[third]:.6g} to {time[2 * third - 1]:.6g} s hold the same readings as "
        f"{time[third]:.6g} to {time[2 * third - 1]:.6g} s of a, "
    )
    assert not [*same_readings({"a": part(0, third), "b": part(third, ROWS)})]


def test_a_joint_that_rests_or_comes_by_again_is_no_copy() -> None:
    """Coarse encoders, a cycle again and again, a tenth of a step of noise."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 40.0, 0.005)
    turn = np.maximum(np.sin(2.0 * np.pi * 0.25 * time), -0.5)
    again: Columns = {"time_s": time}
    for name in ("motor_position_rad", "joint_position_rad"):
        again[name] = 0.01 * np.round((turn + 1e-3 * rng.standard_normal(len(time))) / 0.01)
    resting = {name: np.full(len(time), 0.25) for name in again} | {"time_s": time}
    assert not [*same_readings({"a": again, "b": resting, "c": resting | {"time_s": time + 50.0}})]
    assert not [*same_readings({})]
