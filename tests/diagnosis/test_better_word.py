"""Shapes at which another effect is the better word, or one that has no name here."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from turning import JOINT, gathered, hypothesis, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain.held_down import greased, in_part_a_drag
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.model import Model, Round
from cablecomp.diagnosis.explain.plausible import better_word
from cablecomp.diagnosis.explain.scores import ScoreDifference
from cablecomp.estimation.least_squares import Fit


def test_a_gap_that_closes_over_much_of_the_load_is_better_called_a_coupling() -> None:
    gap = hypothesis("termination_backlash", "termination_backlash")
    free = {
        p.base.rpartition(".")[2]: p for p in gap.free(dict.fromkeys(("gap_rad", "closes_Nm"), 0.1), JOINT)
    }
    most = free["closes_Nm"].high

    def word(gap_rad: float, closes_Nm: float) -> str:
        ends = [free["gap_rad"], free["closes_Nm"]]
        low, high = (np.array([p.x(getattr(p, end)) for p in ends]) for end in ("low", "high"))
        problem = SimpleNamespace(parameters=ends, bounds=lambda: (low, high))
        x = np.array([p.x(v) for p, v in zip(ends, (gap_rad, closes_Nm), strict=True)])
        return better_word(cast("Fit", SimpleNamespace(problem=problem, x=x, values={})), gap)

    assert most == gap.effect.parameter("closes_Nm").bounds(JOINT)[1]
    assert word(0.1, most) == "closes_Nm"
    assert word(0.1, free["closes_Nm"].low) == ""  # a gap that closes at once is one
    assert word(free["gap_rad"].high, 0.5 * most) == ""


def test_strands_that_nothing_holds_are_better_called_a_compliance() -> None:
    strands, bare = (
        hypothesis("strand_friction", "strand_friction"),
        SimpleNamespace(parameters=(), config=JOINT),
    )
    least = strands.effect.parameter("yield_N").bounds(JOINT)[0]
    for held_N, word in ((2.0 * least, ""), (0.1 * least, "yield_N")):
        values = {strands.key("yield_N"): held_N, strands.key("fraction"): 1.0}
        fit = SimpleNamespace(problem=bare, x=np.empty(0), values=values)
        assert better_word(cast("Fit", fit), strands) == word


@pytest.mark.parametrize(
    ("viscous", "word", "mixed"),
    [
        (0.0, "presliding_rad", False),
        (0.1, "presliding_rad", False),
        (3.0, "presliding_rad", True),
        (30.0, "", False),
    ],
)
def test_a_bearing_that_gives_way_for_long_is_another_but_where_it_mostly_drags(
    viscous: float, word: str, mixed: bool
) -> None:
    """The joint moves at some 0.3 rad/s. Beside a path's friction nothing tells whose grease it is; and what drags in
    part may be anything that yields late."""
    columns = recorded(JOINT)
    columns["motor_torque_Nm"] = 0.3 * columns["joint_torque_Nm"]
    evidence = gather_body(JOINT, {"a/1": columns}).used
    bearing, path = (
        next(h for h in hypotheses(JOINT, evidence) if h.name == name)
        for name in ("bearing_friction", "routing_friction")
    )
    values = {bearing.key("presliding_rad"): 1.0, bearing.key("viscous_s_per_rad"): viscous}
    problem = SimpleNamespace(parameters=(), config=JOINT, evidence=evidence)
    fit = SimpleNamespace(problem=problem, x=np.empty(0), values=values)
    assert better_word(cast("Fit", fit), bearing) == word
    alone, beside = (
        cast("Model", SimpleNamespace(terms=terms, fit=fit)) for terms in ((bearing,), (bearing, path))
    )
    assert greased(alone, bearing) == ""
    assert bool(greased(beside, bearing)) == (word == "")
    assert greased(beside, path) == ""
    assert bool(in_part_a_drag(alone, bearing, (), 5.0)) == mixed
    assert in_part_a_drag(beside, path, (), 5.0) == ""
    for other, lead, held in ((0.7, 5.0, False), (0.97, 5.0, mixed), (0.7, 1.9, mixed)):
        taken_off = ((bearing, 0.99), (path, other))
        tried = [
            SimpleNamespace(
                term=h,
                model=SimpleNamespace(terms=(h,)),
                difference=ScoreDifference(gain, 9.0, 9.0),
            )
            for h, gain in taken_off
        ]
        rounds = cast("list[Round]", [SimpleNamespace(tried=tried)])
        assert bool(in_part_a_drag(alone, bearing, rounds, lead)) == held


def test_a_coupling_at_its_bound_is_better_called_play_where_it_has_no_power_of_its_own() -> None:
    coupling = hypothesis("series_compliance", "series_compliance")
    shapes = ("stiffening_per_Nm", "power")
    free = {p.base.rpartition(".")[2]: p for p in coupling.free(dict.fromkeys(shapes, 0.5), JOINT)}
    ends = [free[name] for name in shapes]
    at = np.array([p.x(p.high) for p in ends])

    def word(**power: float) -> str:
        problem = SimpleNamespace(parameters=ends, config=JOINT)
        values = {coupling.key(name): v for name, v in {"stiffening_per_Nm": ends[0].high, **power}.items()}
        fit = SimpleNamespace(problem=problem, x=at, values=values)
        return better_word(cast("Fit", fit), coupling)

    assert word() == "stiffening_per_Nm"
    assert word(power=1e-4) == "power"
    assert word(power=0.4) == ""  # a diaphragm, bent at first and stretched the more it turns
    assert word(power=1.8) == ""


@pytest.mark.parametrize(
    ("stiffening", "power", "word"), [(2.0, 1e-4, "power"), (2.0, 0.4, ""), (0.0, 1e-4, "")]
)
def test_a_coupling_that_yields_at_once_and_then_no_more_is_better_called_play(
    stiffening: float, power: float, word: str
) -> None:
    coupling = hypothesis("series_compliance", "series_compliance")
    problem = SimpleNamespace(parameters=(), config=JOINT)
    values = {coupling.key("stiffening_per_Nm"): stiffening, coupling.key("power"): power}
    fit = SimpleNamespace(problem=problem, x=np.empty(0), values=values)
    assert better_word(cast("Fit", fit), coupling) == word


@pytest.mark.parametrize(
    ("compliance", "lag_s", "decades", "word"),
    [(0.0, 0.05, 0.0, "lag_s"), (0.0, 0.5, 0.0, ""), (0.0, 0.05, 2.0, ""), (1e-3, 0.05, 0.0, "")],
)
def test_a_coupling_that_follows_at_once_and_yields_no_other_way_is_better_called_a_late_reading(
    compliance: float, lag_s: float, decades: float, word: str
) -> None:
    coupling = hypothesis("series_compliance", "series_compliance:late_rad_per_Nm")
    shown = {
        "compliance_rad_per_Nm": compliance,
        "late_rad_per_Nm": 1e-3,
        "lag_s": lag_s,
        "decades": decades,
    }
    values = {coupling.key(name): value for name, value in shown.items()}
    problem = SimpleNamespace(parameters=(), config=JOINT)
    fit = SimpleNamespace(problem=problem, x=np.empty(0), values=values)
    assert better_word(cast("Fit", fit), coupling) == word


@pytest.mark.parametrize(
    ("swings", "rad_s", "damping_ratio", "word"),
    [
        (1.0, 0.4, 0.5, "swings"),  # a drag of 2 z w J and a spring
        (1.0, 30.0, 0.2, ""),  # at the end of a flexible link
        (1.0, 0.44, 1.7, "swings"),  # a drag alone
        (1.0, 0.4, 6.0, ""),  # dragged along
        (0.7, 0.4, 0.5, ""),  # the rest is on the joint
    ],
)
def test_an_inertia_that_swings_away_as_a_whole_is_none(
    swings: float, rad_s: float, damping_ratio: float, word: str
) -> None:
    load = hypothesis("inertial_load", "inertial_load")
    given = {"swings": swings, "swings_rad_s": rad_s, "damping_ratio": damping_ratio}
    fit = SimpleNamespace(
        problem=SimpleNamespace(parameters=(), config=JOINT),
        x=np.empty(0),
        values={load.key(name): value for name, value in given.items()},
    )
    assert better_word(cast("Fit", fit), load) == word


@pytest.mark.parametrize(
    ("exponent", "lost", "word"),
    [
        (-0.3, -0.5, "lost"),
        (-0.3, 0.5, "lost"),
        (-0.3, 0.0, ""),
        (0.0, -0.5, ""),
        (0.5, -0.5, ""),
        (0.5, 0.5, ""),
    ],
)
def test_a_coefficient_that_grows_by_a_power_and_turns_beyond_a_pressure_is_another_friction(
    exponent: float, lost: float, word: str
) -> None:
    """A film of grease that is pressed through gains or loses beyond a pressure, and does not grow by a power, too."""
    law = hypothesis("pressure_dependent_friction", "pressure_dependent_friction")
    values = {law.key("exponent"): exponent, law.key("lost"): lost}
    problem = SimpleNamespace(parameters=(), config=JOINT)
    assert (
        better_word(cast("Fit", SimpleNamespace(problem=problem, x=np.empty(0), values=values)), law) == word
    )


@pytest.mark.parametrize(
    ("share", "known", "word"),
    [
        (0.05, True, ""),
        (0.2, True, "presliding_rad"),
        (0.2, False, ""),
        (0.005, True, ""),
        (0.003, True, "presliding_rad"),
        (0.003, False, ""),
    ],
)
def test_friction_that_builds_up_over_much_of_the_deflection_or_at_once_is_no_bearings(
    share: float, known: bool, word: str
) -> None:
    """A hysteresis of the drive, or what another friction's form leaves at reversals, where the drive is known."""
    law, used = hypothesis("bearing_friction", "bearing_friction"), gathered()
    joint, motor = (used[0].columns[name] for name in ("joint_position_rad", "motor_position_rad"))
    slope, middle = np.polyfit(motor, joint, 1)
    seen = float(np.ptp(np.quantile(joint - slope * motor - middle, (0.01, 0.99))))
    drive = SimpleNamespace(base="EA_N", vague=not known, of_effect=False, high=2.0, value=lambda x: 1.0)
    problem = SimpleNamespace(parameters=[drive], config=JOINT, evidence=used[:1])
    fit = SimpleNamespace(problem=problem, x=np.zeros(1), values={law.key("presliding_rad"): share * seen})
    assert better_word(cast("Fit", fit), law) == word


def test_friction_that_only_the_load_makes_is_no_bearings() -> None:
    law = hypothesis("bearing_friction", "bearing_friction")
    (growth,) = [p for p in law.free({"growth_per_Nm": 1.0}, JOINT) if p.base.endswith("growth_per_Nm")]
    for value, word in ((0.5 * growth.high, ""), (growth.high, "growth_per_Nm")):
        problem = SimpleNamespace(parameters=[growth], config=JOINT, evidence=())
        fit = SimpleNamespace(problem=problem, x=np.array([growth.x(value)]), values={})
        assert better_word(cast("Fit", fit), law) == word


def test_a_pretension_that_follows_later_than_a_recording_lasts_is_better_called_a_drift() -> None:
    used = gathered(warm=True)
    longest = max(float(np.ptp(e.columns["time_s"])) for e in used)
    (thermal,) = [h for h in hypotheses(JOINT, used) if h.effect.id == "thermal_pretension"]
    tried = [further["lag_s"] for further in thermal.further if "lag_s" in further]
    assert max(thermal.entry({"coefficient_per_K": 0.01, "lag_s": t}).lag_s for t in tried) <= longest
    (lag,) = [p for p in thermal.free({"lag_s": 5.0}, JOINT) if p.base.endswith("lag_s")]
    assert lag.high == longest
    for lag_s, word in ((0.5 * longest, ""), (longest, "lag_s")):
        problem = SimpleNamespace(parameters=[lag], config=JOINT)
        fit = SimpleNamespace(problem=problem, x=np.array([lag.x(lag_s)]), values={lag.name: lag_s})
        assert better_word(cast("Fit", fit), thermal) == word
