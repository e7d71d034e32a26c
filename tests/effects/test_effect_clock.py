"""Clocks that disagree: readings that come late or early, and which of an instant counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import excitation, joint, run, still

from cablecomp.effects import extend, with_effects
from cablecomp.effects.compiled_term import term
from cablecomp.mechanics.assemble import assemble
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import Observer
from cablecomp.observer.compiled import CompiledJoint
from cablecomp.signals import Sample

JOINTS = ("snow-closed-rig", "snow-open-rig", "two-stage-series")


def late(columns: dict[str, np.ndarray], q: np.ndarray, delay: float) -> np.ndarray:
    return np.interp(columns["time_s"] - delay, columns["time_s"], q)


@pytest.mark.parametrize("delay", [1e-4, 0.004, 0.0503, 0.9])
def test_clock_skew_shifts_the_time_axis(delay: float) -> None:
    config = joint()
    uneven = np.cumsum(np.random.default_rng(3).uniform(0.0, 2.0 * 2.0 / 900, 900))
    columns = still(uneven, np.sin(5.0 * uneven), motor=0.4 * np.sin(2.6 * uneven))
    q = run(config, columns)["joint_position_rad"]
    found = run(config, columns, ("clock_skew", {"delay_s": delay}))["joint_position_rad"]
    # the past is kept at steps of a 200th of the delay: straight lines over these
    assert found == pytest.approx(late(columns, q, delay), abs=2e-5 * delay / 0.05 * np.ptp(q))


@pytest.mark.parametrize("since", [None, -40.0])
def test_a_clock_that_runs_slow_falls_back_ever_further(since: float | None) -> None:
    config = joint()
    columns = excitation(config, 3000)
    time = columns["time_s"]
    q = run(config, columns)["joint_position_rad"]
    law = {"delay_s": -0.002, "drift": 1e-3, **({} if since is None else {"drift_since_s": since})}
    found = run(config, columns, ("clock_skew", law))["joint_position_rad"]
    passed = time - (time[0] if since is None else since)
    delay = -0.002 + 1e-3 * passed
    behind = delay > 0.0  # early readings are met by going straight on
    expected = np.interp(time - delay, time, q)
    effect = np.max(np.abs(q - expected))
    assert effect > 1e-4
    assert found[behind] == pytest.approx(expected[behind], abs=0.01 * effect)


def test_a_late_encoder_is_exact_where_every_sample_is_kept() -> None:
    config = joint()
    columns = excitation(config, 300)
    q = run(config, columns)["joint_position_rad"]
    found = run(config, columns, ("clock_skew", {"delay_s": 0.031}))["joint_position_rad"]
    assert found == pytest.approx(late(columns, q, 0.031), abs=1e-12)


def test_an_early_encoder_is_met_by_going_straight_on() -> None:
    config = joint()
    time = np.linspace(0.0, 1.0, 400)
    columns = still(time, np.zeros(400), motor=0.7 * time)
    found = run(config, columns, ("clock_skew", {"delay_s": -0.02}))["joint_position_rad"]
    assert found[30:] == pytest.approx(0.7 * (time[30:] + 0.02), abs=1e-12)
    smooth = excitation(config, 2000)
    q = run(config, smooth)["joint_position_rad"]
    error = run(config, smooth, ("clock_skew", {"delay_s": -0.01}))["joint_position_rad"] - late(
        smooth, q, -0.01
    )
    acceleration = np.abs(np.gradient(np.gradient(q, smooth["time_s"]), smooth["time_s"])).max()
    assert np.abs(error[20:-20]).max() <= 1.1 * acceleration * 0.01**2


@pytest.mark.parametrize("moving", [0.0, 0.4])
def test_a_late_torque_is_met_by_carrying_the_deflection_on(moving: float) -> None:
    """What a torque read late makes of the joint, against the joint under the torque as it was."""
    config, delay = joint(), 0.05
    time = np.linspace(0.0, 16.0, 3200)

    def load(at: np.ndarray) -> np.ndarray:
        """To and fro evenly: it has corners."""
        return np.asarray(1.2 * np.arcsin(np.sin(1.6 * at)))

    motor = moving * np.sin(1.2 * time)
    true = run(config, still(time, load(time), motor=motor))["joint_position_rad"]
    columns = still(time, load(time - delay), motor=motor)
    plain = run(config, columns)["joint_position_rad"]
    late_load = ("clock_skew", {"delay_s": 0.0, "load_delay_s": delay})
    found = run(config, columns, late_load)["joint_position_rad"]
    later = time > 4.0
    assert np.std((found - true)[later]) < 0.4 * np.std((plain - true)[later])
    assert found[later] == pytest.approx(true[later], abs=1.2 * np.abs(plain - true)[later].max())


def test_a_late_torque_leaves_nothing_where_the_load_rests() -> None:
    """No corner of the torque leaves a bump that was not there."""
    config = joint()
    time = np.linspace(0.0, 3.0, 600)
    columns = still(time, np.minimum(5.0 * time, 1.0))
    found = run(config, columns, ("clock_skew", {"delay_s": 0.0, "load_delay_s": 0.05}))["joint_position_rad"]
    plain = run(config, columns)["joint_position_rad"]
    assert found[time > 0.3] == pytest.approx(plain[time > 0.3], abs=1e-14)
    assert np.abs(found - plain)[time < 0.2].max() > 1e-5


def test_a_delay_of_the_torque_may_be_left_out() -> None:
    config = joint()
    columns = excitation(config, 300)
    both = {"delay_s": 0.02, "load_delay_s": 0.0}
    one, two = (
        run(config, columns, ("clock_skew", v))["joint_position_rad"] for v in ({"delay_s": 0.02}, both)
    )
    assert np.array_equal(one, two)


def test_a_resting_joint_does_not_show_its_clock() -> None:
    config = joint()
    time = np.linspace(0.0, 1.0, 200)
    load = np.minimum(5.0 * time, 1.0)
    found = run(config, still(time, load), ("clock_skew", {"delay_s": 0.05}))["joint_position_rad"]
    plain = run(config, still(time, load))["joint_position_rad"]
    assert found[time > 0.3] == pytest.approx(plain[time > 0.3], abs=1e-14)
    assert np.abs(found - plain)[time < 0.2].max() > 1e-5


def test_late_readings_contain_what_the_other_effects_add() -> None:
    config = joint()
    columns = excitation(config, 300)
    mount = ("series_compliance", {"compliance_rad_per_Nm": 5e-3})
    q = run(config, columns, mount)["joint_position_rad"]
    found = run(config, columns, ("clock_skew", {"delay_s": 0.02}), mount)["joint_position_rad"]
    assert found == pytest.approx(late(columns, q, 0.02), abs=1e-12)


def test_samples_of_one_instant_replace_each_other() -> None:
    config = with_effects(joint(), [("clock_skew", {"delay_s": 0.01})])
    observer = Observer(config)
    for time in (0.0, 0.01, 0.01, 0.01, 0.02):
        last = observer.step(Sample(time, 0.1 * time, 0.0))
    assert last.joint_position_rad == pytest.approx(0.001, abs=1e-12)


def test_a_refused_sample_leaves_no_trace_in_what_a_late_encoder_remembers() -> None:
    """Rings are not put back: what a refused sample has written to them is never read."""

    @term(parameters=("from_s", "to_s"))
    def refusing(c, p, s):  # type: ignore[no-untyped-def]  # the kernel gives them their types
        if c.commit and p.from_s < c.time < p.to_s:
            c.reading = np.nan

    config = joint()
    late = extend(with_effects(config, [("clock_skew", {"delay_s": 0.02})]))
    time = np.sort(np.append(np.linspace(0.0, 2.0, 1000), np.linspace(0.5, 1.5, 400)))
    time = np.repeat(time, 1 + np.arange(len(time)) % 2)  # some of one instant
    motor = np.sin(5.0 * time + 0.2 * np.random.default_rng(1).standard_normal(len(time)))

    window = (time > 0.7) & (time < 0.9)

    def angles(ends: tuple[float, float], taken: np.ndarray) -> np.ndarray:
        terms = (*late.terms, *refusing(from_s=ends[0], to_s=ends[1]))
        found = CompiledJoint(assemble(config, replace(late, terms=terms)), 0)
        found.start(0.0, 0.0)
        answers = []
        for k in np.flatnonzero(taken):
            found.put_sample(time[k], motor[k], 0.0, np.nan, np.nan)
            if found.step(True)[1] == STATUS_OK:
                answers.append(found.joint[0])
        return np.array(answers)

    found = angles((0.7, 0.9), np.full(len(time), True))
    assert len(found) == np.sum(~window) < len(time)
    assert np.array_equal(found, angles((9.0, 9.0), ~window))
