"""Values on a diagnosis's page: their units, changes and intervals."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from diagnosis_example import example, text_of

from cablecomp.diagnosis.result import Diagnosis, Value
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.diagnosis_tables import between, interval


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return example(600)


def test_a_zero_changes_by_no_share_and_a_number_without_a_unit_has_none(found: Diagnosis) -> None:
    moved = (*found.calibration, Value("joint_position_offset_rad", -4e-6, 7e-7, -7e-7))
    number = {"effect": "strand_break", "parameter": "fraction", "below": 0.25, "unit": "-", "why": ""}
    text = text_of(diagnosis_page(replace(found, calibration=moved, could_be_unseen=(number,))))
    assert re.search(r"joint_position_offset_rad −7·10⁻⁷ −4·10⁻⁶ ± 7·10⁻⁷ –", text)
    assert re.search(r"fraction 0\.25(?! -)", text)


def test_a_profile_interval_stands_in_place_of_two_standard_deviations(found: Diagnosis) -> None:
    (named,) = found.named
    (name, value) = next((k, v) for k, v in named.parameters.items() if isinstance(v, Value))
    other = replace(value, interval_95=(0.125 * value.value, 8.0 * value.value))
    d = replace(found, named=(replace(named, parameters={**named.parameters, name: other}),))
    assert between(0.125 * value.value, 8.0 * value.value) in text_of(diagnosis_page(d))
    plain = replace(found, named=(replace(named, parameters={name: replace(value, interval_95=None)}),))
    assert between(0.125 * value.value, 8.0 * value.value) not in text_of(diagnosis_page(plain))


def test_what_was_chosen_has_no_interval(found: Diagnosis) -> None:
    (named,) = found.named
    steps = {
        "slip_m@mon": Value("slip_m@mon", 1e-4, 1e-6),
        "second_after_s": Value("second_after_s", 12.5, 0.0),
    }
    d = replace(found, named=(replace(named, effect="clamp_slip", parameters=steps),))
    text = text_of(diagnosis_page(d))
    assert text.count("chosen, not fitted") == 1
    assert between(12.5, 12.5) not in text
    assert re.search(r"slip_m@mon \S+ ± \S+ m ", text)  # in its unit, though a session's own


def test_an_interval_stays_inside_what_the_value_can_be() -> None:
    assert interval(0.5, 1.0, 0.0).split(" … ")[0] == "0"
    assert interval(0.5, 1.0).startswith("−1.46")
