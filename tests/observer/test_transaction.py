"""A step either happened or it did not: what is refused leaves no trace, and what is good is taken afterwards."""

from __future__ import annotations

import copy
import pickle
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from observer_joints import joint, pull_unit

from cablecomp.config import JointConfig, load_joint
from cablecomp.effects import with_effects
from cablecomp.errors import InputError, InternalError
from cablecomp.observer import Observer, Refusal, SampleRefused
from cablecomp.signals import Estimate, Sample

JOINTS = sorted((Path(__file__).parents[2] / "configs" / "joints").glob("*.toml"))
EFFECTS = (
    ("bearing_friction", {"torque_Nm": 0.01, "load_coefficient": 0.01, "presliding_rad": 1e-3}),
    ("inertial_load", {"inertia_kgm2": 1e-4}),
    ("clock_skew", {"delay_s": 0.004}),
    ("strand_friction", {"fraction": 0.2, "yield_N": 2.0}),
    ("thermal_pretension", {"coefficient_per_K": 1e-3, "reference_degC": 20.0}),
)
STUCK = (("routing_friction", {"mu_angle": 0.05, "arc_length_m": 0.01}),)
LOOSE = (("strand_friction", {"fraction": 0.2, "yield_N": 2.0, "spread": 1.0}),)
WET = (("viscous_slip", {"coefficient_Ns_per_m_rad": 50.0}),)


def with_options(config: JointConfig, **options: object) -> JointConfig:
    return config.model_copy(update={"observer": config.observer.model_copy(update=options)})


def same(a: Estimate, b: Estimate) -> bool:
    """Equal to the last bit, unknowns included."""
    return np.array_equal(a, b, equal_nan=True)


def variants(config: JointConfig) -> Iterator[tuple[str, Observer]]:
    """Observers of one joint: as it is, bounded, filtered, with effects of every kind."""
    plain = with_effects(config, ())
    yield "plain", Observer(plain)
    yield "bounds", Observer(plain, bounds=True)
    yield "filter", Observer(with_options(plain, input_filter_Hz=40.0))
    yield "as shipped, bounds", Observer(config, bounds=True)
    yield "effects", Observer(with_effects(config, EFFECTS))
    yield "guide", Observer(with_effects(config, STUCK))
    yield "viscous", Observer(with_effects(config, WET))
    yield "loose", Observer(with_effects(config, LOOSE))


def walk(config: JointConfig, rng: np.random.Generator, count: int) -> list[Sample]:
    """Good samples: loads within half of what slackens a cable, the joint turning by half a radian either way."""
    time = 0.001 * np.arange(1, count + 1)
    ratio = config.drive.ratio
    motor = 0.5 / ratio * np.sin(9.0 * time + rng.uniform(0, 6))
    load = 0.5 * pull_unit(config) * np.sin(31.0 * time + rng.uniform(0, 6))
    return [
        Sample(t, q, m, q * ratio, temperature_degC=20.0 + 10.0 * t)
        for t, q, m in zip(time.tolist(), motor.tolist(), load.tolist(), strict=True)
    ]


def spoilt(good: Sample, config: JointConfig) -> list[Sample]:
    """The same sample, in ways in which no joint, or hardly one, can take it."""
    unit = pull_unit(config)
    far = 1.1 * max(s.wrap_output_rad + s.wrap_input_rad for s in config.drive.stage) / config.drive.ratio
    return [
        good._replace(joint_torque_Nm=nan),
        good._replace(motor_position_rad=inf),
        good._replace(time_s=nan),
        good._replace(time_s=-1.0),
        good._replace(temperature_degC=inf),
        good._replace(motor_position_rad=far),
        good._replace(motor_position_rad=-far),
        good._replace(motor_position_rad=1e300),
        *[good._replace(joint_torque_Nm=sign * size) for sign in (1.0, -1.0) for size in (1e4, 1e300)],
        *[good._replace(joint_torque_Nm=share * unit) for share in (80.0, -80.0, 1e3, -1e3)],
    ]


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_what_is_refused_leaves_no_trace(path: Path) -> None:
    config = load_joint(path)
    rng = np.random.default_rng(7)
    for name, observer in variants(config):
        samples = walk(config, rng, 60)
        twin = Observer(observer.config, bounds="bounds" in name)
        refusals = 0
        for k, good in enumerate(samples):
            for bad in spoilt(good, config) if k % 12 == 0 else []:
                before = observer.snapshot()
                try:
                    observer.step(bad)
                except SampleRefused:
                    refusals += 1
                    assert observer.snapshot() == before, f"{name}: {bad}"
                else:
                    observer.restore(before)
            assert same(observer.step(good), twin.step(good)), name
            observer.check_state()
        assert refusals >= 8 * 5, name
        assert observer.snapshot() == twin.snapshot(), name


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_a_peek_never_changes_the_state(path: Path) -> None:
    config = load_joint(path)
    for name, observer in variants(config):
        for k, good in enumerate(walk(config, np.random.default_rng(8), 6)):
            before = observer.snapshot()
            for sample in (good, *spoilt(good, config)):
                for ask in (observer.peek, observer.inverse):
                    with suppress(SampleRefused):
                        ask(sample)
                    assert observer.snapshot() == before, f"{name}, sample {k}: {sample}"
            observer.step(good)


def test_a_block_that_stops_has_taken_all_before_and_nothing_after() -> None:
    config = with_options(joint("closed"), input_filter_Hz=30.0)
    good = walk(config, np.random.default_rng(9), 40)
    columns = {
        "time_s": np.array([s.time_s for s in good]),
        "motor_position_rad": np.array([s.motor_position_rad for s in good]),
        "joint_torque_Nm": np.array([s.joint_torque_Nm for s in good]),
        "temperature_degC": np.array([s.temperature_degC for s in good]),
    }
    columns["joint_torque_Nm"][25] = 1e4
    block, single = Observer(config, bounds=True), Observer(config, bounds=True)
    with pytest.raises(SampleRefused, match="sample 25"):
        block.run(columns)
    for sample in good[:25]:
        single.step(sample)
    assert block.snapshot() == single.snapshot()
    assert same(block.step(good[25]), single.step(good[25]))


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_a_step_that_looks_ahead_is_the_step_and_the_look(path: Path) -> None:
    """Bit for bit, what is refused included; a look that would be refused is NaN."""
    config = load_joint(path)
    for name, observer in variants(config):
        twin, refusals, blind = Observer(observer.config, bounds="bounds" in name), 0, 0
        for k, good in enumerate(walk(config, np.random.default_rng(11), 30)):
            bad = spoilt(good, config)
            for sample in (good, bad[k % len(bad)]):
                ask = bad[(k + 7) % len(bad)] if k % 3 == 0 else good._replace(joint_torque_Nm=0.0)
                asked = sample.time_s + 1e-3, ask.motor_position_rad, ask.joint_torque_Nm
                try:
                    found, ahead = observer.step_ahead(sample, *asked)
                except SampleRefused as refusal:
                    refusals += 1
                    with pytest.raises(SampleRefused, match=re.escape(str(refusal))):
                        twin.step(sample)
                else:
                    assert same(found, twin.step(sample)), name
                    try:
                        assert ahead == twin.peek_deflection(*asked), name
                    except SampleRefused:
                        blind += 1
                        assert ahead != ahead
                assert observer.snapshot() == twin.snapshot(), name
        assert refusals >= 5, name
        assert blind >= 2, name


def test_reasons_are_typed() -> None:
    config = joint("closed", {"breaking_force_N": 80.0})
    observer = Observer(config)
    with pytest.raises(SampleRefused) as first:
        observer.peek_deflection(0.0, 0.0, 0.0)
    assert first.value.reason is Refusal.UNKNOWN
    observer.step(Sample(0.0, 0.0, 0.0))
    unit = pull_unit(config)
    for bad, reason in (
        (Sample(1.0, nan, 0.0), Refusal.NOT_FINITE),
        (Sample(-1.0, 0.0, 0.0), Refusal.BACKWARD),
        (Sample(1.0, 0.0, 1.5 * unit), Refusal.BREAKS),
        (Sample(1.0, 60.0, 0.0), Refusal.UNWOUND),
    ):
        with pytest.raises(SampleRefused) as refusal:
            observer.step(bad)
        assert (refusal.value.reason, refusal.value.time_s) == (reason, bad.time_s)
    # a cable that would break is no reason not to foretell what the load would do
    assert observer.peek(Sample(1.0, 0.0, 1.5 * unit)).tension_h_N > 80.0


def test_a_deflection_that_unwinds_a_drum_is_refused() -> None:
    config = load_joint(next(path for path in JOINTS if path.stem == "snow-closed-rig"))
    observer = Observer(config)
    observer.step(Sample(0.0, -8.99, 0.0))
    before = observer.snapshot()
    with pytest.raises(SampleRefused) as refusal:  # the load turns the joint by what is left on its drum
        observer.step(Sample(0.001, -8.99861, -1.75))
    assert refusal.value.reason is Refusal.UNWOUND
    assert observer.snapshot() == before
    observer.step(Sample(0.001, -8.99861, 0.0))
    observer.check_state()


@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_both_encoders_refuse_what_no_load_explains(circuit: str) -> None:
    """In an open circuit the joint angle ends where the cable goes slack: T = T0 + M/R -> 0."""
    config = with_options(joint(circuit, {"breaking_force_N": 400.0}), load="both_encoders")
    forward = Observer(joint(circuit))
    unit = pull_unit(config)
    shares = (0.3, -0.6, 2.0, -0.9)
    angles = [forward.step(Sample(float(k), 0.0, s * unit)).joint_position_rad for k, s in enumerate(shares)]
    observer = Observer(config)
    for k, (share, angle) in enumerate(zip(shares, angles, strict=True)):
        found = observer.step(Sample(float(k), 0.0, joint_position_rad=angle))
        assert found.joint_torque_Nm == pytest.approx(share * unit, rel=1e-9)
        before = observer.snapshot()
        for off in (-11.0, -1.0, -0.1, 1.0, 11.0, nan):
            asked = Sample(k + 0.5, 0.0, joint_position_rad=angle + off)
            if circuit == "closed" and off in (-0.1, 0.1):
                continue
            with pytest.raises(SampleRefused) as refusal:
                observer.step(asked)
            assert observer.snapshot() == before
            if circuit == "open" and off < 0.0:
                assert refusal.value.reason is Refusal.UNREACHABLE


def test_a_vector_is_checked_and_zeros_mean_that_nothing_is_known() -> None:
    config = joint("closed")
    observer, other = Observer(config), Observer(config)
    samples = walk(config, np.random.default_rng(3), 20)
    for sample in samples[:10]:
        observer.step(sample)
    vector = observer.vector()
    other.set_vector(vector)
    assert same(other.step(samples[10]), observer.step(samples[10]))
    before = other.snapshot()
    broken = vector.copy()
    broken[-2] = -231.0
    for bad in (broken, vector[:-1], vector + 0.5, vector[:0], vector[None]):
        with pytest.raises(InputError, match="no state"):
            other.set_vector(bad)
        assert other.snapshot() == before
    other.set_vector(np.zeros(len(vector)))
    assert same(other.step(samples[0]), Observer(config).step(samples[0]))


@pytest.mark.parametrize("time_s", [nan, inf, -inf])
def test_a_vector_of_no_time_is_no_state(time_s: float) -> None:
    config = joint("closed")
    observer, other = Observer(config), Observer(config)
    observer.step(Sample(0.25, 0.0, 0.1))
    other.step(Sample(0.5, 0.0, 0.2))
    before, vector = other.snapshot(), observer.vector()
    vector[-1] = time_s
    with pytest.raises(InputError, match="no state of the joint"):
        other.set_vector(vector)
    assert other.snapshot() == before
    other.set_vector(Observer(config).vector())  # of one that knows nothing: before any time
    assert other.snapshot() == Observer(config).snapshot()


def copied_by_pickle(observer: Observer) -> Observer:
    twin: Observer = pickle.loads(pickle.dumps(observer))
    return twin


@pytest.mark.parametrize("bounds", [False, True])
@pytest.mark.parametrize("copied", [Observer.copy, copy.copy, copy.deepcopy, copied_by_pickle])
def test_a_copy_goes_its_own_way(copied: Callable[[Observer], Observer], bounds: bool) -> None:
    config = joint("closed")
    observer = Observer(config, bounds=bounds)
    samples = walk(config, np.random.default_rng(6), 20)
    for sample in samples[:10]:
        observer.step(sample)
    before = observer.snapshot()
    twin = copied(observer)
    found = [twin.step_ahead(sample, sample.time_s, 0.0, 0.0) for sample in samples[10:]]
    assert observer.snapshot() == before != twin.snapshot()
    for (estimate, _), sample in zip(found, samples[10:], strict=True):
        assert same(estimate, observer.step(sample))


def test_an_impossible_state_is_told_and_no_snapshot_of_it_is_taken_up() -> None:
    config = joint("closed")
    poisoned, sound = Observer(config), Observer(config)
    for sample in walk(config, np.random.default_rng(4), 20):
        poisoned.step(sample)
        sound.step(sample)
    before = sound.snapshot()
    poisoned._joint.named.profiles[0, 1].y += 1e-3  # the first wrap's second point
    with pytest.raises(InternalError, match="profile 0"):
        poisoned.check_state()
    with pytest.raises(InputError, match="impossible state"):
        sound.restore(poisoned.snapshot())
    assert sound.snapshot() == before


def test_a_snapshot_brings_history_along_and_no_calibration() -> None:
    """Gain and offset of the load channel are the configuration's, whatever they were when it was taken."""
    config = load_joint(JOINTS[-1])
    sensors = config.sensors.model_copy(update={"joint_torque_gain": 1.25, "joint_torque_offset_Nm": 0.25})
    before, after = Observer(config), Observer(config.model_copy(update={"sensors": sensors}))
    samples = walk(config, np.random.default_rng(5), 40)
    for sample in samples[:30]:
        before.step(sample)
    after.restore(before.snapshot())
    for sample in samples[30:]:
        known = before.step(sample)
        read = after.step(sample._replace(joint_torque_Nm=1.25 * sample.joint_torque_Nm + 0.25))
        assert read.deflection_rad == pytest.approx(known.deflection_rad, abs=1e-12)
