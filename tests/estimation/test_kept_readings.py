"""What the kernel reads of a recording is gathered once: every run after the first predicts the same."""

from __future__ import annotations

import numpy as np
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.config import with_values
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.simulate import simulator


def test_runs_in_between_change_nothing_of_what_is_read() -> None:
    body, _ = calibrated(recorded([], 90.0))  # of more rows than are judged
    recording = body.used[0]
    first = simulator(TOLERANT).predict(recording)[JOINT]
    kept = {key: read.rows.copy() for key, read in recording.readings.items()}
    assert len(kept) == 1
    softer = simulator(with_values(TOLERANT, {"EA_N": 0.5 * TOLERANT.drive.stage[0].EA_N}))
    assert not np.allclose(softer.predict(recording)[JOINT], first, atol=1e-6)
    simulator(TOLERANT, fine=True).predict(recording)
    assert len(recording.readings) == 2
    for key, rows in kept.items():
        np.testing.assert_array_equal(recording.readings[key].rows, rows)
    np.testing.assert_array_equal(simulator(TOLERANT).predict(recording)[JOINT], first)


def test_a_load_read_at_the_motor_follows_its_zero() -> None:
    joint = TOLERANT.model_copy(
        update={"observer": TOLERANT.observer.model_copy(update={"load": "motor_torque"})}
    )
    columns = recorded([], 20.0)
    columns["motor_torque_Nm"] = -joint.drive.ratio * columns["joint_torque_Nm"]
    body, _ = calibrated(columns)
    recording = body.used[0]
    before = simulator(joint).predict(recording)[JOINT]
    moved = simulator(with_values(joint, {"motor_torque_offset_Nm": 0.05})).predict(recording)[JOINT]
    assert not np.allclose(moved, before, atol=1e-6)
