"""Words that the terminal and the page of a diagnosis share."""

from __future__ import annotations

import pytest

from cablecomp.report.diagnosis_words import ANSWERS, covariate, percent


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.0, "0 %"),
        (1.0, "100 %"),
        (0.354, "35 %"),
        (-0.02, "-2 %"),
        (0.0031, "0.3 %"),
        (0.9996, "99.96 %"),
        (1e-7, "0 %"),
    ],
)
def test_a_small_share_is_not_said_to_be_none_nor_a_large_one_all(share: float, said: str) -> None:
    assert percent(share) == said


def test_words_hold_of_a_joint_that_never_had_a_load() -> None:
    """Nothing that moved has stopped there: the load is constant from the beginning on."""
    assert covariate("dwell") == "time at constant load"


def test_what_a_joint_is_consistent_with_may_be_effects_that_it_was_given() -> None:
    assert "known physics" in ANSWERS["consistent"]
