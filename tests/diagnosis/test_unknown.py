"""Laws of describing the unknown: memory, period, parity, path, events, and equations that are written
down right.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from planted import SIGMA, autoregressive, recording

from cablecomp.diagnosis.describe.memory import lagged, play
from cablecomp.diagnosis.describe.periodic import Periodicity, which_angle
from cablecomp.diagnosis.describe.unknown import Description, describe
from cablecomp.diagnosis.locate.series import make_series
from cablecomp.signal.smoothing import FloatArray

START = np.zeros(1, dtype=np.int64)


def described(kind: str, cause: str) -> Description:
    found = recording(kind)[1]
    rng = np.random.default_rng(7)
    shape = shapes(kind)[cause]
    noise = SIGMA * rng.standard_normal(found.samples) + autoregressive(rng, found.samples, 60.0, 0.4 * SIGMA)
    residual = 3.0 * SIGMA * (shape - shape.mean()) / np.std(shape) + noise
    return describe(make_series(residual, SIGMA, found), np.random.default_rng(1), ratio=1.0)


@cache
def shapes(kind: str) -> dict[str, FloatArray]:
    given, found = recording(kind)
    v = found.values
    load, motor = v["load"], given["motor_position_rad"]
    return {
        "square": load**2,
        "friction": v["load_direction"] * np.abs(load),
        "turn": found.motion_direction,
        "lag": load - lagged(load, v["time"], 0.6, found.starts),
        "play": load - play(load, 0.4, found.starts),
        "wave": np.sin(17.0 * motor + 1.0),
        "jump": (v["time"] > 22.0) * 1.0,
        "creep": v["load_direction"] * np.exp(-v["dwell"] / 0.4),
    }


def test_a_square_of_the_load_is_read_off() -> None:
    found = described("sweep", "square")
    assert found.memory == "memoryless"
    assert found.parity == "even"
    assert found.law is not None
    assert [term.symbol for term in found.law.terms] == ["1", "M²"]
    exact = 3.0 * SIGMA / np.std(shapes("sweep")["square"])
    term = found.law.terms[1]
    assert abs(term.coefficient - exact) < 4.0 * term.sd
    assert "rad/(N·m)² M²" in found.law.equation


@pytest.mark.parametrize("cause", ["square", "wave"])
def test_how_large_a_remainder_is_is_said_once_and_not_by_its_description(cause: str) -> None:
    """Errors are weighed by the time that rows stand for; the description looks at rows."""
    assert "RMS" not in described("sweep", cause).text


@pytest.mark.parametrize(("cause", "path"), [("friction", "load"), ("turn", "displacement")])
def test_what_is_odd_in_direction_is_called_odd_and_its_path_told(cause: str, path: str) -> None:
    found = described("sweep", cause)
    assert found.parity == "odd"
    assert found.path == path
    assert found.law is not None
    assert found.law.heldout_gain > 0.7


@pytest.mark.parametrize(
    ("kind", "cause", "memory"),
    [
        ("sweep", "lag", "remembers time"),
        ("hold", "creep", "remembers time"),
        ("sweep", "play", "remembers motion"),
    ],
)
def test_memory_is_told_from_present_values(kind: str, cause: str, memory: str) -> None:
    assert described(kind, cause).memory == memory


def test_a_period_is_found_with_its_harmonic() -> None:
    found = described("sweep", "wave")
    assert found.period is not None
    assert found.period.cycles == pytest.approx(17.0, abs=0.1)
    assert found.period.amplitude == pytest.approx(3.0 * SIGMA * np.sqrt(2.0), rel=0.1)
    assert (
        found.period_in == "either"
    )  # one to one drive: motor and joint angle are the same but for the deflection
    assert "17 times per revolution" in found.text


def test_an_event_is_dated() -> None:
    found = described("sweep", "jump")
    assert found.events_s == pytest.approx((22.0,), abs=0.1)


def test_noise_has_no_law_and_no_pattern() -> None:
    given = recording("sweep")[1]
    for trial in range(2):
        rng = np.random.default_rng(trial)
        residual = SIGMA * rng.standard_normal(given.samples) + autoregressive(
            rng, given.samples, 40.0, SIGMA
        )
        found = describe(make_series(residual, SIGMA, given), rng)
        assert found.law is None
        assert found.period is None


def test_whole_cycles_decide_between_motor_and_joint() -> None:
    def entry(angle: str, cycles: float, share: float) -> Periodicity:
        return Periodicity(angle, False, cycles, 0.2, 1e-4, 0.0, share, 0.001)

    close = [entry("motor_angle", 4.0, 0.80), entry("joint_angle", 9.6, 0.81)]
    assert which_angle(close, 2.4) == "motor_angle"
    assert which_angle(close, 1.0) == "either"
    assert which_angle([entry("motor_angle", 4.0, 0.3), entry("joint_angle", 9.6, 0.8)], 2.4) == "joint_angle"
    assert which_angle([], 2.4) == "either"


def test_a_lag_decays_exactly_over_uneven_steps() -> None:
    time = np.array([0.0, 0.1, 0.4, 1.5])
    step = np.array([0.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(lagged(step, time, 0.5, START), 1.0 - np.exp(-time / 0.5))


def test_a_play_wipes_out_small_swings() -> None:
    swing = np.array([0.0, 1.0, 0.7, 1.0, 0.0, 1.0])
    out = play(swing, 0.2, START)
    np.testing.assert_allclose(out, [0.0, 0.8, 0.8, 0.8, 0.2, 0.8])
