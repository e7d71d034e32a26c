"""What is asked: events only where there is a before and an after."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from turning import JOINT, gathered, hypothesis, recorded

from cablecomp.config import JointConfig
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.instants import instants
from cablecomp.diagnosis.explain.model import no_answer
from cablecomp.diagnosis.explain.plausible import falls_between, over_plausible
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import of_drive, of_effect, reach_of
from cablecomp.estimation.problem import Problem, Weighing


def test_an_event_is_asked_for_inside_of_recordings_and_between_those_of_a_session() -> None:
    """Between sessions the joint was taken apart: what changed there is no event."""
    body = gather_body(JOINT, {"a/1": recorded(seed=1), "a/2": recorded(seed=2), "b/1": recorded(seed=3)})
    spans = [(e.columns["time_s"][0], e.columns["time_s"][-1]) for e in body.used]
    between_a, between_ab = (spans[0][1], spans[1][0]), (spans[1][1], spans[2][0])
    asked = np.array(instants(body.used, between=True))
    assert np.any((asked > between_a[0]) & (asked < between_a[1]))
    assert not np.any((asked > between_ab[0]) & (asked < between_ab[1]))
    for first, last in spans:
        inside = asked[(asked >= first) & (asked <= last)]
        assert len(inside) >= 3
        assert inside.min() >= first + 0.9 * LIMITS.edge * (last - first)


VAGUE = JOINT.model_copy(update={"tolerance": {**JOINT.tolerance, "pretension_N": 1.0}})
"""The same joint with a pretension that is known by order of magnitude."""


def test_beside_a_drive_known_by_order_of_magnitude_an_event_lies_in_a_recording() -> None:
    """Recordings at other loads, one after the other, look like an event between them to a drive that is not known."""
    body = gather_body(VAGUE, {"a/1": recorded(seed=1), "a/2": recorded(seed=2)})
    spans = [(e.columns["time_s"][0], e.columns["time_s"][-1]) for e in body.used]
    slip = next(h for h in hypotheses(VAGUE, body.used) if h.effect.id == "clamp_slip")
    asked = [float(s.values["time_s"]) for s in slip.starts]
    assert len(asked) >= 6
    assert all(any(a < t < b for a, b in spans) for t in asked)

    def lost(config: JointConfig, instant_s: float, lasts_s: float = 0.0) -> bool:
        values = {slip.key("time_s"): instant_s, slip.key("duration_s"): lasts_s}
        problem = SimpleNamespace(parameters=of_drive(config), evidence=body.used)
        return falls_between(cast("Fit", SimpleNamespace(problem=problem, values=values)), slip)

    first_ends_s, second_begins_s = spans[0][1], spans[1][0]
    assert not lost(VAGUE, 0.5 * first_ends_s)
    assert lost(VAGUE, 0.5 * (first_ends_s + second_begins_s))
    assert lost(VAGUE, second_begins_s + 0.01)  # nothing of the recording lies before it
    assert lost(VAGUE, 0.5 * first_ends_s, lasts_s=1.05 * first_ends_s)  # nor after its middle
    assert not lost(JOINT, 0.5 * (first_ends_s + second_begins_s))


def test_of_a_known_drive_an_event_lies_in_a_session() -> None:
    """Between recordings of one mounting it may happen, between two mountings they differ as much without it."""
    body = gather_body(JOINT, {"a/1": recorded(seed=1), "a/2": recorded(seed=2), "b/1": recorded(seed=3)})
    ends = [(float(e.columns["time_s"][0]), float(e.columns["time_s"][-1])) for e in body.used]
    slip = next(h for h in hypotheses(JOINT, body.used) if h.effect.id == "clamp_slip")

    def why_none(instant_s: float, lasts_s: float = 0.0) -> str:
        values = {slip.key("time_s"): instant_s, slip.key("duration_s"): lasts_s}
        free = of_effect(slip.effect, {slip.amount.name: 1e-3}, JOINT)
        problem = SimpleNamespace(parameters=free, evidence=body.used, config=JOINT)
        fit = SimpleNamespace(problem=problem, values=values, x=np.array([p.x(1e-3) for p in free]))
        return no_answer(cast("Fit", fit), slip)

    within_a, within_ab = 0.5 * (ends[0][1] + ends[1][0]), 0.5 * (ends[1][1] + ends[2][0])
    assert why_none(0.5 * ends[0][1]) == ""
    assert why_none(within_a) == ""
    assert "falls between" in why_none(within_ab)
    assert "falls between" in why_none(0.5 * ends[1][1], lasts_s=within_ab)
    assert why_none(ends[2][1] + 1.0) == ""  # goes on beyond the last sample


def test_an_effect_that_reads_a_channel_is_asked_once_for_each_channel_that_varies() -> None:
    columns = recorded()
    columns["other_wrist_Nm"] = np.sin(columns["time_s"])
    columns["other_still_Nm"] = np.ones_like(columns["time_s"])
    names = [h.name for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": columns}).used)]
    assert "crosstalk:other_wrist_Nm" in names
    assert "crosstalk:other_still_Nm" not in names


def test_every_hypothesis_is_free_in_its_amount() -> None:
    """What says how much is fitted, whatever else is held."""
    columns = recorded()
    columns["other_wrist_Nm"] = np.sin(columns["time_s"])
    columns["temperature_degC"] = 20.0 + np.sin(0.1 * columns["time_s"])
    for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": columns}).used):
        free = [p.name for p in h.free(h.starts[0].values, JOINT)]
        assert f"effect.{h.effect.id}.{h.amount.name}" in free, h.name


def test_shapes_that_belong_together_are_asked_for_together() -> None:
    """Springs that close a gap, and the moment amid it; what yields late goes with what yields at once."""
    gap = hypothesis("termination_backlash", "termination_backlash")
    assert set(gap.starts[0].values) == {"gap_rad"}
    together = [v for v in gap.further if "closes_Nm" in v]
    assert len(together) >= 4
    assert all(set(v) == {"closes_Nm", "preload_Nm"} for v in together)
    assert any(v["preload_Nm"] < 0.0 for v in together)
    coupling = hypothesis("series_compliance", "series_compliance")
    assert set(coupling.starts[0].values) == {"compliance_rad_per_Nm"}
    asked = {frozenset(v) for v in coupling.further}
    by_angle, in_stages = {"swing", "order", "softest_rad"}, {"stage_Nm", "beyond"}
    by_load = ({"skew"}, {"stiffening_per_Nm"}, {"stiffening_per_Nm", "power"}, in_stages)
    assert asked == {frozenset(n) for n in (*by_load, by_angle)}
    rubber = hypothesis("series_compliance", "series_compliance:late_rad_per_Nm")
    assert set(rubber.starts[0].values) == {"late_rad_per_Nm", "lag_s", "compliance_rad_per_Nm"}
    assert rubber.further == ({"decades": 2.0},)


def test_beside_a_drive_known_by_order_of_magnitude_laws_are_asked_for_plainly() -> None:
    roughly = JOINT.model_copy(update={"tolerance": {**JOINT.tolerance, "EA_N": 1.0}})
    body = gather_body(JOINT, {"a/1": recorded()})
    known, vague = ({h.name: h for h in hypotheses(config, body.used)} for config in (JOINT, roughly))
    assert set(known) - set(vague) == {
        "clamp_slip:creep_m_per_Ns",
        "clamp_slip:creep_l_m_per_Ns",
        "position_dependent_friction:patch",
        "pressure_dependent_friction:adhesion",
        "pressure_dependent_friction:lost",
        "series_compliance:late_rad_per_Nm",
    }
    assert {k for values in vague["routing_friction"].further for k in values} == {"skew"}
    assert {k for values in known["routing_friction"].further for k in values} == {"skew", "place", "spread"}


@pytest.mark.parametrize(("lift_Nm", "varies"), [(0.0, True), (5.0, False)])
def test_a_clearance_that_varies_is_asked_for_where_the_load_changes_sign(
    lift_Nm: float, varies: bool
) -> None:
    """Under a load that keeps its sign all that shows of it is a run-out; a coupling yields under any load."""
    columns = recorded()
    columns = {**columns, "joint_torque_Nm": columns["joint_torque_Nm"] + lift_Nm}
    assert (float(np.min(columns["joint_torque_Nm"])) < 0.0) is varies
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": columns}).used)}
    gap, coupling = asked["termination_backlash"], asked["series_compliance"]
    assert any("swing" in values for values in gap.further) is varies
    assert any("preload_Nm" in values for values in gap.further)
    assert any("swing" in values for values in coupling.further)


def test_a_slip_of_any_kind_trades_no_places_with_friction_and_stiffness() -> None:
    """What is tried beyond what promises most are laws of the load's path: slips had crowded out a stiffening cable."""
    assert hypothesis("nonlinear_cable", "nonlinear_cable").trades
    for slip in ("clamp_slip", "clamp_slip:creep_m_per_Ns", "clamp_slip:creep_l_m_per_Ns"):
        assert not hypothesis("clamp_slip", slip).trades


def test_a_clamp_that_creeps_has_no_instant() -> None:
    slip, creep = (hypothesis("clamp_slip", f"clamp_slip{more}") for more in ("", ":creep_m_per_Ns"))
    assert slip.has_instant
    assert set(slip.starts[0].values) == {"slip_m", "time_s"}
    assert not creep.has_instant
    assert set(creep.starts[0].values) == {"creep_m_per_Ns", "holds_N"}


def test_a_weight_is_asked_for_on_a_base_that_each_further_channel_turns() -> None:
    rng = np.random.default_rng(5)
    columns = recorded()
    rolled = {**columns, "other_roll_rad": rng.uniform(-0.8, 0.8, len(columns["time_s"]))}
    body = gather_body(JOINT, {"a/1": rolled})
    found = {h.name: h for h in hypotheses(JOINT, body.used) if h.effect.id == "gravity_load"}
    assert set(found) == {"gravity_load", "gravity_load:other_roll_rad"}
    plain, tilted = found.values()
    assert set(plain.starts[0].values) == {"moment_Nm", "phase_rad"}
    turns = {float(s.values["tilt_rad_per_unit"]) for s in tilted.starts}
    assert len(turns) == 4
    assert min(turns) < 0.0 < max(turns)
    assert tilted.same_as(plain)
    leaks = [h for h in hypotheses(JOINT, body.used) if h.effect.id == "crosstalk"]
    assert not any(h.same_as(plain) for h in leaks)
    # a bend is asked for by what the channel reads at most
    for leak in leaks:
        (most,) = {float(np.max(np.abs(e.columns[leak.channel]))) for e in body.used}
        bends = [v["bend_per_unit"] for v in leak.further if "bend_per_unit" in v]
        assert bends == pytest.approx([-0.6 / most, 0.6 / most])
        # and a slack by a share of that
        assert [v["slack_units"] for v in leak.further if "slack_units" in v] == pytest.approx([0.35 * most])
        assert leak.effect.parameter("slack_units").high == pytest.approx(0.9 * most)
    assert "other:roll_rad" in tilted.acts_through
    assert not any(name.startswith("other") for name in plain.acts_through)
    # without a unit it may be a neighbour's load, and turns nothing
    body = gather_body(JOINT, {"a/1": {**columns, "other_1": rolled["other_roll_rad"]}})
    assert {h.name for h in hypotheses(JOINT, body.used) if h.effect.id == "gravity_load"} == {"gravity_load"}


def test_where_the_load_is_read_at_the_motor_its_friction_is_asked_for_and_what_it_feels_is_not() -> None:
    columns = {**recorded(), "motor_torque_Nm": recorded()["joint_torque_Nm"]}
    for source, asked in (("joint_torque", True), ("motor_torque", False)):
        read = JOINT.model_copy(update={"observer": JOINT.observer.model_copy(update={"load": source})})
        one = gather(read, "one", columns, "a", fine_rows=400, judged_rows=60)
        found = {h.effect.id for h in hypotheses(read, [one])}
        assert "motor_friction" in found
        for effect in ("bearing_friction", "gravity_load", "inertial_load"):
            assert (effect in found) == asked


def test_friction_of_the_motor_may_be_as_large_as_the_torques_it_was_seen_to_give() -> None:
    """No cable bears it, so that a loose cable says nothing of it."""
    torque = 8.0 * JOINT.drive.stage[0].input_radius_m * JOINT.drive.stage[0].pretension_N
    given = {**recorded(), "motor_torque_Nm": torque * np.sin(recorded()["time_s"])}
    one = gather(JOINT, "one", given, "a", fine_rows=400, judged_rows=60)
    friction = next(h for h in hypotheses(JOINT, [one]) if h.effect.id == "motor_friction")
    plain = Problem(JOINT, (), (one,), Weighing({"joint_position_rad": 1e-5}, {}))
    problem = with_entry(plain, friction, friction.entry({"torque_Nm": 0.5 * torque, "presliding_rad": 1e-3}))
    fit = Fit(problem, problem.start, np.empty(0), np.empty((0, len(problem.parameters))))
    assert over_plausible(fit, friction) == pytest.approx(0.5, rel=0.02)


def test_a_neighbour_may_load_the_cable_as_much_as_what_is_measured() -> None:
    """Loads may be many times R T0; then so may what the channel does not see."""
    columns = recorded()
    columns["joint_torque_Nm"] *= 10.0
    columns["other_arm_Nm"] = 0.2 * np.sin(columns["time_s"])
    (one,) = gather_body(JOINT, {"a/1": columns}).used
    neighbour = next(h for h in hypotheses(JOINT, [one]) if h.name == "crosstalk:other_arm_Nm")
    largest = max(abs(b) for b in neighbour.amount.bounds(JOINT)) * np.max(
        np.abs(one.columns["other_arm_Nm"])
    )
    load = float(np.max(np.abs(one.columns["joint_torque_Nm"])))
    assert load > 3.0 * largest
    plain = Problem(JOINT, (), (one,), Weighing({"joint_position_rad": 1e-5}, {}))
    coefficient = 0.5 * load / float(np.max(np.abs(one.columns["other_arm_Nm"])))
    problem = with_entry(
        plain,
        neighbour,
        neighbour.entry({"channel": "other_arm_Nm", "load_coefficient": coefficient}),
    )
    fit = Fit(problem, problem.start, np.empty(0), np.empty((0, len(problem.parameters))))
    assert over_plausible(fit, neighbour) == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize("load", ["joint_torque", "motor_torque"])
def test_a_drag_of_the_motor_is_asked_for_where_the_load_is_read_there(load: str) -> None:
    """In a torque that stands beside the load, any drag in the cable's path would be the motor's."""
    config = JOINT.model_copy(update={"observer": JOINT.observer.model_copy(update={"load": load})})
    columns = recorded()
    columns["motor_torque_Nm"] = 0.3 * columns["joint_torque_Nm"]
    (own,) = [
        h
        for h in hypotheses(config, gather_body(config, {"a/1": columns}).used)
        if h.name == "motor_friction"
    ]
    drags = any("viscous_s_per_rad" in further for further in own.further)
    assert drags == (load == "motor_torque")


@pytest.mark.parametrize("read", [True, False])
def test_a_drag_of_the_joint_is_asked_for_where_the_motors_torque_is_read(read: bool) -> None:
    """By the joint's angle alone it is a channel that comes late. Where every sample is run it is all that is asked."""
    columns = recorded()
    if read:
        columns["motor_torque_Nm"] = 0.3 * columns["joint_torque_Nm"]
    pool = hypotheses(JOINT, gather_body(JOINT, {"a/1": columns}).used)
    (own,) = [h for h in pool if h.name == "bearing_friction"]
    assert any("viscous_s_per_rad" in further for further in own.further) == read
    assert {name for further in own.further_at_speed for name in further} == (
        {"viscous_s_per_rad"} if read else set()
    )
    assert len(own.further) > len(own.further_at_speed)


def test_in_an_open_circuit_no_event_happens_to_the_other_cable() -> None:
    """Below zero an event's size means cable l, of which an open circuit has none."""
    open_circuit = JOINT.model_copy(update={"drive": JOINT.drive.model_copy(update={"circuit": "open"})})
    for config, sides in ((JOINT, True), (open_circuit, False)):
        pool = hypotheses(config, gather_body(config, {"a/1": recorded()}).used)
        events = [h for h in pool if h.has_instant]
        assert {h.effect.id for h in events} == {"clamp_slip", "strand_break"}
        assert all(h.two_sided is sides for h in events)
        assert all((reach_of(h.amount, config)[0] < 0.0) is sides for h in events)


@pytest.mark.parametrize(("pretension_N", "turn_rad"), [(1.0, 0.01), (1000.0, None)])
def test_a_slack_drive_may_slip_by_half_a_degree(pretension_N: float, turn_rad: float | None) -> None:
    """By how far friction on the wraps lets its cables stretch a tight drive slips, by T0/(EA mu) on either drum; a
    slack one's clamps hold no better."""
    (stage,) = JOINT.drive.stage
    slack = stage.model_copy(update={"pretension_N": pretension_N})
    config = JOINT.model_copy(update={"drive": JOINT.drive.model_copy(update={"stage": (slack,)})})
    ratio = slack.input_radius_m / slack.output_radius_m
    stretched = pretension_N / slack.EA_N * (1.0 / slack.mu_output + ratio / slack.mu_input)
    assert (stretched < 0.01) is (turn_rad is not None)
    (amount,) = {h.amount for h in hypotheses(config, gathered()) if h.name == "clamp_slip"}
    assert amount.bounds(config)[1] == pytest.approx(slack.output_radius_m * (turn_rad or stretched))


@pytest.mark.parametrize("warm", [True, False])
def test_that_warmth_quickens_creep_is_asked_where_a_temperature_moves(warm: bool) -> None:
    (creep,) = [h for h in hypotheses(JOINT, gathered(warm=warm)) if h.effect.id == "pretension_relaxation"]
    asked = {name for further in creep.further for name in further}
    assert {"power", "steady"} <= asked
    assert ("quickening_per_K" in asked) is warm


def test_of_a_joint_that_is_held_still_all_is_asked_too() -> None:
    columns = {**recorded(), "joint_position_rad": np.full(1000, 0.1)}
    held = gather(JOINT, "held", columns, "all", fine_rows=1000, judged_rows=100)
    assert len(hypotheses(JOINT, [held])) == len(hypotheses(JOINT, gathered()))


def test_where_shapes_start_hears_nothing_of_what_is_kept_for_the_end() -> None:
    (used,) = gathered()
    angle = used.columns["joint_position_rad"]
    last = used.rows[np.flatnonzero(used.counted["joint_position_rad"])[-1]]
    later = np.where(np.arange(len(angle)) > last, angle + 9.0, angle)
    other = replace(used, columns={**used.columns, "joint_position_rad": later})
    one, two = (hypotheses(JOINT, [e]) for e in (used, other))
    assert last < len(angle) - 1
    assert [h.starts for h in one] == [h.starts for h in two]
    assert used.deflection_rad == other.deflection_rad
