"""What a machine repeats, against a joint whose scatter is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, SMALL_TOLERANCE, closed

from cablecomp.config import parse_joint
from cablecomp.diagnosis.locate.remainders import covariates_of
from cablecomp.diagnosis.locate.repeatability import repeatability
from cablecomp.estimation.gather import gather

CONFIG = parse_joint({**closed(SMALL, "small"), "tolerance": SMALL_TOLERANCE}, "small")


def repeated(
    amplitudes: np.ndarray, compliance: float, sigma: float, unread: float = 0.0, later: float = 0.0
) -> float | None:
    """Of a joint that yields to its load and has no memory: one cycle per amplitude of the load. Its angle is not read
    in a last share of the time, `unread`, and reads something else in a last share that does not count, `later`."""
    rng = np.random.default_rng(11)
    time = np.arange(0.0, 8.0 * len(amplitudes), 0.02)
    size = np.interp(time, 8.0 * (np.arange(len(amplitudes)) + 0.5), amplitudes)
    motor = 0.8 * np.sin(2.0 * np.pi * time / 8.0)
    load = size * np.sin(2.0 * np.pi * time / 8.0 + 0.7)
    joint = motor + compliance * load + sigma * rng.standard_normal(len(time))
    columns = {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load,
        "joint_position_rad": np.where(time < (1.0 - unread) * time[-1], joint, np.nan),
    }
    columns["joint_position_rad"] += np.where(
        time < (1.0 - later) * time[-1], 0.0, 1e-2 * rng.standard_normal(len(time))
    )
    evidence = gather(CONFIG, "one", columns, "all", fine_rows=6_000, judged_rows=2_000)
    counts = evidence.at_rows("time_s") < (1.0 - later) * time[-1]
    evidence = replace(evidence, counted={c: k & counts for c, k in evidence.counted.items()})
    return repeatability([evidence], [covariates_of(CONFIG, evidence).at(evidence.rows)])


@pytest.mark.parametrize("compliance", [0.0, 0.01])
def test_the_scatter_of_a_joint_is_found_whatever_its_load_differs_by(compliance: float) -> None:
    sigma = 1e-5  # a load that is two percent off moves the joint by 2e-4
    amplitudes = np.array([1.0, 1.01, 0.99, 1.02, 0.98, 1.0])
    found = repeated(amplitudes, compliance, sigma)
    assert found == pytest.approx(sigma, rel=0.25)


@pytest.mark.parametrize("apart", [{"unread": 0.2}, {"later": 0.2}])
def test_rows_that_do_not_count_say_nothing_of_it(apart: dict[str, float]) -> None:
    """The angle not read in the last fifth of the time, or that fifth kept for the end."""
    amplitudes = np.array([1.0, 1.01, 0.99, 1.02, 0.98, 1.0])
    assert repeated(amplitudes, 0.01, 1e-5, **apart) == pytest.approx(1e-5, rel=0.25)


def test_nothing_is_said_where_nothing_repeats() -> None:
    assert repeated(np.array([0.2, 0.6, 1.0]), 0.01, 1e-5) is None


def test_what_a_model_tells_apart_is_no_scatter() -> None:
    """A joint read 50 ms late, at speeds that change by a quarter from cycle to cycle, under a light load."""
    rng = np.random.default_rng(12)
    period = np.repeat([8.0, 10.0, 7.0, 9.0, 11.0, 8.5], 400)
    time = np.cumsum(period) / 400.0
    phase = 2.0 * np.pi * np.arange(len(time)) / 400.0
    motor = 0.8 * np.sin(phase)
    late = 0.05 * np.gradient(motor, time)
    joint = motor - late + 1e-5 * rng.standard_normal(len(time))
    load = 1e-3 * np.sin(phase)
    columns = {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load,
        "joint_position_rad": joint,
    }
    evidence = gather(CONFIG, "one", columns, "all", fine_rows=6_000, judged_rows=2_000)
    seen = [covariates_of(CONFIG, evidence).at(evidence.rows)]
    known = np.interp(evidence.at_rows("time_s"), time, motor - late)
    without = repeatability([evidence], seen)
    told = repeatability([evidence], seen, [evidence.at_rows("joint_position_rad") - known])
    assert without is not None
    assert told is not None
    assert without > 1e-3
    assert told == pytest.approx(1e-5, rel=0.25)


def test_a_load_that_nobody_recorded_is_no_scatter() -> None:
    """A joint that yields to its own inertia, swung at two frequencies; all of it comes again every 24 s."""
    rng = np.random.default_rng(13)
    time = np.arange(0.0, 96.0, 0.02)
    slow, quick = 2.0 * np.pi / 8.0, 2.0 * np.pi / 3.0
    motor = 0.6 * np.sin(slow * time) + 0.05 * np.sin(quick * time + 0.7)
    acceleration = -0.6 * slow**2 * np.sin(slow * time) - 0.05 * quick**2 * np.sin(quick * time + 0.7)
    joint = motor - 5e-3 * acceleration + 1e-5 * rng.standard_normal(len(time))
    columns = {"time_s": time, "motor_position_rad": motor, "joint_position_rad": joint}
    evidence = gather(CONFIG, "one", columns, "all", fine_rows=6_000, judged_rows=2_000)
    found = repeatability([evidence], [covariates_of(CONFIG, evidence).at(evidence.rows)])
    assert found == pytest.approx(1e-5, rel=0.25)
