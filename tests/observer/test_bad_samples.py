"""What the observer refuses, and how it says so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from observer_joints import joint, pull_unit

from cablecomp.config import EffectEntry
from cablecomp.errors import InputError
from cablecomp.mechanics.start import joint_start
from cablecomp.observer import Observer
from cablecomp.signals import Sample


def columns(load: np.ndarray, motor: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """A block of samples, one second apart."""
    still = np.zeros(len(load)) if motor is None else motor
    return {"time_s": np.arange(float(len(load))), "motor_position_rad": still, "joint_torque_Nm": load}


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_a_load_that_is_no_number(bad: float) -> None:
    load = np.array([0.0, 0.1, bad, 0.2])
    with pytest.raises(InputError, match=r"sample 2: at 2 s has no finite"):
        Observer(joint("closed")).run(columns(load))
    with pytest.raises(InputError, match="no finite"):
        Observer(joint("closed")).step(Sample(0.0, 0.0, bad))


def test_time_that_runs_backwards() -> None:
    observer = Observer(joint("closed"))
    observer.step(Sample(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="time must not run backwards"):
        observer.step(Sample(0.5, 0.0, 0.0))


def test_a_load_that_slackens_an_open_circuit() -> None:
    config = joint("open")
    with pytest.raises(InputError, match="slacken"):
        Observer(config).run(columns(np.array([0.0, -1.1 * pull_unit(config)])))


def test_wrap_used_up_by_rotation() -> None:
    config = joint("closed", {"wrap_output_rad": 2.0})
    motor = np.linspace(0.0, 2.2 * 0.04 / 0.015, 50)
    with pytest.raises(InputError, match="runs out of cable"):
        Observer(config).run(columns(np.zeros(50), motor))


def test_a_load_beyond_what_the_cable_carries() -> None:
    config = joint("closed", {"breaking_force_N": 80.0})
    load = np.linspace(0.0, 1.5 * pull_unit(config), 20)
    with pytest.raises(InputError, match="times its breaking force"):
        Observer(config).run(columns(load))


def test_a_filter_follows_a_ramp_without_lag_and_calms_noise() -> None:
    config = joint("closed", observer={"input_filter_Hz": 20.0})
    plain = joint("closed")
    rng = np.random.default_rng(5)
    time = 0.001 * np.arange(3000)
    ramp = 0.3 * pull_unit(config) * time
    block = {"time_s": time, "motor_position_rad": np.zeros(3000), "joint_torque_Nm": ramp}
    a, b = Observer(config).run(block)["deflection_rad"], Observer(plain).run(block)["deflection_rad"]
    assert np.max(np.abs(a - b)[200:]) < 1e-3 * np.ptp(b)
    noisy = {**block, "joint_torque_Nm": ramp + 0.01 * pull_unit(config) * rng.standard_normal(3000)}
    calm = Observer(config).run(noisy)["deflection_rad"] - b
    raw = Observer(plain).run(noisy)["deflection_rad"] - b
    assert np.std(calm[200:]) < 0.5 * np.std(raw[200:])


@pytest.mark.parametrize("share", [0.88, 0.9, 0.93, 0.96, 0.99])
def test_friction_that_slackens_an_open_circuit_says_so(share: float) -> None:
    """Load and friction together are more than T0 holds; either alone is less."""
    plain = joint("open")
    unit, friction = pull_unit(plain), 0.13
    shape = {"presliding_rad": 1.5e-4, "load_coefficient": 0.0}
    bearing = {"id": "bearing_friction", "torque_Nm": friction * unit, **shape}
    config = plain.model_copy(update={"effect": [EffectEntry.model_validate(bearing)]})
    load, motor = np.full(200, -share * unit), 0.002 * np.arange(200.0)
    assert Observer(plain).run(columns(load, motor))["deflection_rad"].shape == (200,)
    with pytest.raises(InputError, match="slacken"):
        Observer(config).run(columns(load, motor))


@pytest.mark.parametrize(
    ("breaking_force_N", "absurd_degC"),
    [(1500.0, 1e3), (1500.0, 1e18), (None, 1e6), (None, 1e18), (None, 1e300)],
)
def test_a_temperature_that_no_cable_bears_is_refused_with_the_sample_that_says_it(
    breaking_force_N: float | None, absurd_degC: float
) -> None:
    """A pretension acts a sample later: what is let in would have every later sample refused, and roll back each one
    that would mend it."""
    config = joint("closed", {} if breaking_force_N is None else {"breaking_force_N": breaking_force_N})
    thermal = {"id": "thermal_pretension", "coefficient_per_K": 0.05, "reference_degC": 20.0}
    config = config.model_copy(update={"effect": (EffectEntry.model_validate(thermal),)})
    load = 0.1 * pull_unit(config) * np.sin(0.05 * np.arange(60.0))
    observer, unspoilt = Observer(config), Observer(config)
    refused = []
    for k, torque in enumerate(load.tolist()):
        sample = Sample(1e-3 * k, 0.0, torque, temperature_degC=absurd_degC if k == 20 else 25.0)
        if k != 20:
            unspoilt.step(sample)
        try:
            observer.step(sample)
        except InputError:
            refused.append(k)
    assert refused == [20]
    assert observer.snapshot() == unspoilt.snapshot()


def test_a_temperature_that_creeps_up_to_what_breaks_a_cable_leaves_the_way_back() -> None:
    config = joint("closed", {"breaking_force_N": 1500.0})
    thermal = {"id": "thermal_pretension", "coefficient_per_K": 0.05, "reference_degC": 20.0}
    config = config.model_copy(update={"effect": (EffectEntry.model_validate(thermal),)})
    observer, refused = Observer(config), []
    rises = 20.0 + np.concatenate([np.linspace(0.0, 1000.0, 2000), np.zeros(10)])
    for k, warm in enumerate(rises.tolist()):
        try:
            observer.step(Sample(1e-3 * k, 0.0, 0.0, temperature_degC=warm))
        except InputError:
            refused.append(k)
    assert refused
    assert refused == list(range(refused[0], 2000))


def test_a_stiffness_before_the_first_sample_is_of_no_direction() -> None:
    observer = Observer(joint("closed"))
    with pytest.raises(InputError, match="no sample has been taken yet"):
        observer.stiffness()
    observer.step(Sample(0.0, 0.0, 0.0))
    observer.step(Sample(0.1, 0.0, 0.1))
    assert observer.stiffness() > 0.0


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (Sample(0.1, 0.0, None), "joint_torque_Nm is None"),  # type: ignore[arg-type]  # wrong on purpose
        (Sample(0.1, "0.0", 0.0), "motor_position_rad is '0.0'"),  # type: ignore[arg-type]  # wrong on purpose
        (Sample(0.1, 0.0, 0.0, other=None), "other is None"),  # type: ignore[arg-type]  # wrong on purpose
        ([*Sample(0.1, 0.0, 0.0)], "not list"),
        ((0.1, 0.0, 0.0), "not tuple"),
    ],
)
def test_what_holds_no_numbers_is_told_by_name_and_leaves_no_trace(bad: Sample, words: str) -> None:
    gauge = {"id": "crosstalk", "channel": "other_gauge", "load_coefficient": 1e-3}
    config = joint("closed").model_copy(update={"effect": (EffectEntry.model_validate(gauge),)})
    observer = Observer(config)
    for _ in range(2):  # before the first sample, and after it
        before = observer.snapshot()
        for ask in (observer.step, observer.peek, lambda bad: observer.step_ahead(bad, 0.2, 0.0, 0.0)):
            with pytest.raises(InputError, match=f"^sample: .*{words}"):
                ask(bad)
            assert observer.snapshot() == before
        observer.step(Sample(0.0, 0.0, 0.0, other=(0.0,)))


def test_a_look_ahead_at_no_number_leaves_no_trace() -> None:
    observer = Observer(joint("closed"))
    unknown = observer.snapshot()
    with pytest.raises(InputError, match="joint_torque_Nm is None"):
        observer.step_ahead(Sample(0.0, 0.0, 0.0), 0.1, 0.0, None)  # type: ignore[arg-type]  # wrong on purpose
    assert observer.snapshot() == unknown
    observer.step(Sample(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="time_s is None"):
        observer.peek_deflection(None, 0.0, 0.0)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize("kind", [np.int16, np.float32, np.array])
def test_numbers_of_any_kind_give_the_same_answer(kind: Callable[[float], float]) -> None:
    """In full: a rigid angle in half the digits would cost the deflection more than it holds."""
    plain, other = Observer(joint("closed")), Observer(joint("closed"))
    other.compile()
    before = len(joint_start.signatures)
    for time, motor, load in ((0.0, 0.0, 0.0), (1.0, 3.0, 1.0), (2.0, -1.0, 0.0)):
        known = plain.step(Sample(time, motor, load))
        found = other.step(Sample(kind(time), kind(motor), kind(load)))
        assert np.array_equal(found, known, equal_nan=True)
        assert type(found.deflection_rad) is float
    assert type(other.peek_deflection(3.0, kind(1.0), 0.0)) is float
    assert len(joint_start.signatures) == before  # a loop does not wait for a compiler


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"motor_position_rad": None}, "`motor_position_rad` is missing"),
        ({"time_s": None}, "`time_s` is missing"),
        ({"motor_position_rad": np.zeros(1)}, r"`motor_position_rad` has the shape \(1,\)"),
        ({"joint_torque_Nm": np.zeros((4, 1))}, r"`joint_torque_Nm` has the shape \(4, 1\)"),
        ({"temperature_degC": np.zeros(3)}, "`temperature_degC` has the shape"),
        ({"joint_position_rad": ["high"] * 4}, "`joint_position_rad` holds what is no number"),
        ({"time_s": 1.0}, "`time_s` has the shape"),
    ],
)
def test_a_block_holds_one_number_of_each_channel_for_each_time(
    changed: dict[str, np.ndarray | None], words: str
) -> None:
    observer = Observer(joint("closed"))
    before = observer.snapshot()
    block = {k: v for k, v in (columns(np.zeros(4)) | changed).items() if v is not None}
    with pytest.raises(InputError, match=words):
        observer.run(block)
    assert observer.snapshot() == before


def test_a_joint_is_a_configuration() -> None:
    with pytest.raises(InputError, match="`config` is a str; give a JointConfig"):
        Observer("capstan-arm")  # type: ignore[arg-type]  # wrong on purpose
