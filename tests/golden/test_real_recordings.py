"""Verdicts of the diagnosis on recordings of real hardware.

Set CABLECOMP_RECORDINGS to the folder of the recordings; without it these tests are skipped. `pytest -s` shows
the figures; `python tests/golden/real_recordings.py` goes through all recordings, with baselines.
"""

from __future__ import annotations

import jaw_recordings as jaw
import numpy as np
import pytest
import recordings as files
import sheath_recordings as sheath

from cablecomp.diagnosis.result import Diagnosis

pytestmark = pytest.mark.skipif(
    files.root() is None, reason="CABLECOMP_RECORDINGS does not name the folder of the real recordings"
)


@pytest.fixture(scope="module")
def one_jaw() -> Diagnosis:
    """20 s of the jaw alone, nothing known of its drive but orders of magnitude."""
    (path,) = [p for p in jaw.of_session("L_4") if p.name == "01.csv.gz"]
    return files.diagnosed(files.joint("davinci-jaw"), [path])


@pytest.fixture(scope="module")
def two_sessions() -> Diagnosis:
    """Every fourth of the straight recordings of the jaw, of both its sessions: the command that the README gives for
    all 45. (Of every eighth, friction by pressure does as well as the cable that stiffens.)"""
    return files.diagnosed(
        files.joint("davinci-jaw"), [p for session in ("L_4", "L_2") for p in jaw.of_session(session)[::4]]
    )


@pytest.fixture(scope="module")
def bends() -> Diagnosis:
    """Five bends of the sheath in one call."""
    return files.diagnosed(files.joint("tendon-sheath"), [sheath.path(b) for b in sheath.BENDS])


def degrees(value_rad: float) -> float:
    return float(np.degrees(value_rad))


def test_one_jaw_recording_names_the_friction_of_the_path(one_jaw: Diagnosis) -> None:
    print(f"\n  jaw, one recording: {one_jaw.verdict}, {[(n.effect, n.confidence) for n in one_jaw.named]}")
    assert "routing_friction" in {n.effect for n in one_jaw.named}
    assert one_jaw.verdict in ("explained", "partly explained")


def test_what_it_names_predicts_what_it_was_not_fitted_to(one_jaw: Diagnosis) -> None:
    before, after = one_jaw.baseline, one_jaw.augmented
    print(f"\n  jaw, one recording, kept for the end: {degrees(before.final_rmse_rad):.2f} -> "
          f"{degrees(after.final_rmse_rad):.2f} deg")  # fmt: skip
    assert after.heldout_rmse_rad < 0.75 * before.heldout_rmse_rad
    assert after.final_rmse_rad < before.final_rmse_rad


def test_both_sessions_of_the_jaw_name_path_and_stiffening_cable(two_sessions: Diagnosis) -> None:
    e, names = two_sessions.augmented, [(n.effect, n.confidence) for n in two_sessions.named]
    print(f"\n  jaw, both sessions: {two_sessions.verdict}, {names}, left out {degrees(e.heldout_rmse_rad):.2f}, "
          f"kept for the end {degrees(e.final_rmse_rad):.2f} deg")  # fmt: skip
    assert two_sessions.verdict == "partly explained"
    assert {"routing_friction", "nonlinear_cable"} <= {n.effect for n in two_sessions.named}
    assert e.final_rmse_rad < 0.6 * two_sessions.baseline.final_rmse_rad


def test_the_sheath_is_routing_friction_that_depends_on_its_bend(bends: Diagnosis) -> None:
    print(f"\n  sheath: {bends.verdict}, {[(n.effect, n.confidence, n.depends_on) for n in bends.named]}")
    (routing,) = [n for n in bends.named if n.effect == "routing_friction"]
    assert routing.depends_on is not None
    assert routing.depends_on["on"] == "sheath_bend_rad"
    assert routing.depends_on["per_unit"] > 0.0


def test_one_drive_for_all_bends(bends: Diagnosis) -> None:
    e = bends.augmented
    print(
        f"\n  sheath, one drive: fitted {degrees(e.rmse_rad):.2f}, bend left out {degrees(e.heldout_rmse_rad):.2f} deg"
    )
    assert bends.heldout_by in ("recording", "condition", "session")
    assert degrees(e.rmse_rad) <= 1.35
    assert degrees(e.heldout_rmse_rad) <= 1.9


def test_two_bends_of_one_session_are_one_drive_whose_friction_grows_with_the_bend() -> None:
    """As recordings are taken that no `[[session]]` claims; asked no more of them than of all bends together."""
    found = files.diagnosed(files.joint("tendon-sheath"), [sheath.path(60), sheath.path(240)], "one")
    (routing,) = [n for n in found.named if n.effect == "routing_friction"]
    assert routing.depends_on is not None
    assert routing.depends_on["on"] == "sheath_bend_rad"
    assert routing.depends_on["per_unit"] > 0.0
    assert degrees(found.augmented.rmse_rad) <= 1.35
    assert degrees(found.augmented.heldout_rmse_rad) <= 1.9
