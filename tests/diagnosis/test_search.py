"""The search among some of the recordings ends in a model of all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import Calibrated, calibrate_drive
from cablecomp.diagnosis.explain import search as search_module
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.model import Model, placed, reweighed
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.diagnosis.explain.search import Search, done_without, exchanged, search, without_effects
from cablecomp.diagnosis.folds import make_groups
from cablecomp.diagnosis.pace import Pace
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.estimation.least_squares import Fit, covariance, rms_left, solve, weighed

FREE = JOINT.model_copy(update={"tolerance": {"EA_N": 0.1}})
WEIGHT = {"moment_Nm": 0.3, "phase_rad": 0.6}


@pytest.fixture(scope="module")
def drive() -> Calibrated:
    many = {f"all/{k}": recorded(seed=k, duration_s=5.0) for k in range(LIMITS.searched + 3)}
    body = gather_body(FREE, many)
    assert len(body.used) > LIMITS.searched
    return calibrate_drive(FREE, body.used, np.random.default_rng(0))


@pytest.fixture(scope="module")
def heavy() -> tuple[Calibrated, Search]:
    """A drive that lifts a weight nobody stated, and the search that is asked for one."""
    weighed_down = with_effects(FREE, [("gravity_load", WEIGHT)])
    many = {f"all/{k}": recorded(weighed_down, seed=k, duration_s=5.0) for k in range(LIMITS.searched + 3)}
    drive = calibrate_drive(FREE, gather_body(FREE, many).used, np.random.default_rng(0))
    return drive, searched(drive, "gravity_load")


def of(drive: Calibrated, effect: str) -> list[Hypothesis]:
    """What is asked about an effect, in its usual form."""
    return [h for h in hypotheses(FREE, drive.fit.problem.evidence) if h.name == effect]


def searched(drive: Calibrated, *effects: str) -> Search:
    """The search among these effects alone."""
    pool = [h for effect in effects for h in of(drive, effect)]
    return search(drive, pool, np.random.default_rng(0), Pace(lambda what, share: None))


def test_where_nothing_is_asked_the_calibrated_drive_is_the_model_of_all_recordings(
    drive: Calibrated,
) -> None:
    told: list[str] = []
    found = search(drive, [], np.random.default_rng(0), Pace(lambda what, share: told.append(what)))
    assert found.final.terms == ()
    assert found.final.fit is drive.fit
    assert not found.cut_short
    assert told[-1] == "last fit"
    searched = found.selection.final.fit.problem.evidence
    assert len(searched) < len(drive.fit.problem.evidence)
    assert found.groups.folds == len(drive.fit.problem.evidence)


def test_the_final_fit_is_about_all_recordings_and_weighs_them_by_what_it_leaves(
    heavy: tuple[Calibrated, Search],
) -> None:
    drive, found = heavy
    evidence = drive.fit.problem.evidence
    assert [t.name for t in found.final.terms] == ["gravity_load"]
    fit = found.final.fit
    assert [e.name for e in fit.problem.evidence] == [e.name for e in evidence]
    assert len(found.selection.rounds[0].base.fit.problem.evidence) < len(evidence)
    own = weighed(fit, drive.floor)
    assert fit.problem.weighing.sigma == pytest.approx(own.sigma, rel=0.05)
    spread = np.sqrt(np.diag(covariance(fit)))
    for key, value in WEIGHT.items():
        k = next(k for k, p in enumerate(fit.problem.parameters) if p.name == f"effect.gravity_load.{key}")
        assert abs(fit.x[k] - fit.problem.parameters[k].x(value)) < 4.0 * spread[k]


def test_a_last_fit_that_cannot_be_followed_leaves_the_model_as_it_was_found(
    drive: Calibrated, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stranded(*_: Any) -> Fit:
        raise InputError("the tensions could not be solved")

    monkeypatch.setattr(search_module, "refit", stranded)
    found = search_module._settled((), drive.fit, drive, make_groups(drive.fit))
    assert found.fit is drive.fit


def test_how_far_zeros_may_move_in_the_last_fit_is_told_by_its_own_drive(
    heavy: tuple[Calibrated, Search],
) -> None:
    """Whatever a drive without the weight would keep of its history (0.02 rad here)."""
    drive, found = heavy
    keeps = replace(drive, floor=replace(drive.floor, zero_sd={"joint_position_rad": 0.02}))
    fit = search_module._settled(found.final.terms, found.final.fit, keeps, found.groups).fit
    assert fit.problem.weighing.zero_sd["joint_position_rad"] < 0.1 * 0.02
    assert rms_left(fit) == pytest.approx(rms_left(found.final.fit), rel=0.05)


def test_done_without_a_term_the_model_is_fitted_again(heavy: tuple[Calibrated, Search]) -> None:
    """A weight of 0.3 N m and friction that is not there: without the one the other holds, and the weight is found as
    before; both fits, about the recordings searched and about all, are done again."""
    drive, found = heavy
    (rubbing,) = of(drive, "bearing_friction")
    both, about = (beside(m, rubbing) for m in (found.final, found.selection.final))
    fewer = done_without(
        replace(found, final=both, selection=replace(found.selection, final=about)), rubbing, drive
    )
    assert fewer is not None
    for model, before in ((fewer.final, found.final), (fewer.selection.final, found.selection.final)):
        assert model.name == "gravity_load"
        assert len(model.fit.problem.evidence) == len(before.fit.problem.evidence)
        moment_Nm = before.fit.values["effect.gravity_load.moment_Nm"]
        assert model.fit.values["effect.gravity_load.moment_Nm"] == pytest.approx(moment_Nm, rel=0.02)


def beside(model: Model, h: Hypothesis) -> Model:
    """The model with little of an effect beside it, fitted again."""
    problem = with_entry(model.fit.problem, h, h.entry({**h.starts[0].values, "torque_Nm": 1e-4}))
    fit = solve(problem, placed(model.fit, problem), 3)
    return Model((*model.terms, h), fit, fit.residual)


def test_what_predicts_better_is_put_in_the_place_of_another_and_not_the_other_way_round(
    heavy: tuple[Calibrated, Search],
) -> None:
    """A weight of 0.3 N m that was taken for friction: both fits, about the recordings searched and about all, are the
    weight's then."""
    drive, right = heavy
    nothing, (rubbing,) = searched(drive), of(drive, "bearing_friction")
    both = ((nothing.final, nothing.groups), (nothing.selection.final, nothing.selection.groups))
    final, about = (reweighed(n := beside(m, rubbing), n.fit.problem.weighing, g) for m, g in both)
    wrong = replace(nothing, final=final, selection=replace(nothing.selection, final=about))

    def as_weighed_by(mine: Search, other: Search) -> Model:
        weighing = other.selection.final.fit.problem.weighing
        return reweighed(mine.selection.final, weighing, mine.selection.groups)

    assert exchanged(right, as_weighed_by(wrong, right), drive) is None
    now = exchanged(wrong, as_weighed_by(right, wrong), drive)
    assert now is not None
    assert now.put_in == {"gravity_load"}
    for model, before in ((now.final, wrong.final), (now.selection.final, wrong.selection.final)):
        assert model.name == "gravity_load"
        assert len(model.fit.problem.evidence) == len(before.fit.problem.evidence)
    moment_Nm = right.final.fit.values["effect.gravity_load.moment_Nm"]
    assert now.final.fit.values["effect.gravity_load.moment_Nm"] == pytest.approx(moment_Nm, rel=0.02)


def test_a_time_that_is_up_is_said(drive: Calibrated) -> None:
    found = search(drive, [], np.random.default_rng(0), Pace(lambda what, share: None, end_s=0.0))
    assert found.cut_short


def test_without_effects_only_what_is_the_drives_own_stays(drive: Calibrated) -> None:
    groups = make_groups(drive.fit)
    own = Model((Dependence("pretension_N", "session"),), drive.fit, drive.fit.residual)
    assert without_effects(own, drive, groups) is own
    found = without_effects(Model((), drive.fit, drive.fit.residual), drive, groups)
    assert found.terms == ()
    assert found.fit is drive.fit
