"""The replay loop, driven with a simple observer that has a memory (a play of known width)."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from joints import EQUAL, closed
from rich.console import Console

from cablecomp.config import JointConfig, parse_joint
from cablecomp.errors import InputError
from cablecomp.observer import WrapProfile
from cablecomp.recording.progress import progress_bar
from cablecomp.recording.reader import Recording, open_recording
from cablecomp.recording.recorder import Recorder
from cablecomp.recording.replay import PredictionCsv, Replayed, replay
from cablecomp.recording.writer import write_canonical


def joint(**sections: object) -> JointConfig:
    return parse_joint({**closed(EQUAL, "rig"), **sections}, "test")


class PlayObserver:
    """deflection = 0.01 (load - play), play of half width 0.3; refuses loads above 90."""

    def __init__(self) -> None:
        self.play = 0.0
        self.calls = 0

    def run(self, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        self.calls += 1
        load, motor = columns["joint_torque_Nm"], columns["motor_position_rad"]
        deflection = np.empty(len(load))
        for k, value in enumerate(load.tolist()):
            if value > 90.0:
                raise InputError(f"sample {k}: load of {value} N·m is beyond what the cable can carry")
            self.play = min(max(self.play, value - 0.3), value + 0.3)
            deflection[k] = 0.01 * (value - self.play)
        return {
            "deflection_rad": deflection,
            "deflection_low_rad": deflection - 1e-3,
            "deflection_high_rad": deflection + 1e-3,
            "joint_position_rad": motor + deflection,
            "tension_h_N": 30.0 + load,
            "tension_l_N": np.full(len(load), np.nan),
        }

    def profiles(self) -> Sequence[WrapProfile]:
        return [WrapProfile("output", np.array([0.0, 1.0]), np.array([self.play, 0.0]))]


class Kept:
    def __init__(self) -> None:
        self.parts: list[Replayed] = []

    def take(self, replayed: Replayed) -> None:
        self.parts.append(replayed)

    def predicted(self, name: str) -> np.ndarray:
        return np.concatenate([part.predicted[name] for part in self.parts])


def _columns(count: int = 1500) -> dict[str, np.ndarray]:
    time = np.arange(count) * 1e-3
    load = 5.0 * np.sin(7.0 * time) * np.exp(-time)
    motor = np.sin(3.0 * time)
    truth = PlayObserver().run({"joint_torque_Nm": load, "motor_position_rad": motor})
    noise = 1e-4 * np.random.default_rng(2).standard_normal(count)
    return {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load,
        "joint_position_rad": truth["joint_position_rad"] + noise + 2e-4,
    }


def _recording(tmp_path: Path, columns: dict[str, np.ndarray]) -> Recording:
    write_canonical(tmp_path / "a.csv", columns)
    return open_recording(tmp_path / "a.csv")


def test_numbers_equal_an_independent_calculation(tmp_path: Path) -> None:
    columns = _columns()
    config = joint(sensors={"joint_position_offset_rad": 5e-5})
    summary = replay(_recording(tmp_path, columns), PlayObserver(), [], config=config)
    truth = PlayObserver().run(columns)
    residual = columns["joint_position_rad"] - truth["joint_position_rad"] - 5e-5
    deflection = columns["joint_position_rad"] - columns["motor_position_rad"] - 5e-5
    slope, offset = np.polyfit(columns["joint_torque_Nm"], deflection, 1)
    left = deflection - slope * columns["joint_torque_Nm"] - offset
    assert summary.samples == 1500
    assert summary.duration_s == pytest.approx(1.499)
    assert summary.rmse_rad == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)
    assert summary.mean_rad == pytest.approx(residual.mean(), rel=1e-12)
    assert summary.max_rad == pytest.approx(np.abs(residual).max(), rel=1e-12)
    assert summary.baseline_linear_rmse_rad == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-9)
    assert summary.baseline_linear_slope_rad_per_Nm == pytest.approx(slope, rel=1e-9)
    assert summary.deflection_range_rad == pytest.approx(np.ptp(deflection), rel=1e-9)
    assert summary.bounds_width_last_rad == pytest.approx(2e-3)


def test_a_zero_that_loses_to_a_straight_line_is_said_with_its_value(tmp_path: Path) -> None:
    columns = _columns()
    columns["joint_position_rad"] += 0.25
    off = joint(sensors={"joint_position_offset_rad": 0.05})
    (note,) = replay(_recording(tmp_path, columns), PlayObserver(), [], config=off).notes
    told = re.search(r"joint_position_offset_rad = (\S+) ", note)
    assert told is not None
    assert float(told[1]) == pytest.approx(0.2502, abs=1e-5)
    assert note.startswith("200.2 mrad of the error is constant, 0.1")
    right = joint(sensors={"joint_position_offset_rad": float(told[1])})
    summary = replay(_recording(tmp_path, columns), PlayObserver(), [], config=right)
    assert not summary.notes
    assert summary.rmse_rad == pytest.approx(1e-4, rel=0.1)  # the noise


def test_rows_without_the_joints_angle_are_predicted_and_not_compared(tmp_path: Path) -> None:
    columns = _columns()
    there = np.ones(1500, dtype=np.bool_)
    there[[0, 700, 701, 1499]] = False
    lacking = {**columns, "joint_position_rad": np.where(there, columns["joint_position_rad"], np.nan)}
    kept, config = Kept(), joint()
    summary = replay(_recording(tmp_path, lacking), PlayObserver(), [kept], config=config)
    truth = PlayObserver().run(columns)
    residual = (columns["joint_position_rad"] - truth["joint_position_rad"])[there]
    deflection = (columns["joint_position_rad"] - columns["motor_position_rad"])[there]
    slope, _ = np.polyfit(columns["joint_torque_Nm"][there], deflection, 1)
    assert summary.samples == 1500
    np.testing.assert_allclose(kept.predicted("deflection_rad"), truth["deflection_rad"], atol=1e-12)
    assert summary.rmse_rad == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)
    assert summary.baseline_linear_slope_rad_per_Nm == pytest.approx(slope, rel=1e-9)
    assert summary.deflection_range_rad == pytest.approx(np.ptp(deflection), rel=1e-9)
    assert any("joint_position_rad is empty in 4 rows" in note for note in summary.notes)


@pytest.mark.parametrize("channel", ["motor_position_rad", "joint_torque_Nm"])
def test_rows_without_what_a_prediction_rests_on_are_refused(channel: str, tmp_path: Path) -> None:
    columns = _columns()
    columns[channel][700] = np.nan
    with pytest.raises(InputError, match=f"line 702: column '{channel}' holds 'NaN'"):
        replay(_recording(tmp_path, columns), PlayObserver(), [], config=joint())


def test_no_angle_at_all_has_no_error(tmp_path: Path) -> None:
    columns = {**_columns(), "joint_position_rad": np.full(1500, np.nan)}
    summary = replay(_recording(tmp_path, columns), PlayObserver(), [], config=joint())
    assert summary.rmse_rad is None
    json.loads(summary.to_json(), parse_constant=pytest.fail)


def test_stops_for_snapshots_do_not_change_the_prediction(tmp_path: Path) -> None:
    columns = _columns()
    kept, observer = Kept(), PlayObserver()
    summary = replay(_recording(tmp_path, columns), observer, [kept], config=joint())
    whole = PlayObserver().run(columns)
    assert observer.calls > 1
    for name in ("deflection_rad", "joint_position_rad"):
        assert kept.predicted(name).tobytes() == whole[name].tobytes()
    load = columns["joint_torque_Nm"]
    rows = {label: s.row for s in summary.snapshots for label in s.label.split(", ")}
    top = int(load.argmax())
    assert rows["start"] == 0
    assert rows["greatest load"] == top
    assert rows["least load"] == int(load.argmin())
    assert rows["end"] == 1499
    assert rows["back through zero"] == top + int(np.argmax(load[top:] <= 0.0))
    for snapshot in summary.snapshots:
        follower = PlayObserver()
        follower.run({name: values[: snapshot.row + 1] for name, values in columns.items()})
        assert snapshot.profiles[0].tension_N[0] == follower.play
        assert snapshot.load_Nm == load[snapshot.row]
        assert snapshot.time_s == columns["time_s"][snapshot.row]


def test_prediction_has_the_recordings_rows_and_the_contracts_columns(tmp_path: Path) -> None:
    columns = _columns()
    written: list[dict[str, np.ndarray]] = []
    replay(_recording(tmp_path, columns), PlayObserver(), [PredictionCsv(written.append)], config=joint())
    assert all(tuple(part) == PredictionCsv.COLUMNS for part in written)
    joined = {name: np.concatenate([part[name] for part in written]) for name in PredictionCsv.COLUMNS}
    assert joined["time_s"].tobytes() == columns["time_s"].tobytes()
    assert np.array_equal(
        joined["residual_rad"], columns["joint_position_rad"] - joined["joint_position_rad"]
    )
    assert np.isnan(joined["tension_l_N"]).all()


def test_a_live_recording_replays_to_the_same_bits(tmp_path: Path) -> None:
    columns = _columns(500)
    live = PlayObserver()
    predicted = []
    with Recorder(tmp_path / "live.csv", list(columns), rows_per_write=64) as recorder:
        for k in range(500):
            sample = {name: values[k : k + 1] for name, values in columns.items()}
            predicted.append(float(live.run(sample)["deflection_rad"][0]))
            recorder.append([float(values[0]) for values in sample.values()])
    kept = Kept()
    replay(open_recording(tmp_path / "live.csv"), PlayObserver(), [kept], config=joint())
    assert kept.predicted("deflection_rad").tolist() == predicted


def test_without_a_joint_encoder_there_is_a_prediction_and_no_residual(tmp_path: Path) -> None:
    columns = _columns()
    del columns["joint_position_rad"]
    summary = replay(_recording(tmp_path, columns), PlayObserver(), [], config=joint())
    stored = json.loads(summary.to_json())
    for key in ("rmse_rad", "mean_rad", "max_rad", "baseline_linear_rmse_rad"):
        assert stored[key] is None
    assert stored["samples"] == 1500
    assert any("no joint position" in sentence for sentence in stored["assumptions"])
    assert "snapshots" not in stored


def test_what_the_observer_refuses_is_told_with_the_files_line(tmp_path: Path) -> None:
    columns = _columns()
    columns["joint_torque_Nm"][1203] = 99.0
    with pytest.raises(InputError, match=r"a\.csv: line 1205: load of 99\.0 N·m is beyond"):
        replay(_recording(tmp_path, columns), PlayObserver(), [], config=joint())


@pytest.mark.parametrize(
    ("load", "missing"),
    [
        ("joint_torque", "joint_torque_Nm"),
        ("motor_torque", "motor_torque_Nm"),
        ("both_encoders", "joint_position_rad"),
    ],
)
def test_a_missing_channel_is_named(load: str, missing: str, tmp_path: Path) -> None:
    columns = {name: values for name, values in _columns().items() if name != missing}
    with pytest.raises(InputError, match=f"no column {missing}, needed with .observer. load = '{load}'"):
        replay(_recording(tmp_path, columns), PlayObserver(), [], config=joint(observer={"load": load}))


def test_progress_and_gaps_are_told(tmp_path: Path) -> None:
    columns = _columns()
    columns["time_s"][700:] += 2.0
    told: list[tuple[float, int]] = []
    summary = replay(
        _recording(tmp_path, columns),
        PlayObserver(),
        [],
        lambda fraction, samples: told.append((fraction, samples)),
        config=joint(),
    )
    assert told[-1] == (1.0, 1500)
    assert [gap["line"] for gap in summary.gaps] == [702]
    assert any("1 gap" in note for note in summary.notes)


def test_the_bar_shows_only_when_it_takes_long() -> None:
    now = [0.0]
    for step, shown in ((0.1, False), (1.5, True)):
        console = Console(force_terminal=True, width=80, record=True, file=StringIO())
        with progress_bar("replay", console, 2.0, lambda: now[0]) as told:
            for k in range(4):
                now[0] += step
                told(k / 3, 1000 * k)
        assert ("replay" in console.export_text()) is shown


def test_without_a_terminal_every_tenth_is_a_line_and_none_goes_back() -> None:
    console = Console(force_terminal=False, width=80, file=StringIO())
    with progress_bar("replay", console, 0.0, lambda: 0.0) as told:
        for share in (0.05, 0.31, 0.2, 0.35, 1.0):
            told(share, int(1000 * share))
    assert isinstance(console.file, StringIO)
    assert console.file.getvalue() == "replay: 30 %, 310 samples\nreplay: 100 %, 1,000 samples\n"


def test_speed_is_samples_over_the_clock_given(tmp_path: Path) -> None:
    ticks = iter(np.arange(0.0, 1000.0).tolist())
    summary = replay(
        _recording(tmp_path, _columns()), PlayObserver(), [], config=joint(), clock=lambda: next(ticks)
    )
    assert summary.observer_samples_per_s > summary.samples_per_s > 0.0
