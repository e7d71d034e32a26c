"""A live loop refuses what will not keep its rate, and says the least that has to be left out."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan
from pathlib import Path

import pytest

from cablecomp.config import load_joint
from cablecomp.control.compensator import DEFAULT_GAINS
from cablecomp.control.options import CompensatorOptions, ControlMode
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.runtime.pace import SAMPLES, Pace, check_pace, measured_s, motion

JOINTS = Path(__file__).parents[2] / "configs/joints"
ADDED = [("routing_friction", {"mu_angle": 0.1}), ("motor_friction", {"coulomb_Nm": 0.01})]


def pace(joint: str = "wrist-capstan", *, bounds: bool = True, effects: bool = False) -> Pace:
    config = load_joint(JOINTS / f"{joint}.toml")
    if effects:
        config = with_effects(config, ADDED)
    return Pace(joint, config, CompensatorOptions(), DEFAULT_GAINS, bounds)


def costs(plain_s: float, bounds_s: float, **effects_s: float):
    """A computer on which everything has its price."""

    def cost(paces: Sequence[Pace]) -> float:
        return sum(
            plain_s + bounds_s * p.bounds + sum(effects_s.get(entry.id, 0.0) for entry in p.config.effect)
            for p in paces
        )

    return cost


@pytest.mark.parametrize(
    ("cost", "advice"),
    [
        (costs(1e-4, 1e-3), "leave out the bounds (--no-bounds): 0.1 ms"),
        (costs(1e-4, 1e-4, routing_friction=2e-3), "leave out the effect `routing_friction`: 0.2 ms"),
        (costs(1e-4, 1e-4, motor_friction=2e-3), "leave out the effect `motor_friction`: 0.2 ms"),
        (costs(1e-4, 1e-3, routing_friction=2e-3), "leave out the bounds and `routing_friction`: 0.1 ms"),
        (costs(4e-3, 0.0), "set rate_Hz to 200 or lower"),
    ],
)
def test_the_least_that_helps_is_named(cost, advice: str) -> None:
    with pytest.raises(InputError) as refused:
        check_pace([pace(effects=True)], 1e-3, cost)
    assert str(refused.value).startswith("wrist-capstan: one cycle's steps take ")
    assert str(refused.value).endswith(advice)
    assert "\n" not in str(refused.value)


def test_all_joints_of_a_loop_count_together() -> None:
    check_pace([pace()] * 7, 1e-3, costs(1e-4, 0.0))
    with pytest.raises(InputError, match=r"^9 joints: .*0\.9 ms here, and 0\.8 ms of the 1 ms"):
        check_pace([pace()] * 9, 1e-3, costs(1e-4, 0.0))


@pytest.mark.parametrize("joint", [path.stem for path in sorted(JOINTS.glob("*.toml"))])
def test_the_rehearsal_is_a_motion_that_the_joint_takes(joint: str) -> None:
    """Its load reverses, its motor turns, and both encoders agree with the load."""
    config = load_joint(JOINTS / f"{joint}.toml")
    samples = motion(config, 1e-3)
    assert len(samples) == SAMPLES
    loads = [s.joint_torque_Nm for s in samples]
    assert min(loads) < 0.0 < max(loads)
    observer = Observer(config)
    for sample in samples:
        assert observer.step(sample).joint_position_rad == sample.joint_position_rad
    twin = Observer(config)
    for sample in samples[:40]:
        found = twin.step_inverse(sample._replace(joint_torque_Nm=nan)).joint_torque_Nm
        assert found == pytest.approx(sample.joint_torque_Nm, abs=1e-6 * max(loads))


@pytest.mark.parametrize("mode", [ControlMode.POSITION, ControlMode.FORCE])
def test_a_measurement_is_made_in_every_mode(mode: ControlMode) -> None:
    """What it says depends on the computer; a period that nothing fits into is refused on every one."""
    wanted = pace()._replace(options=CompensatorOptions(mode=mode))
    assert isfinite(measured_s([wanted], 1e-3))
    check_pace([wanted], 1.0)
    with pytest.raises(InputError, match="set rate_Hz to"):
        check_pace([wanted], 1e-6)
