"""The joint that a diagnosis ends with says how well it is known now."""

from __future__ import annotations

from math import log

import pytest
from joints import SMALL, closed
from small_drive import recorded

from cablecomp.config import parse_joint
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Diagnosis
from cablecomp.diagnosis.thresholds import LIMITS

VAGUE = {"pretension_N": 1.0, "mu_output": 1.0, "mu_input": 1.0, "EA_N": 0.02}
AS_BUILT = closed(SMALL)["drive"]["stage"][0]


def diagnosed(*, locked: bool) -> Diagnosis:
    """The small joint, twice as tight as stated; nothing is searched, the drive is calibrated alone."""
    drive = closed(SMALL)
    (stage,) = drive["drive"]["stage"]
    stage = {**stage, "pretension_N": 0.5 * stage["pretension_N"]}
    vague = {**drive, "drive": {**drive["drive"], "stage": [stage]}, "tolerance": VAGUE}
    columns = recorded([], 60.0, locked=locked)
    return diagnose(parse_joint(vague, "vague"), {"small/1": columns}, budget_s=0.0)


def test_what_was_known_by_order_of_magnitude_is_known_as_well_as_it_was_fitted() -> None:
    joint = diagnosed(locked=False).augmented_joint
    (stage,) = joint.drive.stage
    for name in ("pretension_N", "mu_output"):
        assert LIMITS.known <= joint.tolerance[name] < 0.7
        assert abs(log(getattr(stage, name) / AS_BUILT[name])) < 3.0 * joint.tolerance[name]
    assert joint.tolerance["EA_N"] == pytest.approx(0.02)  # no more than before


def test_what_the_recordings_do_not_tell_is_known_no_better_than_before() -> None:
    """A motor that stands still: no cable runs over the motor's pulley but by its stretch."""
    tolerance = diagnosed(locked=True).augmented_joint.tolerance
    assert tolerance["mu_input"] == pytest.approx(1.0)
