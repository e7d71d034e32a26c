"""What a diagnosis says that it assumed and left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_drive import TOLERANT, recorded

from cablecomp.diagnosis.answer.notes import load_said, notes
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.outcome import Case
from cablecomp.estimation.evidence import JOINT as ANGLE
from cablecomp.signal.smoothing import FloatArray


def said(recordings: dict[str, dict[str, FloatArray]], quiet: float = 1.0) -> tuple[str, ...]:
    """The notes on recordings whose rows have so much of a reading's variance."""
    body = gather_body(TOLERANT, recordings)
    drive = calibrate_drive(TOLERANT, body.used, np.random.default_rng(0))
    evidence = tuple(replace(e, quiet={ANGLE: quiet}) for e in drive.fit.problem.evidence)
    fit = replace(drive.fit, problem=replace(drive.fit.problem, evidence=evidence))
    return notes(Case(TOLERANT, body, replace(drive, fit=fit), ()))


def test_where_the_clock_of_a_recording_lies_is_said_by_its_zero() -> None:
    """The second one's clock stood at 5 s when it began, a second after the first had ended."""
    first, second = recorded((), 10.0), recorded((), 10.0)
    began_s = float(first["time_s"][-1]) + 1.0
    second["time_s"] = second["time_s"] + 5.0
    (line,) = (n for n in said({"a/1": first, "a/2": second}) if "clock" in n)
    assert line.endswith(f"on the clock of this page, 0 s of a/2 is {began_s - 5.0:.4g} s")


@pytest.mark.parametrize(("quiet", "words"), [(0.999, None), (0.25, "they have 50 % of a reading's noise")])
def test_rows_that_have_a_reading_s_noise_are_not_said_to_be_averaged(
    quiet: float, words: str | None
) -> None:
    found = [n for n in said({"a/1": recorded((), 10.0)}, quiet) if "averaged" in n]
    assert len(found) == (words is not None)
    assert all(str(words) in n for n in found)


@pytest.mark.parametrize(
    ("stated", "channel", "says"),
    [
        ("joint_torque", "joint_torque_Nm", "load from joint_torque_Nm"),
        ("motor_torque", "motor_torque_Nm", "load from motor_torque_Nm"),
        ("none", None, "no load channel: the joint is taken as free"),
        (
            "motor_torque",
            None,
            "motor_torque_Nm, which [observer] load = 'motor_torque' reads, is not recorded",
        ),
        ("none", "joint_torque_Nm", "load from joint_torque_Nm; [observer] load = 'none' does not read it"),
        (
            "both_encoders",
            "joint_torque_Nm",
            "load from joint_torque_Nm; [observer] load = 'both_encoders' does not read it",
        ),
        (
            "motor_torque",
            "joint_torque_Nm",
            "load from joint_torque_Nm; [observer] load = 'motor_torque' does not read it",
        ),
    ],
)
def test_a_load_that_the_observer_does_not_read_is_said(stated: str, channel: str | None, says: str) -> None:
    observer = TOLERANT.observer.model_copy(update={"load": stated})
    assert load_said(TOLERANT.model_copy(update={"observer": observer}), channel).startswith(says)
