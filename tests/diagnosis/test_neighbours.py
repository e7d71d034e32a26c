"""What may be a neighbour's: not a channel that the joint's own motion tells."""

from __future__ import annotations

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.neighbours import not_told_apart, own_share
from cablecomp.estimation.evidence import Evidence
from cablecomp.signal.smoothing import FloatArray

OTHER = "other_2_Nm"


def dragged(columns: dict[str, FloatArray]) -> FloatArray:
    """Tension of the joint's own cable beside friction, in some unit: behind a play that the law does not have."""
    drive = 25.0 * columns["motor_position_rad"]
    found, at = np.empty(len(drive)), drive[0]
    for k, value in enumerate(drive):
        at = min(max(at, value - 5.5), value + 5.5)
        found[k] = at
    return found + 0.3 * np.random.default_rng(20).standard_normal(len(drive))


def elsewhere(columns: dict[str, FloatArray]) -> FloatArray:
    """A neighbour that moves at its own pace, and now and then with the joint."""
    time = columns["time_s"]
    return np.sin(0.9 * time + 1.0) + 0.3 * columns["joint_torque_Nm"] / np.ptp(columns["joint_torque_Nm"])


def gathered(*others: FloatArray | None) -> list[Evidence]:
    seeds = range(1, 1 + len(others))
    columns = {f"a/{k}": recorded(seed=k) for k in seeds}
    for c, other in zip(columns.values(), others, strict=True):
        c[OTHER] = dragged(c) if other is None else other
    return list(gather_body(JOINT, columns).used)


def asked(evidence: list[Evidence]) -> set[str]:
    return {h.name.split(":")[0] for h in hypotheses(JOINT, evidence) if h.channel == OTHER}


def test_a_channel_of_the_joints_own_drive_is_no_neighbour() -> None:
    evidence = gathered(None, None)
    assert own_share(evidence, OTHER) > 0.9
    assert list(not_told_apart(JOINT, evidence)) == [OTHER]
    assert not asked(evidence)


def test_a_neighbour_is_asked_for_where_it_moves_by_itself_in_one_recording_at_least() -> None:
    by_itself = elsewhere(recorded(seed=1))
    assert "crosstalk" in asked(gathered(by_itself, elsewhere(recorded(seed=2))))
    assert "crosstalk" in asked(gathered(50.0 * by_itself, None))


def test_a_neighbour_that_the_torque_channel_holds_is_one_though_motion_and_load_tell_it() -> None:
    """What an arm beside the joint puts on its torque sensor is what is left of a load that goes with the motor."""
    columns = recorded(seed=1)
    other = elsewhere(columns)
    columns["joint_torque_Nm"] = 0.4 * columns["motor_position_rad"] - 0.3 * other
    evidence = list(gather_body(JOINT, {"one": {**columns, OTHER: other}}).used)
    assert "crosstalk" in asked(evidence)


@pytest.mark.parametrize("shift", [0.0, 1e3])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_its_unit_and_its_zero_decide_nothing(unit: float, shift: float) -> None:
    (plain,), (other,) = (
        gathered(s + u * elsewhere(recorded(seed=1))) for u, s in ((1.0, 0.0), (unit, shift * unit))
    )
    shares = [own_share([e], OTHER) for e in (plain, other)]
    assert shares[0] == pytest.approx(shares[1], abs=1e-6)
    assert 0.0 < shares[0] < 0.9


def test_a_motor_that_is_held_tells_nothing_of_a_neighbour() -> None:
    columns = recorded(seed=1)
    held = columns | {"motor_position_rad": np.full(len(columns["time_s"]), 0.1), OTHER: elsewhere(columns)}
    evidence = list(gather_body(JOINT, {"one": held}).used)
    assert own_share(evidence, OTHER) == pytest.approx(0.0, abs=1e-9)
    assert "crosstalk" in asked(evidence)


def test_the_diagnosis_says_what_it_did_not_ask_and_why() -> None:
    columns = recorded(seed=1)
    found = diagnose(JOINT, {"one": {**columns, OTHER: dragged(columns)}})
    assert [n for n in found.notes if n.startswith(OTHER)]
    assert not any(t.name.startswith("crosstalk") for t in found.tested)
