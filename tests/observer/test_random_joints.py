"""No joint that can be stated, however it is driven, is brought into a state that cannot be."""

from __future__ import annotations

import numpy as np
from random_joints import drive_hard, random_joint


def test_what_a_random_joint_takes_leaves_a_sound_state() -> None:
    accepted = refused = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        taken = drive_hard(random_joint(rng), rng, 40)
        accepted, refused = accepted + taken.accepted, refused + taken.refused
    assert accepted > 400
    assert refused > 150
