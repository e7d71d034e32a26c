"""A late encoder, and a bearing that drags with speed, on rows picked from many: what their spacing hides of the motion
is told by its speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.effects import with_effects
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.simulate import simulator
from cablecomp.signal.smoothing import FloatArray

DRAG = {"torque_Nm": 1e-6, "load_coefficient": 0.0, "presliding_rad": 1e-3, "viscous_s_per_rad": 4e4}
"""Grease, and next to nothing else."""


def shift(e: Evidence, effect: str, values: dict[str, float], *, every: bool) -> FloatArray:
    """What an effect does to the joint's readings on the judged rows, run on these alone or on all fine rows [rad]."""
    kept = np.arange(len(e.columns["time_s"])) if every else e.rows
    with_it = simulator(with_effects(JOINT, [(effect, values)])).run(e, kept)
    plain = simulator(JOINT).run(e, kept)
    found = with_it.joint - plain.joint
    return found[e.rows] if every else found


def off(e: Evidence, effect: str, values: dict[str, float]) -> float:
    """What judged rows alone miss of what the effect does, as a share of it (RMS)."""
    true = shift(e, effect, values, every=True)
    return float(np.sqrt(np.mean((shift(e, effect, values, every=False) - true) ** 2) / np.mean(true**2)))


@pytest.mark.parametrize(
    ("effect", "values"),
    [*(("clock_skew", {"delay_s": late}) for late in (2e-4, 5e-3, 0.03)), ("bearing_friction", DRAG)],
)
def test_what_goes_with_speed_is_between_thinned_rows_what_it_is_between_all(
    effect: str, values: dict[str, float]
) -> None:
    e = gather(JOINT, "one", recorded(), "a", fine_rows=2000, judged_rows=150)
    assert np.median(np.diff(e.at_rows("time_s"))) > 0.03
    assert off(e, effect, values) < 0.03


def test_a_drag_is_farther_off_by_straight_lines() -> None:
    e = gather(JOINT, "one", recorded(), "a", fine_rows=2000, judged_rows=150)
    unknown = replace(e)
    unknown.__dict__["motor_rate"] = np.full(len(e.columns["time_s"]), np.nan)
    assert off(unknown, "bearing_friction", DRAG) > 2.0 * off(e, "bearing_friction", DRAG)


def test_the_motors_speed_is_unknown_where_two_rows_have_one_time() -> None:
    e = gather(JOINT, "one", recorded(), "a", fine_rows=400, judged_rows=60)
    time = e.columns["time_s"].copy()
    time[11] = time[10] = time[9]
    doubled = replace(e, columns={**e.columns, "time_s": time})
    assert np.isnan(doubled.motor_rate[10])
    assert np.isfinite(doubled.motor_rate[20:]).all()
