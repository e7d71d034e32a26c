"""What rows count for where the model falls through a clearance: held against the independent plant."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.config import EffectEntry
from cablecomp.estimation import least_squares
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.leaps import KEPT, beside_leaps, stands_off
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec

GAP_RAD = 3e-3
PLAY = TOLERANT.model_copy(
    update={
        "effect": [
            EffectEntry.model_validate(
                {
                    "id": "termination_backlash",
                    "gap_rad": GAP_RAD,
                }
            )
        ]
    }
)


def late_load(*effects: EffectSpec, samples: int = 1) -> dict[str, FloatArray]:
    """A recording of the plant with these effects whose load comes so many samples late."""
    columns = recorded(effects, 60.0)
    load = columns["joint_torque_Nm"]
    return {**columns, "joint_torque_Nm": np.concatenate([np.full(samples, load[0]), load[:-samples]])}


GAP = EffectSpec("termination_backlash", {"gap_rad": GAP_RAD})
INERTIA = EffectSpec("inertial_load", {"inertia_kgm2": 0.005})
SLIP = EffectSpec("clamp_slip", {"slip_m": 1e-5, "time_s": 25.0})


def test_one_row_or_two_that_stand_off_both_sides_are_found_and_steps_are_not() -> None:
    misfit = np.random.default_rng(1).normal(0.0, 1.0, 300)
    for first, length in ((40, 1), (90, 2), (150, 3)):
        misfit[first : first + length] += 50.0
    misfit[220:] += 50.0
    assert list(np.flatnonzero(stands_off(misfit))) == [40, 90, 91]
    assert stands_off(misfit)[40] == pytest.approx(50.0, abs=5.0)


@pytest.mark.parametrize("others", [[], [INERTIA], [SLIP]], ids=["alone", "inertia", "slip"])
def test_rows_in_which_a_clearance_is_crossed_sooner_or_later_count_for_little(
    others: list[EffectSpec],
) -> None:
    """All of them lie about a change of the load's sign, whatever else the drive lacks."""
    _, drive = calibrated(late_load(GAP, *others), PLAY)
    problem = drive.fit.problem
    (e,) = problem.evidence
    (kept,) = problem.weighing.beside_leaps.values()
    beside = np.flatnonzero(kept < 1.0)
    assert set(kept) == {KEPT, 1.0}
    assert 5 <= len(beside) < 0.1 * len(kept)
    load = e.at_rows("joint_torque_Nm")
    crossed = np.flatnonzero(np.diff(np.sign(load)))
    assert max(np.min(np.abs(crossed - k)) for k in beside) <= 3
    assert np.array_equal(problem.weighing.of_rows(e, JOINT), e.weight * kept)


def test_of_a_joint_without_a_clearance_all_rows_count_in_full() -> None:
    """Its clearance, of which the model knows nothing, stands off its neighbours: that is what is looked for."""
    _, drive = calibrated(late_load(GAP))
    assert beside_leaps(drive.fit.problem, drive.fit.x) == {}


def test_a_drive_is_calibrated_more_closely_where_they_count_for_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    columns = late_load(GAP)
    _, calm = calibrated(columns, PLAY)
    monkeypatch.setattr(least_squares, "beside_leaps", lambda *_: {})
    _, plain = calibrated(columns, PLAY)
    true = TOLERANT.drive.stage[-1].mu_output
    off = abs(plain.fit.values["mu_output"] - true)
    assert abs(calm.fit.values["mu_output"] - true) < 0.75 * off
