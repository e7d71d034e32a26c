"""A note where errors are with readings that a joint that runs does not have yet."""

from __future__ import annotations

from dataclasses import replace

import pytest
from small_drive import calibrated, recorded

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.answer.notes import carried_on
from cablecomp.diagnosis.explain.model import Model
from cablecomp.estimation.least_squares import Fit


@pytest.fixture(scope="module")
def fit() -> Fit:
    return calibrated(recorded([], 12.0))[1].fit


@pytest.mark.parametrize(
    ("delays", "ahead"),
    [
        ({"delay_s": 0.0, "load_delay_s": 0.06}, "60 ms"),
        ({"delay_s": -0.05}, "50 ms"),
        ({"delay_s": 0.06}, ""),  # what comes late is known when it comes
        ({"delay_s": 0.0, "load_delay_s": 1e-4}, ""),  # within a sample
    ],
)
def test_it_is_said_where_a_whole_recording_tells_more(
    fit: Fit, delays: dict[str, float], ahead: str
) -> None:
    entry = EffectEntry.model_validate({"id": "clock_skew", **delays})
    joint = fit.problem.config.model_copy(update={"effect": (entry,)})
    said = carried_on(Model((), replace(fit, problem=replace(fit.problem, config=joint)), fit.residual))
    assert [ahead in line for line in said] == ([True] if ahead else [])
