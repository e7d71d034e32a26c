"""The commands as calls: paths, arrays and frames are one recording; errors are one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from turning import JOINT, recorded

import cablecomp
from cablecomp.errors import InputError
from cablecomp.recording.arrays import as_recording
from cablecomp.recording.writer import write_canonical

COLUMNS = recorded(duration_s=8.0, step_s=0.05)


class Frame:
    """A frame as pandas has it: `columns`, and columns by name."""

    def __init__(self, data: dict[str, np.ndarray]) -> None:
        self.columns, self._data = list(data), data

    def __getitem__(self, name: str) -> np.ndarray:
        return self._data[name]


def test_a_path_arrays_and_frames_are_the_same_recording(tmp_path: Path) -> None:
    write_canonical(tmp_path / "r.csv", COLUMNS)
    other = {"time_ms": 1e3 * COLUMNS["time_s"], "joint_torque_mNm": 1e3 * COLUMNS["joint_torque_Nm"]}
    other |= {n: COLUMNS[n] for n in ("motor_position_rad", "joint_position_rad")}
    first = cablecomp.replay(COLUMNS, JOINT)
    for given in (tmp_path / "r.csv", pl.DataFrame(COLUMNS), pl.LazyFrame(COLUMNS), Frame(COLUMNS), other):
        again = cablecomp.replay(given, JOINT)
        np.testing.assert_allclose(
            again.columns["deflection_rad"], first.columns["deflection_rad"], atol=1e-9
        )
    assert first.to_frame().height == len(COLUMNS["time_s"])
    assert len(first.figure().data) == 2


def test_a_turned_sign_is_said_before_it_is_believed() -> None:
    turned = COLUMNS | {"joint_torque_Nm": -COLUMNS["joint_torque_Nm"]}
    (said,) = cablecomp.replay(turned, JOINT).doubts
    assert (said.kind, said.channel) == ("sign", "joint_torque_Nm")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time_s": [0.0, 1.0], "angle": [0.0, 1.0]}, "angle"),
        ({"time_s": [0.0, 1.0], "motor_position_rad": [0.0]}, "one length"),
        ({"time_s": [0.0], "motor_position_rad": ["x"]}, "numbers"),
        (3.0, "a path"),
    ],
)
def test_errors_are_one_line(given: object, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        cablecomp.replay(given, JOINT)
    assert "\n" not in str(caught.value)


def test_a_recording_in_the_joints_place_is_told_in_one_line() -> None:
    with pytest.raises(InputError, match="`config` is a dict; give a JointConfig"):
        cablecomp.replay(JOINT, COLUMNS)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize(
    "wrong", [{"seed": -1}, {"seed": 1.5}, {"seed": None}, {"sessions": "every"}, {"budget_s": float("nan")}]
)
@pytest.mark.parametrize("call", [cablecomp.calibrate, cablecomp.diagnose])
def test_an_option_that_makes_no_sense_is_told_by_name(
    call: Callable[..., object], wrong: dict[str, object]
) -> None:
    (name,) = wrong
    with pytest.raises(InputError, match=f"`{name}` is {wrong[name]!r}; "):
        call(COLUMNS, JOINT, **wrong)


@pytest.mark.parametrize("kept", ["numpy", "pandas", "polars"])
@pytest.mark.parametrize("of", ["dates", "durations"])
def test_dates_and_durations_are_no_numbers_of_seconds(kept: str, of: str) -> None:
    """Their ticks are: 2 ms as 2e6 s, of nanoseconds."""
    times = np.array([0, 1, 2], dtype="timedelta64[ms]").astype("timedelta64[ns]")
    times = times if of == "durations" else np.datetime64("2026-01-01", "ns") + times
    if kept != "numpy":
        times = pytest.importorskip(kept, reason=f"{kept} is not installed").Series(times)
    columns = {"time_s": times, "motor_position_rad": np.zeros(3), "joint_torque_Nm": np.zeros(3)}
    with pytest.raises(InputError, match=r"'time_s' holds dates or durations.*timedelta64"):
        cablecomp.replay(columns, "capstan-arm")


def test_complex_numbers_are_no_readings() -> None:
    """Taken as numbers, their imaginary part would be dropped, and the real one read as if it were all."""
    load = np.array([0.0, 1.0 + 3.0j, 0.0])
    for column in (load, load.tolist()):
        with pytest.raises(InputError, match=r"'joint_torque_Nm' holds complex numbers"):
            as_recording({"time_s": [0.0, 1.0, 2.0], "joint_torque_Nm": column})


def test_a_masked_reading_is_none() -> None:
    """What stands behind a mask is whatever its file calls missing."""
    columns = {"time_s": np.arange(3.0), "motor_position_rad": np.zeros(3)}
    load = np.ma.masked_equal([0.0, -9.0, 0.0], -9.0)
    with pytest.raises(InputError, match="row 2: column 'joint_torque_Nm' is empty"):
        cablecomp.replay({**columns, "joint_torque_Nm": load}, "capstan-arm")
