"""What comes late in a recording that is whole: read in time, at corners too, in every output channel."""

from __future__ import annotations

import numpy as np
import pytest
from turning import JOINT

from cablecomp.config import Empirical, JointConfig
from cablecomp.effects import with_effects
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.simulate import simulator
from cablecomp.observer import Observer
from cablecomp.signal.between import rate_of, read_at
from cablecomp.signal.smoothing import FloatArray

TIME = np.arange(0.0, 20.0, 0.004)
RIPPLE = Empirical(
    id="ripple", law="chebyshev", of="motor_position_rad", half_width=1.5, coefficients_rad=(0.0, 0.0, 1e-3)
)


def zigzag(time: FloatArray, period_s: float) -> FloatArray:
    """From 0 to 1, to -1 and back, with corners."""
    return np.interp((time / period_s) % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])


def inputs(time: FloatArray) -> dict[str, FloatArray]:
    return {
        "time_s": time,
        "motor_position_rad": 1.5 * np.sin(0.9 * time),
        "joint_torque_Nm": 1.2 * zigzag(time, 2.6),
    }


def truth(config: JointConfig = JOINT) -> dict[str, FloatArray]:
    """What the channels are when they are, on a fine and longer grid."""
    time = np.arange(-0.5, 20.5, 0.001)
    columns = inputs(time)
    answer = Observer(config).run({**columns, "time_s": time + 0.5})
    return {
        **columns,
        "joint_position_rad": answer["joint_position_rad"],
        "motor_torque_Nm": answer["predicted_motor_torque_Nm"],
    }


def recorded(true: dict[str, FloatArray], load_late_s: float, joint_late_s: float) -> Evidence:
    """What is stamped at `TIME` with these delays, gathered."""
    late = {"joint_torque_Nm": load_late_s, "joint_position_rad": joint_late_s}
    columns = {
        name: np.interp(TIME - late.get(name, 0.0), true["time_s"], values)
        for name, values in true.items()
        if name != "time_s"
    }
    return gather(JOINT, "one", {"time_s": TIME, **columns}, "a", fine_rows=4000, judged_rows=240)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("load_s", "joint_s"), [(0.06, 0.0), (0.0, 0.05), (0.0, -0.05), (0.05, 0.02), (-0.03, -0.04)]
)
def test_late_and_early_channels_are_read_in_time(load_s: float, joint_s: float) -> None:
    true = truth()
    recording = recorded(true, load_s, joint_s)
    late = with_effects(JOINT, [("clock_skew", {"delay_s": joint_s, "load_delay_s": load_s})])
    counted = slice(20, None)  # what went before the first sample is not known
    for channel in ("joint_position_rad", "motor_torque_Nm"):
        measured = recording.at_rows(channel)
        left = rms((measured - simulator(late).predict(recording)[channel])[counted])
        ignored = rms((measured - simulator(JOINT).predict(recording)[channel])[counted])
        told = load_s != 0.0 or channel == "joint_position_rad"
        assert left < (0.06 * ignored if told else 1.001 * ignored), channel


def test_of_what_a_live_joint_leaves_at_corners_little_is_left() -> None:
    recording = recorded(truth(), 0.06, 0.0)
    late = with_effects(JOINT, [("clock_skew", {"delay_s": 0.0, "load_delay_s": 0.06})])
    live = Observer(late).run({k: recording.columns[k][recording.rows] for k in inputs(TIME)})
    measured = recording.at_rows("joint_position_rad")
    left = measured - simulator(late).predict(recording)["joint_position_rad"]
    assert rms(left[20:]) < 0.3 * rms((measured - live["joint_position_rad"])[20:])


def test_a_law_without_a_name_goes_by_what_was_read_and_when() -> None:
    rippled = JOINT.model_copy(update={"empirical": (RIPPLE,)})
    recording = recorded(truth(), 0.0, 0.05)
    skew = [("clock_skew", {"delay_s": 0.05})]
    added = (
        simulator(with_effects(rippled, skew)).predict(recording)["joint_position_rad"]
        - simulator(with_effects(JOINT, skew)).predict(recording)["joint_position_rad"]
    )
    x = recording.at_rows("motor_position_rad") / 1.5
    assert np.allclose(added, 1e-3 * (2.0 * x**2 - 1.0), atol=1e-9)


def test_a_drift_of_the_clock_grows_from_when_it_began() -> None:
    recording = recorded(truth(), 0.0, 0.0)
    drift = {"delay_s": 0.0, "drift": 0.004, "drift_since_s": -5.0}
    drifted = simulator(with_effects(JOINT, [("clock_skew", drift)])).predict(recording)
    plain = simulator(JOINT).predict(recording)["joint_position_rad"]
    time = recording.at_rows("time_s")
    expected = np.interp(time - 0.004 * (time + 5.0), time, plain)
    inner = slice(20, None)
    assert rms((drifted["joint_position_rad"] - expected)[inner]) < 0.02 * rms((plain - expected)[inner])


def test_an_acceleration_is_read_between_two_rows_and_a_corner_stays_one() -> None:
    time = np.arange(0.0, 5.0, 0.02)
    wanted = time[5:-5] + 0.007
    for path, most in ((lambda t: np.sin(2.0 * t), 1e-5), (lambda t: zigzag(t, 2.0), 1e-12)):
        values = path(time)
        found = read_at(wanted, time, values, rate_of(values, time))
        assert np.max(np.abs(found - path(wanted))) < most
    straight = np.interp(wanted, time, np.sin(2.0 * time))
    assert np.max(np.abs(straight - np.sin(2.0 * wanted))) > 1e-4


def test_beyond_the_last_value_it_goes_straight_on() -> None:
    time, values = np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0, 4.0])
    found = read_at(np.array([-1.0, 0.0, 2.0, 2.5]), time, values, rate_of(values, time))
    assert found.tolist() == [1.0, 1.0, 4.0, 5.0]
    one = np.array([3.0])
    assert read_at(np.array([1.0]), np.array([0.0]), one, rate_of(one, np.array([0.0]))).tolist() == [3.0]


def test_two_rows_of_one_time_are_read_as_they_are() -> None:
    time, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0, 4.0])
    found = read_at(np.array([0.5, 1.0, 1.5]), time, values, rate_of(values, time))
    assert found.tolist() == [0.5, 3.0, 3.5]
