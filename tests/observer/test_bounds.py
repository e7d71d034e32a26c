"""Guaranteed bounds contain every history that friction admits, and close where they must."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as some
from observer_joints import joint, knots, pull_unit, run

from cablecomp.config import JointConfig
from cablecomp.observer import Observer

SHORT = {"wrap_output_rad": 5.0, "wrap_input_rad": 5.0, "input_radius_m": 0.04, "free_length_m": 0.01}
CHAIN = {"output_radius_m": 0.03, "input_radius_m": 0.012, "pretension_N": 30.0}
JOINTS = {
    "open": joint("open"),
    "closed": joint(),
    "closed, short wraps": joint("closed", {**SHORT, "mu_output": 0.08, "mu_input": 0.08}),
    "open, two stages": joint("open", CHAIN, {}),
    "closed chains": joint("closed", CHAIN, {}, arrangement="parallel"),
    "closed in series": joint("closed", {**SHORT, "mu_output": 0.05, "mu_input": 0.05}, SHORT),
    "with effects": joint(
        effect=[
            {"id": "series_compliance", "compliance_rad_per_Nm": 1e-3},
            {"id": "nonlinear_cable", "stiffening": 0.3},
            {"id": "pretension_relaxation", "fraction": 0.02, "time_constant_s": 0.05},
        ]
    ),
}
shares = some.lists(some.floats(-1.0, 1.0), min_size=4, max_size=9)
STILL = [0.0] * 4
HELD = [-1.0, 0.75, *[0.0] * 10]
"""At an even load a solver stops a billionth of T0 short, row by row: the angle of short wraps goes by 1.6e-11 rad."""


def span(config: JointConfig) -> float:
    """Greatest load of the tests; an open circuit's cable must stay tight."""
    return (0.8 if config.drive.circuit == "open" else 1.9) * pull_unit(config)


@pytest.mark.parametrize("name", JOINTS)
@settings(max_examples=25, deadline=None)
@given(
    before=shares, after=shares, turns_before=shares, turns=shares, turning=some.sampled_from([0.0, 0.2, 1.5])
)
@example(before=STILL, after=HELD, turns_before=STILL, turns=STILL, turning=0.0)
def test_truth_lies_within(
    name: str,
    before: list[float],
    after: list[float],
    turns_before: list[float],
    turns: list[float],
    turning: float,
) -> None:
    config = JOINTS[name]
    true, bounded = Observer(config), Observer(config, bounds=True)
    past, load = span(config) * knots(before), span(config) * knots(after)
    q = turning * knots(np.resize(turns, len(after)))
    q_past = turning * knots(np.resize(turns_before, len(before)))
    q_past[-1] = q[0]
    run(true, past, q_past)
    truth = run(true, load, q, 10.0)["deflection_rad"]
    seen = run(bounded, load, q, 10.0)
    low, high = seen["deflection_low_rad"], seen["deflection_high_rad"]
    known = np.isfinite(low)
    assert np.all(low[known] <= truth[known])
    assert np.all(truth[known] <= high[known])
    assert np.all(seen["deflection_rad"][known] >= low[known])


def width(seen: dict[str, np.ndarray]) -> np.ndarray:
    return np.asarray(seen["deflection_high_rad"] - seen["deflection_low_rad"])


def test_open_circuit_closes_once_every_wrap_has_slid_past_what_could_be_stored() -> None:
    config = joint("open", {**SHORT, "mu_output": 0.08, "mu_input": 0.08})
    unit = pull_unit(config)
    reach = 0.08 * 5.0  # mu times wrap
    for top, closes in ((1.02 * np.expm1(2 * reach), True), (0.8 * np.expm1(2 * reach), False)):
        seen = run(Observer(config, bounds=True), unit * knots([0.0, top, -0.1, 0.5], 200), np.zeros(601))
        range_rad = np.ptp(seen["deflection_rad"])
        assert (width(seen)[-1] < 1e-8 * range_rad) == closes


@pytest.mark.parametrize("kind", ["closed", "open"])
def test_known_past_tensions_narrow_the_start(kind: str) -> None:
    free = joint(kind)
    told = joint(kind, observer={"past_tension_min": 0.7, "past_tension_max": 1.5})
    load = pull_unit(free) * knots([0.0, 0.2, -0.2, 0.1])
    wide = width(run(Observer(free, bounds=True), load, 0 * load))
    narrow = width(run(Observer(told, bounds=True), load, 0 * load))
    assert np.all(narrow < 0.7 * wide)


def test_closed_circuit_closes_and_stays_closed() -> None:
    config = JOINTS["closed, short wraps"]
    load = pull_unit(config) * knots([0.0, 1.9, -1.9, 1.9, -0.4, 0.9, 0.0], 300)
    seen = run(Observer(config, bounds=True), load, np.zeros_like(load))
    range_rad = np.ptp(seen["deflection_rad"])
    assert width(seen)[0] > 0.05 * range_rad
    assert np.all(width(seen)[1000:] < 1e-7 * range_rad)


def test_ensemble_fills_the_interval_of_a_joint_with_short_wraps() -> None:
    """At the start two admissible extremes reach most of the way to the bounds."""
    config = JOINTS["closed, short wraps"]
    unit = pull_unit(config)
    ends = []
    for share in (2.5, -2.5):
        true = Observer(config)
        run(true, unit * knots([0.0, share, 0.0], 200), np.zeros(401))
        ends.append(run(true, np.zeros(1), np.zeros(1), 10.0)["deflection_rad"][0])
    first = run(Observer(config, bounds=True), np.zeros(1), np.zeros(1))
    assert abs(ends[0] - ends[1]) > 0.3 * width(first)[0]


def test_a_snapshot_keeps_the_bounds() -> None:
    config = joint()
    load = pull_unit(config) * knots([0.0, 1.2, -0.6, 0.3])
    one, two = Observer(config, bounds=True), Observer(config, bounds=True)
    run(one, load, 0 * load)
    two.restore(one.snapshot())
    a, b = run(one, load, 0 * load, 9.0), run(two, load, 0 * load, 9.0)
    for key in a:
        assert np.array_equal(a[key], b[key])
