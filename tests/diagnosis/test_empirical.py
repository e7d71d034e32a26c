"""Laws without a name: what the diagnosis counts is what the observer runs, and a series fitted again finds
what is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cablecomp.config import Empirical
from cablecomp.diagnosis.describe.empirical import refitted, value_of
from cablecomp.estimation.evidence import JOINT, Evidence, gather
from cablecomp.estimation.simulate import simulator
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


def test_a_series_fitted_again_finds_the_curve_that_is_there() -> None:
    here = evidence()
    there = value_of(LAW, here)
    blank = LAW.model_copy(update={"coefficients_rad": (0.0,) * 11})
    (again,) = refitted([blank], [here], [there])
    assert np.std(value_of(again, here) - there) < 0.05 * np.std(there)
    half = replace(here, counted={JOINT: here.counted[JOINT] & (np.arange(len(here.rows)) % 2 == 0)})
    (unseen,) = refitted([blank], [half], [value_of(LAW, half)])
    assert np.std(value_of(unseen, here) - there) < 0.05 * np.std(there)
