"""Readings on judged rows: noise averaged off where they are straight, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed
from small_drive import TOLERANT, course

from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.limits import AVERAGED_MOST
from cablecomp.estimation.steadying import on_every_row, steadied, with_steady_readings
from cablecomp.signal.smoothing import FloatArray, IntArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

SIGMA = 0.2
N = 20_001


def line_with_noise(seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """A straight line, and readings of it with white noise."""
    line = 1e-4 * np.arange(N)
    return line, line + SIGMA * np.random.default_rng(seed).standard_normal(N)


def every(step: int) -> IntArray:
    return np.arange(0, N, step, dtype=np.int64)


@pytest.mark.parametrize(("step", "width"), [(3, 1), (7, 3), (8, 3), (9, 4), (100, AVERAGED_MOST)])
def test_white_noise_about_a_line_falls_with_the_root_of_what_is_averaged(step: int, width: int) -> None:
    line, values = line_with_noise()
    found = steadied(values, np.ones(N, dtype=np.bool_), every(step), SIGMA)
    error = (found.values - line[every(step)])[1:-1]
    # a few disagree by chance, and keep what they have
    assert np.mean(found.part[1:-1] == 1.0 / (2 * width + 1)) > 0.7
    assert np.std(error) == pytest.approx(SIGMA * np.sqrt(np.mean(found.part)), rel=0.12)
    assert abs(np.mean(error)) < 4.0 * np.std(error) / np.sqrt(len(error))


def test_a_step_between_two_rows_is_not_smeared() -> None:
    _, values = line_with_noise()
    rows = every(9)
    values += 40.0 * SIGMA * (np.arange(N) >= rows[500] + 3)  # within reach of the row before it
    found = steadied(values, np.ones(N, dtype=np.bool_), rows, SIGMA)
    apart = found.values - values[rows]
    assert np.max(np.abs(apart[495:506])) < 5.0 * SIGMA


def test_no_reading_counts_for_two_rows_and_none_for_a_row_that_another_is_nearer_to() -> None:
    _, values = line_with_noise()
    read = np.ones(N, dtype=np.bool_)
    rows = np.sort(np.random.default_rng(2).choice(N, 3_000, replace=False)).astype(np.int64)
    before = steadied(values, read, rows, SIGMA).values
    for place in np.random.default_rng(3).choice(N, 60, replace=False):
        other = values.copy()
        other[place] += 1e-6 * SIGMA
        moved = np.flatnonzero(steadied(other, read, rows, SIGMA).values != before)
        assert len(moved) <= 1
        for k in moved:
            assert abs(rows[k] - place) == np.min(np.abs(rows - place))


def test_what_was_not_read_is_not_averaged_in() -> None:
    line, values = line_with_noise()
    read = np.random.default_rng(4).random(N) > 0.2
    values[~read] = 1e9
    rows = every(7)
    found = steadied(values, read, rows, SIGMA)
    assert np.max(np.abs(found.values - line[rows])[read[rows]]) < 6.0 * SIGMA
    assert np.all(found.part[~read[rows]] == 1.0)


def test_rows_at_the_ends_and_beside_each_other_stay_as_they_were_read() -> None:
    _, values = line_with_noise()
    rows = np.array([0, 50, 100, 101, 150, N - 1], dtype=np.int64)  # a gap between 100 and 101
    found = steadied(values, np.ones(N, dtype=np.bool_), rows, SIGMA)
    kept = [0, 2, 3, 5]
    assert np.array_equal(found.values[kept], values[rows[kept]])
    assert np.array_equal(found.part[kept], np.ones(4))
    assert found.part[1] == 1.0 / (2 * AVERAGED_MOST + 1)


@pytest.mark.parametrize("rows", [[], [5], [0, N - 1]])
def test_few_rows_or_no_noise_are_left_alone(rows: list[int]) -> None:
    _, values = line_with_noise()
    chosen, read = np.array(rows, dtype=np.int64), np.ones(N, dtype=np.bool_)
    assert np.array_equal(steadied(values, read, chosen, SIGMA).values, values[chosen])
    assert np.array_equal(steadied(values, read, every(7), 0.0).values, values[every(7)])


def seen(effects: list[EffectSpec]) -> tuple[FloatArray, Fit]:
    """The small plant's joint angle on the fine rows of a minute, and the drive calibrated on noisy readings of it,
    which knows of no effect."""
    time, motor, load = course(60.0)
    clean = simulate(PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=effects).channels()
    columns = {k: clean[k] for k in SMALL_NOISE}  # noise of the inputs is in both, reading and prediction
    columns[JOINT] = clean[JOINT] + SMALL_NOISE[JOINT] * np.random.default_rng(7).standard_normal(len(time))
    e = gather(TOLERANT, "one", {"time_s": time, **columns}, "all", fine_rows=6000, judged_rows=350)
    fit = calibrate_drive(TOLERANT, [e], np.random.default_rng(0)).fit
    return clean[JOINT][np.searchsorted(time, e.columns["time_s"])], fit


MISSING = {
    "nothing": [],
    "bearing_friction": [
        EffectSpec("bearing_friction", {"torque_Nm": 0.03, "load_coefficient": 0.0, "presliding_rad": 2e-4})
    ],
    "termination_backlash": [EffectSpec("termination_backlash", {"gap_rad": 1e-3})],
    "clamp_slip": [EffectSpec("clamp_slip", {"slip_m": 2e-4, "time_s": 25.0})],
}


@pytest.mark.parametrize("missing", MISSING)
def test_readings_averaged_about_a_drive_that_lacks_something_are_nearer_to_what_was_there(
    missing: str,
) -> None:
    """Against the plant without noise: nearer than a reading, by as much as is said where nothing is missing, and no
    loop or step rounded off by more than noise."""
    clean, fit = seen(MISSING[missing])
    (e,) = fit.problem.evidence
    noise = SMALL_NOISE[JOINT]
    off = e.weight * (e.at_rows(JOINT) - clean[e.rows])
    raw = e.weight * (e.columns[JOINT][e.rows] - clean[e.rows])
    said = noise * np.sqrt(e.quiet[JOINT])
    assert said < 0.9 * noise
    left = np.sqrt(np.mean(off**2))
    assert left < 0.93 * np.sqrt(np.mean(raw**2))
    if missing == "nothing":
        assert left == pytest.approx(said, rel=0.12)
    assert np.max(np.abs(off)) < 6.0 * noise


def test_every_row_is_read_as_it_is() -> None:
    _, fit = seen([])
    (e,) = fit.problem.evidence
    every = on_every_row(e)
    assert np.array_equal(every.at_rows(JOINT), e.columns[JOINT])
    assert every.noise_at_rows(JOINT) == every.noise_of_fine(JOINT)


def test_what_the_drive_cannot_follow_keeps_its_readings() -> None:
    _, fit = seen([])
    raw = [on_every_row(e) for e in fit.problem.evidence]
    unwound = [e.columns | {"motor_position_rad": 1e3 + e.columns["motor_position_rad"]} for e in raw]
    lost = [replace(e, columns=c) for e, c in zip(raw, unwound, strict=True)]
    assert with_steady_readings(fit.problem, fit.x, lost) == lost
