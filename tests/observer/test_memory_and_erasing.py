"""Memory stays bounded and its error accounted for; history can be erased as planned; a snapshot loses nothing."""

from __future__ import annotations

from hashlib import sha256
from math import inf, nan
from pathlib import Path
from struct import pack

import numpy as np
import pytest
from joints import WIDE
from observer_joints import joint, pull_unit

from cablecomp.config import JointConfig, Limits, parse_joint
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.observer.erase import excitation, plan_erase
from cablecomp.signals import Sample


def wandering(seed: int, samples: int, unit: float) -> dict[str, np.ndarray]:
    """Both pulleys turning and a load that wanders."""
    rng = np.random.default_rng(seed)
    time = 0.01 * np.arange(samples)
    load = 0.8 * unit * np.sin(1.3 * time + rng.uniform(0, 6)) * np.cos(0.37 * time)
    motor = 1.2 * np.sin(0.7 * time) + 0.6 * np.sin(2.3 * time + rng.uniform(0, 6))
    return {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load + 0.02 * unit * rng.standard_normal(samples),
    }


def test_memory_is_bounded_and_the_stated_error_bounds_what_merging_does() -> None:
    exact = joint("closed", observer={"max_pieces": 4096, "merge_tolerance": 1e-13})
    small = joint("closed", observer={"max_pieces": 48, "merge_tolerance": 1e-5})
    columns = wandering(1, 6000, pull_unit(exact))
    a, b = Observer(exact), Observer(small)
    truth, merged = a.run(columns), b.run(columns)
    assert b.pieces() <= 4 * 48
    error = abs(truth["deflection_rad"][-1] - merged["deflection_rad"][-1])
    assert 0.0 < error <= b.merge_error_rad()
    assert np.max(np.abs(truth["deflection_rad"] - merged["deflection_rad"])) < 1e-3 * np.ptp(
        truth["deflection_rad"]
    )


def test_pieces_do_not_grow_with_the_length_of_the_run() -> None:
    config = joint("closed", observer={"max_pieces": 192, "merge_tolerance": 1e-6})
    observer = Observer(config)
    counts = []
    for part in range(8):
        columns = wandering(part, 20000, pull_unit(config))
        observer.run({**columns, "time_s": columns["time_s"] + 200.0 * part})
        counts.append(observer.pieces())
    assert max(counts) <= 4 * 192
    assert counts[-1] < 2 * max(counts[:2])


def test_a_snapshot_continues_bit_for_bit_and_a_peek_leaves_no_trace(tmp_path: Path) -> None:
    config = joint("closed")
    columns = wandering(3, 400, pull_unit(config))
    first = {key: value[:200] for key, value in columns.items()}
    rest = {key: value[200:] for key, value in columns.items()}
    observer = Observer(config)
    observer.run(first)
    observer.save(tmp_path / "joint.snapshot")
    before = observer.snapshot()
    observer.peek(Sample(2.5, 0.3, 0.7 * pull_unit(config)))
    assert observer.snapshot() == before
    other = Observer(config)
    other.load(tmp_path / "joint.snapshot")
    assert np.array_equal(observer.run(rest)["deflection_rad"], other.run(rest)["deflection_rad"])


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "damaged"),
        (lambda data: b"nonsense" + data[8:], "none of ours"),
        (lambda data: data[:30], "none of ours"),
    ],
)
def test_a_spoiled_snapshot_is_one_line(spoil, words: str) -> None:  # type: ignore[no-untyped-def]  # a lambda
    observer = Observer(joint("closed"))
    observer.step(Sample(0.0, 0.0, 0.1))
    with pytest.raises(InputError, match=words):
        Observer(joint("closed")).restore(spoil(observer.snapshot()))
    with pytest.raises(InputError, match="another joint"):
        Observer(joint("closed", {"mu_output": 0.2})).restore(observer.snapshot())


@pytest.mark.parametrize("length", [28, 33, 36, 40, 100, -1])
def test_a_snapshot_cut_short_and_sealed_anew_is_one_line(length: int) -> None:
    observer = Observer(joint("closed"))
    observer.step(Sample(0.0, 0.0, 0.1))
    body = observer.snapshot()[:-32][:length]
    with pytest.raises(InputError, match="more or less than its joint's state"):
        Observer(joint("closed")).restore(body + sha256(body).digest())


@pytest.mark.parametrize(("of", "time_s"), [(0, 5.0), (1, nan), (1, inf), (1, -inf), (1, 5.0)])
def test_a_snapshot_whose_time_is_not_its_states_is_not_taken_up(of: int, time_s: float) -> None:
    observers = Observer(joint("closed")), Observer(joint("closed"))
    observers[1].step(Sample(1.0, 0.0, 0.1))
    body = observers[of].snapshot()[:-32]
    body = body[:28] + pack("<d", time_s) + body[36:]
    with pytest.raises(InputError, match="impossible state"):
        observers[1].restore(body + sha256(body).digest())
    observers[1].step(Sample(1.5, 0.0, 0.1))


def test_a_snapshot_is_bytes_of_any_kind_and_its_file_a_path_of_any_kind(tmp_path: Path) -> None:
    observer, other = Observer(joint("closed")), Observer(joint("closed"))
    observer.step(Sample(0.0, 0.0, 0.1))
    observer.save(str(tmp_path / "joint.snapshot"))
    other.load(str(tmp_path / "joint.snapshot"))
    other.restore(memoryview(observer.snapshot()))
    assert other.snapshot() == observer.snapshot()
    for none in (None, "joint.snapshot"):
        with pytest.raises(InputError, match="the bytes of"):
            other.restore(none)  # type: ignore[arg-type]  # wrong on purpose


def test_the_planned_swing_erases_and_a_smaller_one_does_not() -> None:
    config = joint("closed")
    unit = pull_unit(config)
    limits = Limits(joint_torque_max_Nm=1.5 * unit, motor_position_min_rad=-3.0, motor_position_max_rad=3.0)
    known = Observer(config)
    known.run(
        {
            "time_s": np.arange(80.0),
            "motor_position_rad": np.zeros(80),
            "joint_torque_Nm": np.concatenate(
                [np.linspace(0, 0.9 * unit, 40), np.linspace(0.9 * unit, 0.1 * unit, 40)]
            ),
        }
    )
    plan = plan_erase(known, 79.0, 0.0, 0.1 * unit, limits)
    assert plan.possible
    # what a swing up to the old peak wipes out (return-point memory), no more is needed
    assert plan.load_swing_Nm == pytest.approx(0.9 * unit, rel=0.02)
    fresh = Observer(config)
    fresh.step(Sample(79.0, 0.0, 0.1 * unit))
    columns = excitation((79.0, 0.0, 0.1 * unit), 1.02 * plan.load_swing_Nm, plan.first, turn=False)
    a, b = known.run(columns)["deflection_rad"][-1], fresh.run(columns)["deflection_rad"][-1]
    assert abs(a - b) < 1e-12


def test_no_turn_beyond_the_motor_s_limits_is_planned() -> None:
    """It goes as far to either side, and so no farther than the nearer limit."""
    config = joint("closed")
    known = Observer(config)
    known.step(Sample(0.0, 0.0, 0.1))
    for low, high, most in ((-0.5, 3.0, 0.5), (None, 0.25, 0.25)):
        limits = Limits(joint_torque_max_Nm=1.0, motor_position_min_rad=low, motor_position_max_rad=high)
        plan = plan_erase(known, 0.0, 0.0, 0.1, limits)
        assert plan.turn_limit_rad == most
        assert plan.motor_turn_rad <= most or plan.motor_turn_rad == np.inf


def once_loaded(config: JointConfig) -> Observer:
    """Loaded to half of R T0 and unloaded again in 40 s, at motor angle 0."""
    load = 0.5 * pull_unit(config) * (1.0 - np.abs(np.linspace(-1.0, 1.0, 41)))
    known = Observer(config)
    known.run({"time_s": np.arange(41.0), "motor_position_rad": np.zeros(41), "joint_torque_Nm": load})
    return known


def test_a_turn_without_load_erases_when_it_has_unwound_the_bump() -> None:
    """There the deflection that histories are compared over is next to none; (2-74) in its general form."""
    config = joint("open", {"input_radius_m": 0.04})
    limits = Limits(joint_torque_max_Nm=0.1, motor_position_min_rad=-5.0, motor_position_max_rad=5.0)
    plan = plan_erase(once_loaded(config), 40.0, 0.0, 0.0, limits)
    assert plan.motor_turn_rad == pytest.approx(np.log(1.5) / 0.12, rel=0.01)


def test_limits_beyond_what_the_joint_can_take_hide_nothing_that_erases() -> None:
    """The cable of an open circuit hangs slack at -R T0, and a drum is unwound within a turn of the motor; (3-22)."""
    config = joint("open", {"input_radius_m": 0.04, "wrap_output_rad": 5.0, "wrap_input_rad": 5.0})
    unit = pull_unit(config)
    plan = plan_erase(once_loaded(config), 40.0, 0.0, 0.0, Limits(joint_torque_max_Nm=2.0 * unit))
    assert plan.load_swing_Nm == pytest.approx(0.5 / 1.5 * unit, rel=1e-3)
    assert plan.motor_turn_rad < 5.0


def test_erasing_says_what_it_needs() -> None:
    config = parse_joint(
        {"schema": 1, "name": "bare", "drive": {"circuit": "closed", "stage": [WIDE]}}, "test"
    )
    with pytest.raises(InputError, match="joint_torque_max_Nm"):
        plan_erase(Observer(config), 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ((nan, 0.0, 0.0), "no finite"),
        ((1.0, nan, 0.0), "no finite"),
        ((1.0, 0.0, inf), "no finite"),
        ((0.0, 0.0, 0.0), "backwards"),
        ((1.0, 1e3, 0.0), "runs out of cable"),
        ((1.0, 0.0, None), "joint_torque_Nm is None"),
    ],
)
def test_nothing_is_planned_from_where_the_joint_cannot_be(
    at: tuple[float, float, float], words: str
) -> None:
    observer = Observer(joint("closed", limits={"joint_torque_max_Nm": 1.0}))
    observer.step(Sample(0.5, 0.0, 0.0))
    with pytest.raises(InputError, match=words):
        plan_erase(observer, *at)


@pytest.mark.parametrize("load", ["motor_torque", "both_encoders", "none"])
def test_a_plan_does_not_ask_where_the_load_is_known_from(load: str) -> None:
    limits = {"joint_torque_max_Nm": 1.0}
    told = Observer(joint("closed", limits=limits))
    finds = Observer(joint("closed", limits=limits, observer={"load": load}))
    told.step(Sample(0.0, 0.0, 0.0))
    finds.step(Sample(0.0, 0.0, 0.0, 0.0, 0.0))
    plan = plan_erase(finds, 0.1, 0.0, 0.2)
    assert plan.possible
    assert plan == plan_erase(told, 0.1, 0.0, 0.2)
