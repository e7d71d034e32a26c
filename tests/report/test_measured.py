"""A value is written to the digits that its uncertainty bears out, the same in every output."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cablecomp.diagnosis.calibrate import Kept
from cablecomp.diagnosis.result import Value
from cablecomp.report.calibration import calibration_notes, cells
from cablecomp.report.diagnosis_words import values_of
from cablecomp.report.measured import rounded, with_sd


@pytest.mark.parametrize(
    ("value", "sd", "written"),
    [
        (10.05762, 0.027, "10.058 ± 0.027"),  # JCGM 100:2008 (GUM), 7.2.6
        (100.02147, 0.00035, "100.02147 ± 0.00035"),  # the same, 7.2.2
        (0.3483, 1.2, "0.3 ± 1.2"),
        (15213.4, 343.2, "15213 ± 343"),  # as an integer, no power of ten
        (-3.5e-12, 1.2e-12, "-3.5e-12 ± 1.2e-12"),
        (2.0, 0.0, "2"),
        (2.0, None, "2"),
        (2.0, float("nan"), "2"),
        (None, 1.0, "–"),
    ],
)
def test_a_value_has_the_digits_that_its_uncertainty_has(
    value: float | None, sd: float | None, written: str
) -> None:
    assert with_sd(value, sd) == written
    assert " ± ".join(t for t in rounded(value, sd) if t) == written


def test_names_and_calibrations_are_written_by_the_same_rule() -> None:
    entry = {"parameters": {"mu_angle": {"value": 0.3483, "sd": 1.2}, "channel": "other_rad"}}
    assert list(values_of(entry)) == ["mu_angle = 0.3 ± 1.2", "channel = other_rad"]
    assert cells(Value("mu_angle", 0.3483, 1.2, 0.3)) == ("0.3", "0.3", "1.2", "+16 %")


def test_a_share_above_a_hundred_per_cent_is_no_power_of_ten() -> None:
    assert cells(Value("EA_N", 230.0, 4.0, 100.0))[-1] == "+130 %"
    kept = Kept("EA_N", 100.0, 2.3, "these recordings tell nothing of it", None, True)
    (line, *_) = calibration_notes(SimpleNamespace(kept=[kept], tied=(), warnings=()))
    assert line.startswith("EA_N stays nominal, 100 ± 230 %: ")
