"""Laws of the watch: false alarms rarer than stated, changes found and dated, memory constant."""

from __future__ import annotations

import numpy as np
import pytest
from planted import SIGMA, autoregressive, columns

from cablecomp.errors import InputError
from cablecomp.signal.smoothing import FloatArray
from cablecomp.watch.ring import Ring, locate_in_ring
from cablecomp.watch.sequential import Alarm, WatchConfig, WatchState, log_evidence, start, step

STEP_S = 1e-3


def run(residual: FloatArray, config: WatchConfig) -> tuple[WatchState, list[Alarm]]:
    state = start(config)
    alarms = [step(state, i * STEP_S, value) for i, value in enumerate(residual.tolist())]
    return state, [alarm for alarm in alarms if alarm is not None]


@pytest.mark.parametrize("memory", [0.1, 5.0, 20.0])
def test_false_alarms_are_rarer_than_stated(memory: float) -> None:
    count, length, between = 0, 60_000, 20.0
    for trial in range(5):
        noise = autoregressive(np.random.default_rng(trial), length, memory, SIGMA)
        count += len(run(noise, WatchConfig(between, 4_000))[1])
    expected = 5 * length * STEP_S / between  # 15
    assert count <= expected


def test_rare_large_residuals_keep_the_promise_of_the_width() -> None:
    """Student's t of 5 degrees: its square has no variance of its own."""
    count, length, between = 0, 60_000, 150.0
    for trial in range(4):
        residual = SIGMA * np.random.default_rng(trial).standard_t(5, length)
        found = run(residual, WatchConfig(between, 4_000))[1]
        count += sum(alarm.kind == "wider" for alarm in found)
    assert count <= 4 * length * STEP_S / between  # 1.6


@pytest.mark.parametrize(
    ("change", "kind"), [("up", "offset up"), ("down", "offset down"), ("wider", "wider")]
)
def test_a_change_is_found_and_dated(change: str, kind: str) -> None:
    noise = autoregressive(np.random.default_rng(1), 40_000, 5.0, SIGMA)
    after = np.arange(40_000) >= 20_000
    changed = {
        "up": noise + 1.5 * SIGMA * after,
        "down": noise - 1.5 * SIGMA * after,
        "wider": noise * np.where(after, 2.0, 1.0),
    }[change]
    state, alarms = run(changed, WatchConfig(3_600.0, 4_000))
    assert alarms
    first = alarms[0]
    assert first.kind == kind
    assert 20.0 < first.at_s < 23.0
    assert first.since_s == pytest.approx(20.0, abs=1.0)
    assert first.usual_rad == pytest.approx(SIGMA, rel=0.1)
    assert abs(first.size_rad) == pytest.approx((2.0 if kind == "wider" else 1.5) * SIGMA, rel=0.35)
    assert state.usual is not None
    assert first.threshold == pytest.approx(np.log(3_600.0 / state.usual.duration_s))


def test_a_change_of_no_interest_keeps_the_promise() -> None:
    """The mean may wander within the indifference for ever; a larger change is still found."""
    noise = autoregressive(np.random.default_rng(4), 60_000, 5.0, SIGMA)
    time = np.arange(60_000) * STEP_S
    wander = 0.8 * SIGMA * np.sin(2.0 * np.pi * (time - 4.0) / 9.0) * (time > 4.0)
    between = 20.0
    assert len(run(noise + wander, WatchConfig(between, 4_000, 1.0))[1]) <= 60.0 / between
    assert len(run(noise + wander, WatchConfig(between, 4_000))[1]) > 60.0 / between
    _, alarms = run(noise + wander + 4.0 * SIGMA * (time > 30.0), WatchConfig(3_600.0, 4_000, 1.0))
    assert 30.0 < alarms[0].at_s < 31.0


def test_nothing_is_said_while_learning_and_gaps_are_passed_over() -> None:
    state = start(WatchConfig(100.0, 1_000))
    assert step(state, 0.0, float("nan")) is None
    assert state.count == 0
    assert log_evidence(state) == 0.0


def test_memory_is_constant() -> None:
    noise = autoregressive(np.random.default_rng(2), 30_000, 1.0, SIGMA)
    state, _ = run(noise, WatchConfig(100.0, 1_000))
    assert len(state.learnt) == 1_000
    assert len(state.evidence) == 9


def test_unusable_promises_are_refused() -> None:
    with pytest.raises(InputError, match="positive"):
        WatchConfig(0.0)
    with pytest.raises(InputError, match="400"):
        WatchConfig(10.0, 50)
    with pytest.raises(InputError, match="indifference"):
        WatchConfig(10.0, 500, -1.0)


def test_the_ring_keeps_the_last_rows_in_order() -> None:
    ring = Ring(("time_s", "x"), 5)
    for i in range(4):
        ring.extend(np.array([(float(k), 2.0 * k) for k in range(3 * i, 3 * i + 3)]))
    assert len(ring) == 5
    assert list(ring.columns()["time_s"]) == [7.0, 8.0, 9.0, 10.0, 11.0]
    with pytest.raises(InputError, match="time_s"):
        Ring(("x",), 5)


def test_an_alarm_can_be_located_from_the_ring() -> None:
    given = columns("sweep")
    load = given["joint_torque_Nm"]
    noise = SIGMA * np.random.default_rng(3).standard_normal(len(load))
    given["residual_rad"] = 4.0 * SIGMA * (load**2 - np.mean(load**2)) + noise
    ring = Ring(tuple(given), 4_000)
    ring.extend(np.column_stack(tuple(given.values())))
    location = locate_in_ring(ring, SIGMA, np.random.default_rng(0))
    assert location.mismatch[0].covariate == "load"
    with pytest.raises(InputError, match="residual_rad"):
        locate_in_ring(Ring(("time_s", "x"), 5), SIGMA, np.random.default_rng(0))
