"""A joint's angle follows its readings without a jump: what a fit goes down has no steps that nobody put there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from effect_cases import Columns, Floats, joint, neighbour_Nm, typical

from cablecomp.config import JointConfig
from cablecomp.effects import catalogue, extend, with_effects
from cablecomp.errors import InputError
from cablecomp.mechanics.assemble import assemble
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import Observer
from cablecomp.observer.compiled import CompiledJoint
from cablecomp.observer.rows import answers, readings

TINY = 1e-10
JUMP = 1e-7
"""Share of what the joint gives way by that a change of the readings by `TINY` of them may not reach: the steepest laws
(a clearance just closing) make a thousand times of it."""
OPEN = ("snow-open-rig",)


def course(config: JointConfig, seed: int, samples: int = 1500, digits: bool = False) -> Columns:
    """A minute of slow motion and load, each of three tones; `digits`: read in steps of a 500th of the largest."""
    rng = np.random.default_rng([seed, 7])
    time = 0.04 * np.arange(samples)

    def tones(peak: float) -> np.ndarray:
        parts = [
            np.sin(2.0 * np.pi * rng.uniform(0.05, 0.5) * time + rng.uniform(0.0, 6.0)) for _ in range(3)
        ]
        whole = np.asarray(peak / 3.0 * sum(parts))
        return np.round(whole / peak * 500.0) / 500.0 * peak if digits else whole

    load = tones(neighbour_Nm(config))
    if config.drive.circuit == "open":
        load -= 1.2 * load.min()
    return {
        "time_s": time,
        "motor_position_rad": tones(0.3 / config.drive.ratio),
        "joint_torque_Nm": load,
        "temperature_degC": 20.0 + 3.0 * np.sin(0.1 * time),
        "other_neighbour_Nm": neighbour_Nm(config) * np.cos(0.7 * time),
    }


def observed(config: JointConfig, read: Columns) -> Floats:
    """The joint's angle [rad] as an observer has it, sample by sample."""
    return Observer(config).run(read)["joint_position_rad"]


def by_rows(config: JointConfig, read: Columns) -> Floats:
    """The same of rows that come with the motor's speed, as a fit picks them from many."""
    rows = readings(len(read["time_s"]), 0)
    rows.time[:], rows.motor[:], rows.load[:] = (
        read[k] for k in ("time_s", "motor_position_rad", "joint_torque_Nm")
    )
    rows.motor_rate[:] = np.gradient(rows.motor, rows.time)
    run = CompiledJoint(assemble(config, extend(config)), 0)
    run.start(0.0, float(rows.motor[0]))
    outs, answer = answers(len(rows.time))
    assert run.run(rows.rows, outs, False, None, np.empty((len(outs), 2))) == (len(outs), STATUS_OK)
    return answer.joint


def jump(
    config: JointConfig, columns: Columns, angle: Callable[[JointConfig, Columns], Floats] = observed
) -> float:
    """The most by which a row moves where motor and load are as much larger, over what the joint gives way by."""
    moved = {k: (1.0 + TINY) * columns[k] for k in ("motor_position_rad", "joint_torque_Nm")}
    before, after = angle(config, columns), angle(config, columns | moved)
    gives = np.ptp(before - config.drive.ratio * columns["motor_position_rad"])
    return float(np.max(np.abs(after - before)) / gives)


@pytest.mark.parametrize("name", sorted(catalogue()))
@pytest.mark.parametrize("rig", ["snow-closed-rig", *OPEN])
def test_no_row_jumps(name: str, rig: str) -> None:
    config = joint(rig, breaking_force_N=None)
    values = typical(name, config)
    looked = 0
    for seed in range(3):
        try:
            found = jump(with_effects(config, ((name, values),)), course(config, seed))
        except InputError:  # an open circuit's cable that this effect lets slacken
            assert rig in OPEN
            continue
        looked += 1
        assert found < JUMP
    assert looked


@pytest.mark.parametrize("coefficient", [0.2, 0.5, 1.0, 3.0, 20.0, 150.0, 1000.0])
def test_no_row_jumps_where_slip_is_viscous(coefficient: float) -> None:
    config = joint()
    wet = with_effects(config, (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}),))
    assert max(jump(wet, course(config, seed)) for seed in range(8)) < JUMP


@pytest.mark.parametrize("coefficient", [3.0, 1000.0])
@pytest.mark.parametrize("rig", ["snow-closed-rig", *OPEN])
def test_no_row_jumps_where_slip_is_viscous_and_goes_by_tension_and_place(
    rig: str, coefficient: float
) -> None:
    config = joint(rig, breaking_force_N=None)
    laws = (
        ("pressure_dependent_friction", {"exponent": 0.3, "lost": 0.6, "place": 0.8}),
        ("position_dependent_friction", {"amplitude": -0.6, "order": 4.0, "input_amplitude": 0.5}),
        ("nonlinear_cable", {"stiffening": 0.4}),
    )
    wet = with_effects(config, (("viscous_slip", {"coefficient_Ns_per_m_rad": coefficient}), *laws))
    assert jump(wet, course(config, 1, 600)) < JUMP


@pytest.mark.parametrize("delay", [-0.03, 0.004, 0.03])
def test_no_row_jumps_where_speeds_are_read_in_steps(delay: float) -> None:
    """Of a speed that is read in steps the last digit says whether it bends evenly."""
    config = joint()
    late = with_effects(config, (("clock_skew", {"delay_s": delay}),))
    assert max(jump(late, course(config, seed, 1000, digits=True), by_rows) for seed in range(5)) < JUMP
