"""Outliers that quick motion and jittering stamps hide in either angle show in what the two differ by."""

from __future__ import annotations

import numpy as np

from cablecomp.estimation.outliers import outliers, outliers_in_motion

RATIO, SIGMA = 0.4, 2e-5


def test_outliers_of_a_drive_that_never_rests_are_found_and_each_is_its_own_channels() -> None:
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 30.0, 0.01) + 0.002 * rng.uniform(-1.0, 1.0, 3000)
    motor = 1.5 * np.sin(2.0 * time)
    joint = RATIO * motor + 2e-3 * np.sin(0.7 * time) + SIGMA * rng.standard_normal(3000)
    motor += SIGMA * rng.standard_normal(3000)
    every = np.ones(3000, dtype=np.bool_)
    assert not np.any(outliers_in_motion(time, joint, RATIO * motor, every))
    off_joint, off_motor = [400, 1003, 2101], [777, 1500]
    joint[off_joint] += (60.0 * SIGMA, -50.0 * SIGMA, 70.0 * SIGMA)
    motor[off_motor] += (150.0 * SIGMA, -120.0 * SIGMA)
    assert not outliers(joint, every).any()  # alone the angle does not show them
    assert not outliers(motor, every).any()
    of_joint, of_motor = outliers_in_motion(time, joint, RATIO * motor, every)
    assert np.flatnonzero(of_joint).tolist() == off_joint
    assert np.flatnonzero(of_motor).tolist() == off_motor
