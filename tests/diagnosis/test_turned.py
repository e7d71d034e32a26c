"""What goes with a pulley's angle is asked for only where one is turned."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.turned import stands_still, told
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec

BY_ANGLE = {"gravity_load", "pulley_runout", "position_dependent_friction"}
SPRUNG = EffectSpec("series_compliance", {"compliance_rad_per_Nm": 2e-3})


def _still(*at_rad: float) -> dict[str, dict[str, FloatArray]]:
    """Recordings with the motor held, each at another angle."""
    columns = recorded([], 20.0, locked=True)
    return {
        f"small/{k}": {**columns, "motor_position_rad": columns["motor_position_rad"] + a}
        for k, a in enumerate(at_rad)
    }


def _asked(recordings: dict[str, dict[str, FloatArray]]) -> set[str]:
    evidence = gather_body(TOLERANT, recordings).used
    return {h.effect.id for h in told(hypotheses(TOLERANT, evidence), TOLERANT, evidence)}


def test_with_the_motor_held_no_weight_run_out_or_groove_is_asked_for() -> None:
    assert not BY_ANGLE & _asked(_still(0.3))
    assert {"series_compliance", "strand_friction", "bearing_friction"} <= _asked(_still(0.3))


def test_they_are_where_it_is_turned_or_held_elsewhere_in_another_recording() -> None:
    assert _asked({"small/1": recorded([], 20.0)}) >= BY_ANGLE
    assert _asked(_still(0.3, 0.9)) >= BY_ANGLE


@pytest.mark.parametrize(("readings", "still"), [(3, True), (60, False)])
def test_single_readings_turn_nothing(readings: int, still: bool) -> None:
    columns = recorded([], 20.0, locked=True)
    columns["motor_position_rad"][100 : 100 + readings] += 0.5
    evidence = gather_body(TOLERANT, {"small/1": columns}).used
    assert stands_still(TOLERANT, evidence) is still


def test_a_base_that_another_joint_turns_is_asked_for_all_the_same() -> None:
    columns = recorded([], 20.0, locked=True)
    columns["other_shoulder_rad"] = np.sin(0.4 * columns["time_s"])
    evidence = gather_body(TOLERANT, {"small/1": columns}).used
    asked = {h.name for h in told(hypotheses(TOLERANT, evidence), TOLERANT, evidence)}
    assert "gravity_load:other_shoulder_rad" in asked
    assert "gravity_load" not in asked


def test_the_diagnosis_says_so_and_that_they_may_be_there() -> None:
    found = diagnose(TOLERANT, {"small/1": recorded([SPRUNG], 24.0, locked=True)})
    assert [n.effect for n in found.named] == ["series_compliance"]
    assert not BY_ANGLE & {t.name.partition(":")[0] for t in found.tested}
    assert {u["effect"] for u in found.could_be_unseen} >= BY_ANGLE
    assert any("neither pulley is turned" in note for note in found.notes)
    assert not any("is turned" in n for n in diagnose(TOLERANT, {"small/1": recorded([], 20.0)}).notes)
