"""How a drive stands in a session: another pretension leaves the cable and its coat the same material."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from knees import stiff_share
from turning import JOINT, recorded

from cablecomp.config import JointConfig, in_session, parse_joint
from cablecomp.config.sessions import Session
from cablecomp.config_text import joint_text
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.estimation.gather import gather
from cablecomp.estimation.standing import apart_of, as_it_stood, at_pretension, standing, value_of
from cablecomp.signal.smoothing import FloatArray


def both(steady: float = 0.0, knee: float = 0.0, again: float = 0.0, **coat: float) -> JointConfig:
    """The joint with a cable that stiffens and a coat."""
    by_pressure = {"exponent": 0.25, **coat}
    by_pull = {"stiffening": 0.3, "steady": steady, "knee": knee, "again": again}
    return with_effects(JOINT, [("nonlinear_cable", by_pull), ("pressure_dependent_friction", by_pressure)])


TENSIONS = np.linspace(20.0, 120.0, 11)


def stiffness(config: JointConfig) -> np.ndarray:
    """EA(T) = EA/(w + (1 - w) f), f = 1/(1 + b (T/T0 - 1)), with a knee (1 - b S(T/T0))/(1 - b S(1)) [N]."""
    stage = config.drive.stage[0]
    (cable,) = [e.parameters for e in config.effect if e.id == "nonlinear_cable"]
    b, w = float(cable["stiffening"]), float(cable.get("steady", 0.0))
    tau, u = TENSIONS / stage.pretension_N, float(cable.get("knee", 0.0))
    gives = 1.0 / (1.0 + b * (tau - 1.0))
    if u:
        again = u * float(cable.get("again", 0.0))
        rise, at_1 = (stiff_share(t, u, again) for t in (tau, 1.0))
        gives = (1.0 - b * rise) / (1.0 - b * at_1)
    return np.asarray(stage.EA_N / (w + (1.0 - w) * gives))


def friction(config: JointConfig, key: str) -> np.ndarray:
    """mu(T) = mu0 (T/T0)^-n (1 - a + a (T/T0)^-k), less where T is far above T0 u."""
    stage = config.drive.stage[0]
    (coat,) = [e.parameters for e in config.effect if e.id == "pressure_dependent_friction"]
    tau = TENSIONS / stage.pretension_N
    n, lost, place = (float(coat.get(k, v)) for k, v in (("exponent", 0.0), ("lost", 0.0), ("place", 1.0)))
    a, k = (float(coat.get(name, v)) for name, v in (("adhesion", 0.0), ("adhesion_power", 1.0)))
    stuck = 1.0 - a + a * tau**-k
    return np.asarray(getattr(stage, key) * tau**-n * stuck * (1.0 - lost * tau**10 / (tau**10 + place**10)))


@pytest.mark.parametrize(
    "coat",
    [
        {},
        {"steady": 0.4},
        {"adhesion": 0.5},
        {"adhesion": 0.3, "adhesion_power": 2.0, "lost": 0.4, "place": 0.8},
        {"knee": 1.2},
        {"steady": 0.4, "knee": 0.8},
        {"knee": 0.6, "again": 2.0},
        {"lost": 0.6, "place": 1.3},
        {"lost": -0.4},
    ],
)
@pytest.mark.parametrize("factor", [0.7, 1.0, 1.6])
def test_another_pretension_keeps_the_laws_of_cable_and_coat(factor: float, coat: dict[str, float]) -> None:
    here = both(**coat)
    there = at_pretension(here, factor * here.drive.stage[0].pretension_N)
    assert there.drive.stage[0].pretension_N == pytest.approx(factor * here.drive.stage[0].pretension_N)
    np.testing.assert_allclose(stiffness(there), stiffness(here), rtol=1e-12)
    for key in ("mu_output", "mu_input"):
        np.testing.assert_allclose(friction(there, key), friction(here, key), rtol=1e-12)


def test_a_plain_cable_changes_its_pretension_alone() -> None:
    there = at_pretension(JOINT, 33.0)
    same = there.drive.stage[0].model_dump() | {"pretension_N": JOINT.drive.stage[0].pretension_N}
    assert same == JOINT.drive.stage[0].model_dump()


PLAIN = tomllib.loads(joint_text(JOINT))
BENT = {
    "condition": {"bend_rad": "other_bend"},
    "effect": [{"id": "routing_friction", "mu_angle": 0.3, "arc_length_m": 0.01}],
    "depends": [
        {"parameter": "effect.routing_friction.mu_angle", "on": "bend_rad", "per_unit": 0.2, "at": 0.0,
         "seen": [0.0, 2.0]}
    ],
    "session": [{"name": "straight", "recordings": ["straight.csv"], "values": {"pretension_N": 70.0}}],
}  # fmt: skip


def bent(bend: float) -> dict[str, FloatArray]:
    return {"other_bend": np.array([bend, np.nan, bend])}


def test_a_posture_that_no_session_claims_stands_as_its_law_says() -> None:
    joint = parse_joint({**PLAIN, **BENT}, "bent")
    assert parse_joint(tomllib.loads(joint_text(joint)), "again") == joint
    stood, session, said = as_it_stood(joint, Path("new.csv"), lambda: bent(1.5))
    assert (stood.effect[0].parameters["mu_angle"], session, said) == (pytest.approx(0.6), None, ())
    stood, session, _ = as_it_stood(joint, Path("straight.csv"), lambda: bent(1.5))
    assert (stood.drive.stage[0].pretension_N, session) == (70.0, "straight")
    assert stood.effect[0].parameters["mu_angle"] == 0.3


def test_beyond_what_told_a_law_it_is_held_and_said() -> None:
    joint = parse_joint({**PLAIN, **BENT}, "bent")
    stood, _, said = as_it_stood(joint, Path("new.csv"), lambda: bent(5.0))
    assert stood.effect[0].parameters["mu_angle"] == pytest.approx(0.7)
    assert "bend_rad = 5 lies beyond 0 to 2" in said[0]
    with pytest.raises(InputError, match="other_bend"):
        as_it_stood(joint, Path("new.csv"), dict)


def test_a_gain_that_leaves_the_cable_no_tension_is_one_line() -> None:
    """In a fit that asks for it (of no drive that can be), and in a recording that no session claims."""
    tension = JOINT.drive.stage[0].pretension_N
    e = gather(JOINT, "one", recorded(), "all", fine_rows=400, judged_rows=60)
    with pytest.raises(InputError, match=f"`pretension_N` would come to -{tension:g}"):
        standing(JOINT, {"pretension_N~bend_rad": -tension}, replace(e, condition={"bend_rad": 2.0}))
    law = {"parameter": "pretension_N", "on": "bend_rad", "per_unit": -tension, "at": 0.0, "seen": [0.0, 2.0]}
    joint = parse_joint({**PLAIN, **BENT, "depends": [law]}, "bent")
    with pytest.raises(InputError, match="greater than 0"):
        as_it_stood(joint, Path("new.csv"), lambda: bent(2.0))


def standing_apart(config: JointConfig, values: dict[str, float], stated: dict[str, float]) -> JointConfig:
    """The joint with these common values in a recording of which its configuration states others."""
    e = gather(config, "one", recorded(), "all", fine_rows=400, judged_rows=60)
    return standing(config, values, replace(e, apart=apart_of(config, stated)))


def test_what_a_recording_differs_by_stays_where_the_common_values_move() -> None:
    stage = JOINT.drive.stage[0]
    stated = {"pretension_N": 1.5 * stage.pretension_N, "joint_torque_offset_Nm": 0.1}
    found = standing_apart(JOINT, {}, stated)
    assert found.drive.stage[0].pretension_N == pytest.approx(1.5 * stage.pretension_N)
    moved = standing_apart(JOINT, {"pretension_N": 40.0, "joint_torque_offset_Nm": -0.02}, stated)
    assert moved.drive.stage[0].pretension_N == pytest.approx(60.0)
    assert moved.sensors.joint_torque_offset_Nm == pytest.approx(0.08)
    own = standing_apart(JOINT, {"pretension_N@all": 35.0}, stated)
    assert own.drive.stage[0].pretension_N == pytest.approx(35.0)


def test_a_stage_of_its_own_stands_as_stated_beside_all_stages() -> None:
    two = parse_joint({**PLAIN, "drive": {**PLAIN["drive"], "stage": 2 * PLAIN["drive"]["stage"]}}, "two")
    stated = {"pretension_N": 90.0, "pretension_N.2": 30.0}
    found = standing_apart(two, {}, stated)
    assert [s.pretension_N for s in found.drive.stage] == pytest.approx([90.0, 30.0])
    assert found == in_session(two, Session(name="x", values=stated))


def test_events_that_are_stated_stand_on_the_clock_of_the_recordings_together() -> None:
    slipping = with_effects(JOINT, [("clamp_slip", {"slip_m": 1e-4, "time_s": 3.0})])
    name = "effect.clamp_slip.time_s"
    for stated, instant_s in (({}, 103.0), ({name: 7.0}, 107.0)):
        apart = apart_of(slipping, stated, shift_s=100.0)
        e = gather(slipping, "one", recorded(), "all", fine_rows=400, judged_rows=60)
        stood = standing(slipping, {}, replace(e, apart=apart))
        assert value_of(stood, name) == pytest.approx(instant_s)
    assert apart_of(slipping, {}) == {}


def test_a_law_on_what_is_no_condition_is_refused() -> None:
    with pytest.raises(InputError, match="bend_rad"):
        parse_joint({**PLAIN, **BENT, "condition": {}}, "bent")


def test_a_value_that_an_effect_leaves_out_is_the_one_that_stands_for_it() -> None:
    slipping = with_effects(JOINT, [("clamp_slip", {"slip_m": 1e-4, "time_s": 3.0})])
    assert value_of(slipping, "effect.clamp_slip.duration_s") == 0.0
    with pytest.raises(InputError, match=r"no number `size_m`; it takes slip_m"):
        value_of(slipping, "effect.clamp_slip.size_m")
