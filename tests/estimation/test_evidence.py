"""Recordings as a fit takes them: thinned by travel, turning points kept, what is no reading not counted."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.gather import gather, rows_for
from cablecomp.estimation.simulate import simulator
from cablecomp.estimation.thinning import thinned
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray, IntArray


def gathered(columns: dict[str, FloatArray], judged: int = 300) -> Evidence:
    return gather(JOINT, "one", columns, "all", fine_rows=5000, judged_rows=judged)


def travelled(columns: dict[str, FloatArray], count: int) -> IntArray:
    """Rows by travel of motor, load and joint."""
    drivers = [columns["motor_position_rad"], columns["joint_torque_Nm"]]
    return thinned(columns["time_s"], drivers, columns["joint_position_rad"], count)


def test_thinning_keeps_every_turning_point() -> None:
    """Between two kept rows motor and load go one way, but for a fiftieth of their range."""
    columns = recorded()
    rows = travelled(columns, 150)
    assert len(rows) < 250
    for key in ("motor_position_rad", "joint_torque_Nm"):
        values = columns[key]
        for a, b in pairwise(rows):
            low, high = sorted((values[a], values[b]))
            part = values[a : b + 1]
            assert max(low - part.min(), part.max() - high) <= 0.021 * np.ptp(values)


def test_a_law_without_rates_is_told_on_thinned_rows_as_on_all() -> None:
    columns = recorded(noise_rad=0.0)
    e = gathered(columns, 200)
    thin = simulator(JOINT).predict(e)["joint_position_rad"]
    whole = Observer(JOINT).run({k: e.columns[k] for k in columns})["joint_position_rad"][e.rows]
    turned = e.at_rows("motor_position_rad")
    deflection = whole - np.polyval(np.polyfit(turned, whole, 1), turned)
    assert np.std(thin - whole) < 0.02 * np.std(deflection)


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (("gravity_load", {"moment_Nm": 0.3, "phase_rad": 0.4}),),
        (("pressure_dependent_friction", {"exponent": 0.4}),),
        (
            ("position_dependent_friction", {"amplitude": 0.5, "phase_rad": 0.3}),
            ("bearing_friction", {"torque_Nm": 0.05, "load_coefficient": 0.0, "presliding_rad": 1e-4}),
        ),
    ],
    ids=["plain", "weight", "pressure", "groove and bearing"],
)
def test_a_fit_runs_the_drive_as_the_observer_does(effects: tuple[tuple[str, dict[str, float]], ...]) -> None:
    """On the same rows, bit for bit."""
    joint, columns = with_effects(JOINT, effects), recorded(noise_rad=0.0)
    e = gathered(columns, 200)
    fitted = simulator(joint).run(e, np.arange(len(e.columns["time_s"]))).joint
    observed = Observer(joint).run({k: e.columns[k] for k in columns})["joint_position_rad"]
    np.testing.assert_array_equal(fitted, observed)
    assert np.ptp(observed - JOINT.drive.ratio * e.columns["motor_position_rad"]) > 1e-3


def test_holds_keep_rows_by_time() -> None:
    columns = recorded(duration_s=40.0)
    held = columns["time_s"] > 20.0
    for key in ("motor_position_rad", "joint_torque_Nm", "joint_position_rad"):
        columns[key][held] = columns[key][np.argmax(held)]
    rows = travelled(columns, 200)
    assert np.diff(columns["time_s"][rows]).max() < 2.0
    assert np.count_nonzero(held[rows]) > 20


def test_what_is_no_reading_does_not_count_and_moves_nothing() -> None:
    columns = recorded()
    clean = gathered(columns)
    gap = slice(400, 430)
    broken = {k: v.copy() for k, v in columns.items()}
    broken["joint_position_rad"][gap] = np.nan
    broken["joint_position_rad"][700] += 0.5
    e = gathered(broken)
    counted = e.counted["joint_position_rad"]
    inside = (e.rows >= 400) & (e.rows < 430)
    assert not counted[inside].any()
    assert e.outliers > clean.outliers
    assert not counted[e.rows == 700].any()
    far = (np.abs(e.rows - 415) > 20) & (np.abs(e.rows - 700) > 2)
    np.testing.assert_allclose(
        e.at_rows("joint_position_rad")[far], broken["joint_position_rad"][e.rows[far]], atol=1e-12
    )
    told = np.isfinite(
        e.counting_from(len(e.rows)).read_at_rows("joint_position_rad")
    )  # read, though nothing counts
    np.testing.assert_array_equal(told, counted)


def test_rows_of_all_recordings_are_shared_out_by_their_length() -> None:
    fine, judged = rows_for([1_000, 100_000, 9_000], 1_200)
    assert all(f >= j for f, j in zip(fine, judged, strict=True))
    assert min(judged) >= 60
    assert judged[1] > 5 * judged[2]


def test_a_weight_is_the_root_of_the_time_that_a_row_stands_for() -> None:
    e = gathered(recorded(), 150)
    assert np.mean(e.weight**2) == pytest.approx(1.0)
    share = np.gradient(e.columns["time_s"][e.rows])
    np.testing.assert_allclose(e.weight**2 / share, e.weight[0] ** 2 / share[0])


def test_a_channel_with_hardly_a_reading_is_named() -> None:
    columns = recorded()
    columns["joint_position_rad"][30:] = np.nan
    with pytest.raises(InputError, match=r"joint_position_rad. has 30 finite"):
        gathered(columns)


def test_no_value_is_made_up_where_an_input_has_no_reading() -> None:
    """Every row that the drive is run at was measured: a bridged motor angle would be an error of the prediction."""
    columns = recorded()
    broken = {k: v.copy() for k, v in columns.items()}
    broken["motor_position_rad"][300:340] = np.nan
    broken["joint_torque_Nm"][700] = np.nan
    e = gather(JOINT, "one", broken, "all", fine_rows=10**6, judged_rows=300)
    measured = columns["time_s"][np.isfinite(broken["motor_position_rad"] + broken["joint_torque_Nm"])]
    assert len(e.columns["time_s"]) >= len(measured) - e.outliers
    assert np.all(np.isin(e.columns["time_s"], measured))


def test_no_row_is_made_of_readings_on_both_sides_of_a_gap() -> None:
    time = np.arange(0.0, 40.0, 0.008)
    time = time[(time < 10.004) | (time > 12.0)]
    motor = np.sin(time)
    columns = {"time_s": time, "motor_position_rad": motor, "joint_position_rad": 0.5 * motor}
    e = gather(JOINT, "one", columns, "all", fine_rows=1000, judged_rows=200)
    found = e.columns["time_s"]
    assert len(found) == len(time) // 5 - 1
    assert not np.any((found > 10.01) & (found < 11.99))


def test_a_run_of_absurd_readings_is_set_aside_and_a_quick_motion_after_a_long_rest_is_not() -> None:
    columns = recorded()
    clean = gathered(columns).outliers
    absurd = {k: v.copy() for k, v in columns.items()}
    absurd["joint_position_rad"][500:510] = 572.0
    e = gathered(absurd)
    assert e.outliers - clean == 10
    assert not e.counted["joint_position_rad"][(e.rows >= 500) & (e.rows < 510)].any()
    rested = {k: v.copy() for k, v in columns.items()}
    n = len(rested["time_s"])
    rested["motor_position_rad"] = 1e-5 * np.sin(np.arange(n)) + np.where(
        np.arange(n) > n - 16, 0.02 * (np.arange(n) - n + 16), 0.0
    )
    before = gathered({**rested, "motor_position_rad": 1e-5 * np.sin(np.arange(n))}).outliers
    assert gathered(rested).outliers == before


def test_a_motor_that_was_read_at_first_only_drives_nothing_later() -> None:
    """Nor is a channel of a lower rate bridged over a hole."""
    columns = recorded()
    died = {k: v.copy() for k, v in columns.items()}
    died["motor_position_rad"][300:] = np.nan
    assert gathered(died).columns["time_s"][-1] <= columns["time_s"][299]
    seldom = {k: v.copy() for k, v in columns.items()}
    read = np.arange(len(columns["time_s"])) % 4 == 0
    read[400:600] = False
    seldom["joint_torque_Nm"][~read] = np.nan
    time = gathered(seldom).columns["time_s"]
    inside = (time > columns["time_s"][396]) & (time < columns["time_s"][600])
    assert not inside.any()
    assert np.mean(np.isin(columns["time_s"][:397], time)) > 0.95


def test_an_output_of_a_lower_rate_counts_where_means_of_many_rows_hold_a_reading_of_it() -> None:
    """Every tenth row, of means of four; not over a hole, nor after the last reading."""
    columns = recorded()
    n = len(columns["time_s"])
    read = np.arange(n) % 10 == 0
    read[400:600] = False
    seldom = {**columns, "joint_position_rad": np.where(read, columns["joint_position_rad"], np.nan)}
    e = gather(JOINT, "one", seldom, "s", fine_rows=n // 4, judged_rows=200)
    assert e.group == pytest.approx(4.0, rel=0.01)
    held = {int(k) // 4 for k in np.flatnonzero(read)}
    whole = {g for g in held if 4 * g + 3 <= 390 or (4 * g >= 600 and 4 * g + 3 <= 990)}
    assert set(np.flatnonzero(e.read["joint_position_rad"])) == whole
    assert e.counted["joint_position_rad"].sum() > 40


def test_a_motor_and_a_load_that_were_never_read_together_are_said_to_be() -> None:
    columns = recorded()
    columns["motor_position_rad"][500:] = np.nan
    columns["joint_torque_Nm"][:500] = np.nan
    with pytest.raises(InputError, match="one: motor angle and load were read together at 0 instants; 40"):
        gathered(columns)


def test_a_channel_that_may_be_missing_and_was_not_read_is_missing() -> None:
    columns = recorded()
    e = gathered({**columns, "temperature_degC": np.full(len(columns["time_s"]), np.nan)})
    assert "temperature_degC" not in e.columns
    assert e.unread == ("temperature_degC",)
    np.testing.assert_array_equal(e.rows, gathered(columns).rows)


def test_motion_that_few_readings_do_not_resolve_is_no_noise() -> None:
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 60.0, 0.2)
    motor = 2.0 * np.sin(2.0 * np.pi * 0.2 * time) + 0.3 * np.sin(2.0 * np.pi * 1.1 * time)
    joint = JOINT.drive.ratio * motor + 1e-4 * rng.standard_normal(len(time))
    e = gathered({"time_s": time, "motor_position_rad": motor, "joint_position_rad": joint})
    assert e.noise["joint_position_rad"] == pytest.approx(1e-4, rel=0.2)
    assert e.noise["motor_position_rad"] == pytest.approx(1e-4 / JOINT.drive.ratio, rel=0.2)


@pytest.mark.parametrize(
    ("coarse", "other"),
    [("joint_position_rad", "motor_position_rad"), ("motor_position_rad", "joint_position_rad")],
)
def test_a_coarse_encoders_steps_are_noise_however_often_it_is_read(coarse: str, other: str) -> None:
    """Half a degree, crossed every 40 readings: the uniform error of a step (Widrow), however fine the other angle."""
    time, step = np.arange(0.0, 20.0, 1e-3), np.deg2rad(0.5)
    motor = 0.5 * np.sin(2.0 * np.pi * 0.1 * time)
    columns = {"motor_position_rad": motor, "joint_position_rad": JOINT.drive.ratio * motor}
    noise = 2e-4 * np.random.default_rng(6).standard_normal(len(time))
    columns = columns | {coarse: step * np.round(columns[coarse] / step), other: columns[other] + noise}
    e = gathered({"time_s": time, **columns})
    assert e.noise[coarse] == pytest.approx(step / np.sqrt(12.0), rel=0.05)
    assert e.noise[other] == pytest.approx(2e-4, rel=0.1)


def test_the_rows_beside_a_gap_do_not_stand_for_the_time_in_which_nothing_was_read() -> None:
    columns = recorded(duration_s=40.0)
    time = columns["time_s"]
    later = gathered({**columns, "time_s": np.where(time < 20.0, time, time + 600.0)})
    assert later.weight.max() < 2.0 * gathered(columns).weight.max()
