"""No joint that can be stated, however it is driven, is brought into a state that cannot be."""

from __future__ import annotations

import numpy as np
import pytest
from random_joints import SOFT_STRAIN, drive_hard, random_joint


def test_what_a_random_joint_takes_leaves_a_sound_state() -> None:
    accepted = refused = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        taken = drive_hard(random_joint(rng), rng, 40)
        accepted, refused = accepted + taken.accepted, refused + taken.refused
    assert accepted > 400
    assert refused > 150


@pytest.mark.parametrize("seed", [100373, 100385])
def test_a_small_step_that_turns_the_slip_about_keeps_the_stretch(seed: int) -> None:
    """Soft joints in which Newton's last step does."""
    rng = np.random.default_rng(seed)
    assert drive_hard(random_joint(rng, strain=SOFT_STRAIN), rng, 130).accepted > 40
