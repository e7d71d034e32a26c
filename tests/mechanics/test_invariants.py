"""A running integral that does not belong to its points is seen, whatever the law."""

from __future__ import annotations

import numpy as np
import pytest

from cablecomp.config import load_joint
from cablecomp.effects import with_effects
from cablecomp.errors import InternalError
from cablecomp.observer import Observer


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (("nonlinear_cable", {"stiffening": 0.4}),),
        (("pressure_dependent_friction", {"exponent": 0.2}),),
    ],
)
def test_a_wrong_integral_is_found(effects: tuple[tuple[str, dict[str, float]], ...]) -> None:
    observer = Observer(with_effects(load_joint("snow-closed-rig"), effects))
    load = 0.5 * np.sin(np.linspace(0.0, 6.0, 30))
    observer.run({"time_s": np.arange(30.0), "motor_position_rad": 0.1 * load, "joint_torque_Nm": load})
    observer.check_state()
    observer._joint.named.profiles[0, 1].stretch += 1e-3
    with pytest.raises(InternalError, match="profile 0: its running integral"):
        observer.check_state()
