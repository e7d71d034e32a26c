"""The thesis's open questions, simulated by two sets of equations: the plant's and the observer's."""

from __future__ import annotations

import math
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

from cablecomp.cli.study import by_plant
from cablecomp.config import load_joint
from cablecomp.thesis.bench.cycle import Bench, Rigs, Signature, by_observer
from cablecomp.thesis.bench.study import answers, best_of
from cablecomp.thesis.bench.suspects import Suspect, suspects
from cablecomp.thesis.bench.vectors import DriveOnBench

JOINTS = Path(__file__).parents[2] / "configs" / "joints"
NAMED = {s.id: s for s in suspects()}


@pytest.fixture(scope="module")
def rigs() -> Rigs:
    return Rigs(load_joint(JOINTS / "snow-open-rig.toml"), load_joint(JOINTS / "snow-closed-rig.toml"))


@pytest.fixture(scope="module")
def plant(rigs: Rigs) -> Bench:
    return Bench(rigs, by_plant)


@pytest.fixture(scope="module")
def observer(rigs: Rigs) -> Bench:
    return Bench(rigs, by_observer)


def brief(bench: Bench, name: str, size: float) -> Signature:
    return bench.signature([NAMED[name]], [size], full=False)[0]


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("viscous_slip", 1.7),
        ("nonlinear_cable", 0.1),
        ("pressure_dependent_friction", 0.3),
        ("bearing_friction", 0.02),
    ],
)
def test_plant_and_observer_show_the_same(plant: Bench, observer: Bench, name: str, size: float) -> None:
    ours, theirs = brief(observer, name, size), brief(plant, name, size)
    np.testing.assert_allclose(astuple(ours)[:8], astuple(theirs)[:8], atol=0.005)


def test_what_depends_on_the_tension_s_size_turns_with_the_sign_of_the_load(plant: Bench) -> None:
    """A stiffening strand and friction that falls with pressure know tight from easy, as the thesis's mu do."""
    for name, size in (("nonlinear_cable", 0.1), ("pressure_dependent_friction", 0.3)):
        s = brief(plant, name, size)
        assert s.true_up > 1.01 > 0.995 > s.true_down
        assert s.acting_up < 0.99 < 1.005 < s.acting_down
        assert abs(s.creep_loading) < 1e-3


def test_a_bearing_widens_the_loop_whatever_the_sign(plant: Bench) -> None:
    """Coulomb friction is odd in motion and even in the sign of M_pk: alone it cannot turn round."""
    s = brief(plant, "bearing_friction", 0.02)
    assert min(s.true_up, s.true_down) > 1.02
    assert max(s.acting_up, s.acting_down) < 0.98
    less = brief(plant, "sensor bearing", -0.02)
    assert max(less.true_up, less.true_down) < 0.98


def test_viscous_slip_lags_and_creeps_but_rests_where_coulomb_friction_leaves_it(plant: Bench) -> None:
    small, large = (brief(plant, "viscous_slip", size) for size in (0.3, 1.0))
    for s in (small, large):
        assert abs(math.log(s.true_up)) < 0.005
        assert abs(math.log(s.true_down)) < 0.005
    assert 1.0 < small.lag_loading < large.lag_loading
    assert 1.0 < small.lag_unloading < large.lag_unloading
    assert 0.0 < small.creep_loading < large.creep_loading
    assert 0.0 < small.creep_unloading < large.creep_unloading


def test_slip_that_drags_and_a_strand_that_stiffens_answer_all_questions_together(plant: Bench) -> None:
    group: list[Suspect] = [NAMED["viscous_slip"], NAMED["nonlinear_cable"]]
    found = best_of(plant, None, group, [(1.0, 0.15)])
    assert answers(found) == ("yes", "yes", "yes", "yes")
    alone = [best_of(plant, None, [s], [(x,)]) for s, x in zip(group, (1.0, 0.15), strict=True)]
    assert all(set(answers(f)) != {"yes"} for f in alone)
    assert found.misfit < 0.5 * min(f.misfit for f in alone)


def test_loads_as_small_as_rounding_are_none(rigs: Rigs) -> None:
    for rig in (rigs.opened, rigs.closed):
        drive = DriveOnBench(rig.drive)
        tiny = drive.deflection(np.array([-1e-16, -1e-18, 0.0, 1e-18, 1e-16, 1e-9]), 1.0)
        assert np.all(np.abs(tiny) < 1e-9)
