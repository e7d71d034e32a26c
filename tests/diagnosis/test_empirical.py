"""Laws without a name: what the diagnosis counts is what the observer runs, and a series fitted again finds
what is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cablecomp.config import Empirical
from cablecomp.diagnosis.describe.empirical import _held, _Rows, refitted, value_of
from cablecomp.diagnosis.folds import Groups
from cablecomp.estimation.evidence import JOINT, Evidence, gather
from cablecomp.estimation.simulate import simulator
from cablecomp.signal.smoothing import FloatArray
from tests.diagnosis.test_diagnose import joint, recording

LAW = Empirical(
    id="ripple_by_motor_angle", law="chebyshev", of="motor_position_rad", centre=0.2, half_width=1.4,
    coefficients_rad=(0.0, 1e-3, -2e-3, 5e-4, 0.0, 3e-4, 0.0, 0.0, 0.0, 0.0, 1e-4),
)  # fmt: skip


def evidence() -> Evidence:
    return gather(joint(), "small/1", recording([]), "small", fine_rows=2000, judged_rows=400)


def test_what_is_counted_for_a_law_is_what_the_observer_adds() -> None:
    here = evidence()
    plain = joint()
    with_law = plain.model_copy(update={"empirical": (LAW,)})
    kept = here.counted[JOINT]
    added = simulator(with_law).predict(here)[JOINT][kept] - simulator(plain).predict(here)[JOINT][kept]
    np.testing.assert_allclose(value_of(LAW, here), added, atol=1e-12)


@pytest.mark.parametrize(("by_level", "kept"), [(False, True), (True, False)])
def test_a_law_by_load_has_to_hold_where_recordings_reach_further(by_level: bool, kept: bool) -> None:
    """Recordings at four levels of load: a ripple that is the same curve at every level is a law; one that turns over
    at the greatest level, as another law's remainder does, is none, though it helps with recordings left out."""
    parts = []
    left = []
    for k, level in enumerate((0.4, 0.4, 0.4, 0.6, 0.6, 0.6, 0.8, 0.8, 0.8, 1.0, 1.0)):
        one = gather(joint(), f"small/{k}", scaled(level, k), "small", fine_rows=600, judged_rows=200)
        load = one.at_rows("joint_torque_Nm")[one.counted[JOINT]]
        turned = -0.3 if by_level and level == 1.0 else 1.0
        parts.append(one)
        left.append(
            turned * 1e-3 * np.sin(4.0 * load) + 1e-4 * np.random.default_rng(k).standard_normal(len(load))
        )
    owner = np.repeat(np.arange(len(left)), [len(v) for v in left])
    groups = Groups(owner, owner, "recording", np.zeros_like(owner))
    rows = _Rows(parts, np.concatenate(left), np.ones(len(owner)), groups)
    assert (_held("joint_torque_Nm", rows) is not None) is kept


def scaled(level: float, seed: int) -> dict[str, FloatArray]:
    """A recording whose load goes this far."""
    columns = recording([], seed)
    return {**columns, "joint_torque_Nm": level * columns["joint_torque_Nm"]}


def test_a_series_fitted_again_finds_the_curve_that_is_there() -> None:
    here = evidence()
    there = value_of(LAW, here)
    blank = LAW.model_copy(update={"coefficients_rad": (0.0,) * 11})
    (again,) = refitted([blank], [here], [there])
    assert np.std(value_of(again, here) - there) < 0.05 * np.std(there)
    half = replace(here, counted={JOINT: here.counted[JOINT] & (np.arange(len(here.rows)) % 2 == 0)})
    (unseen,) = refitted([blank], [half], [value_of(LAW, half)])
    assert np.std(value_of(unseen, here) - there) < 0.05 * np.std(there)
