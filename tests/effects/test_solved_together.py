"""A moment or a length that follows the joint's angle, solved with the cables' tensions at once: the same joint as by
settling the cables for every trial moment, which is how it goes where a stiffness follows the angle as well."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from effect_cases import excitation, joint, register_alone, typical, unit

from cablecomp.config import JointConfig
from cablecomp.effects import extend, with_effects
from cablecomp.effects.base import drum_radius
from cablecomp.effects.compiled_term import term
from cablecomp.mechanics.assemble import assemble
from cablecomp.mechanics.drive import N_SIZES
from cablecomp.mechanics.flat import records
from cablecomp.mechanics.records import TERM
from cablecomp.observer.compiled import CompiledJoint
from cablecomp.signal.smoothing import FloatArray

JOINTS = ("snow-closed-rig", "tendon-finger", "snow-open-rig", "capstan-arm", "two-stage-series")
STIFF = {"presliding_rad": 1e-7, "load_coefficient": 0.02}
"""A bearing that hardly gives way: it takes what the cables bring, and slips."""


@term(parameters=("stiffness",), state=("looked",))
def _spring_that_counts(c: Any, p: Any, s: Any) -> None:
    """A spring at the joint, and how often it was looked at."""
    c.moment += p.stiffness * c.joint
    c.moment_slope += p.stiffness
    s.looked += 1.0


@term(parameters=("share",))
def _cable_that_softens(c: Any, p: Any, s: Any) -> None:
    """A cable that is softer the further the joint has turned either way."""
    c.stiffness_h /= 1.0 + p.share * c.joint**2


def stepped(config: JointConfig, one_by_one: bool) -> tuple[FloatArray, float, float]:
    """Joint angles [rad] over an excitation; whether a row was left to the other way at the end; the first number of
    the first term's state."""
    columns = excitation(config)
    found = CompiledJoint(assemble(config, extend(config)), 1)
    found.start(0.0, 0.0)
    context = found.named.context
    angles = []
    for k, time in enumerate(columns["time_s"]):
        context.stiffness_follows = 1.0 if one_by_one else context.stiffness_follows
        found.put_other([columns["other_neighbour_Nm"][k]])
        found.put_sample(time, columns["motor_position_rad"][k], columns["joint_torque_Nm"][k], 0.0, 20.0)
        assert found.step(True) == (1, 0)
        angles.append(float(found.joint[0]))
    first = records(found.arrays.layout, N_SIZES, (1,), TERM)[0]
    return np.array(angles), float(context.stiffness_follows), float(found.memory[first.state_at])


@pytest.mark.parametrize("name", JOINTS)
@pytest.mark.parametrize(
    "effect",
    ["inertial_load", "gravity_load", "bearing_friction", "stiff bearing", "pulley_runout", "far out"],
)
def test_a_row_is_the_same_whichever_way_it_is_solved(name: str, effect: str) -> None:
    config = joint(name)
    if effect == "stiff bearing":
        entry = ("bearing_friction", {**STIFF, "torque_Nm": 0.3 * unit(config)})
    elif effect == "far out":
        entry = (
            "pulley_runout",
            {"eccentricity_m": 0.1 * drum_radius(config), "phase_rad": 0.7, "order": 3.0},
        )
    else:
        entry = (effect, typical(effect, config))
    bearing = ("bearing_friction", typical("bearing_friction", config))
    config = with_effects(config, [entry, bearing] if effect == "far out" else [entry])
    together, apart = stepped(config, one_by_one=False), stepped(config, one_by_one=True)
    assert np.ptp(together[0]) > 0.01
    assert together[0] == pytest.approx(apart[0], abs=1e-10)
    assert together[1] == 0.0


def test_a_row_that_is_solved_at_once_is_not_solved_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring is looked at before, after each step, and when the row is kept; were the row left to the other way, once
    and more beside what that looks itself."""
    register_alone(
        monkeypatch, "spring", "stiffness", lambda values: _spring_that_counts(stiffness=values["stiffness"])
    )
    config = joint(JOINTS[0])
    config = with_effects(config, [("spring", {"stiffness": unit(config)})])
    together, apart = stepped(config, one_by_one=False), stepped(config, one_by_one=True)
    assert together[0] == pytest.approx(apart[0], abs=1e-10)
    assert together[2] < apart[2] + len(together[0])


def test_a_stiffness_that_follows_the_angle_is_left_to_the_other_way_until_the_joint_starts_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    register_alone(monkeypatch, "soft", "share", lambda values: _cable_that_softens(share=values["share"]))
    config = with_effects(joint(JOINTS[0]), [("soft", {"share": 0.1})])
    assert stepped(config, one_by_one=False)[1] == 1.0
    found = CompiledJoint(assemble(config, extend(config)), 1)
    found.named.context.stiffness_follows = 1.0
    found.start(0.0, 0.0)
    assert found.named.context.stiffness_follows == 0.0
