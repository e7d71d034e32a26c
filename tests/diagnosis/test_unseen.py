"""What could hide: the joint that is said to look alike does look alike."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor, contribution
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.diagnosis.explain.unseen import _bound_of_phase, _hidden, _likeliest, could_be_unseen
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT as ANGLE
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray


def bounds(entry: EffectEntry) -> dict[str, float | None]:
    """What is said of two recordings of a joint with this effect."""
    lifting = JOINT.model_copy(update={"effect": (entry,)})
    loose = JOINT.model_copy(update={"tolerance": {"EA_N": 0.2, "pretension_N": 0.1, "mu_output": 0.3}})
    body = gather_body(loose, {f"a/{k}": recorded(lifting, seed=k) for k in (1, 2)})
    fit = calibrate_drive(loose, body.used, np.random.default_rng(0)).fit
    found, _ = could_be_unseen(fit, hypotheses(loose, body.used), [])
    return {u["effect"]: u["below"] for u in found}


@pytest.mark.parametrize("moment_Nm", [0.0, 0.01, 0.2])
@pytest.mark.parametrize("phase_rad", [0.4, 2.0, 3.6])
def test_a_weight_lies_below_its_bound(moment_Nm: float, phase_rad: float) -> None:
    """Whether or not it shows, and wherever it hangs: 0.01 N m hardly do, 0.2 N m are all that is left over, a
    third of which is one deviation: the bound lies at three times as much."""
    below = bounds(EffectEntry(id="gravity_load", moment_Nm=moment_Nm, phase_rad=phase_rad))["gravity_load"]
    assert below is not None
    assert moment_Nm < below < 3.5 * moment_Nm + 0.08


def test_no_phase_hides_below_the_bound() -> None:
    """A weight at its bound shows by so many deviations at least, wherever it hangs, and by no more at the worst place:
    seen along a short way its two phases do nearly the same (seed 4)."""
    rng = np.random.default_rng(4)
    along, across = rng.standard_normal((2, 300))
    made = [(0.2 * along, 0.1), (0.2 * (along + 0.2 * across), 0.1)]
    nothing: Any = SimpleNamespace(fit=SimpleNamespace(residual=np.zeros(300)), beyond=lambda v: v)
    below = _bound_of_phase(nothing, made)
    assert below is not None
    phase = np.linspace(0.0, np.pi, 2001)
    shape = np.outer(made[0][0], np.cos(phase)) + np.outer(made[1][0], np.sin(phase))
    seen = np.linalg.norm(below / 0.1 * shape, axis=0)
    assert float(seen.min()) == pytest.approx(LIMITS.unseen, rel=1e-4)


def test_what_an_inertia_does_is_asked_on_every_sample() -> None:
    """The observer itself, with an inertia and without, on all samples of a quick motion: rows thinned by travel, of
    which there are forty, know nothing of the swing between them."""
    columns = recorded(seed=1)
    e = gather(JOINT, "one", columns, "all", fine_rows=len(columns["time_s"]), judged_rows=40)
    problem = Problem(JOINT, (), (e,), Weighing({ANGLE: 1e-4}, {}))
    here = anchor(Fit(problem, np.empty(0), problem.residual(np.empty(0)), np.empty((len(e.rows), 0))))
    (h,) = [h for h in hypotheses(JOINT, [e]) if h.name == "inertial_load"]
    found = contribution(here, h, h.starts[0])
    assert found is not None
    d, size = found
    heavy = JOINT.model_copy(update={"effect": (EffectEntry(id="inertial_load", inertia_kgm2=size),)})
    swung = [Observer(c).run(e.columns)[ANGLE][e.rows] for c in (heavy, JOINT)]
    wanted = (swung[0] - swung[1]) * e.weight / 1e-4
    wanted -= wanted.mean()
    assert float(np.std(d[: len(wanted)] - wanted)) < 0.1 * float(np.std(wanted))


def test_a_joint_with_a_hidden_effect_predicts_what_the_one_without_it_does() -> None:
    """A mount that yields is made up for by a stiffer cable."""
    loose = JOINT.model_copy(update={"tolerance": {"EA_N": 0.2, "pretension_N": 0.1, "mu_output": 0.3}})
    body = gather_body(loose, {"a/1": recorded(seed=1), "a/2": recorded(seed=2)})
    fit = calibrate_drive(loose, body.used, np.random.default_rng(0)).fit
    pool = hypotheses(loose, body.used)
    _, hidden = could_be_unseen(fit, pool, [])
    mount = next(h for h in hidden if h.effect == "series_compliance")
    assert mount.amount > 0.0
    assert f"up to {mount.amount:.3g} rad/(N m) of it" in mount.why
    assert f"up to {mount.amount:.3g} of it" in replace(mount, unit="-").why
    bare = mount.joint.model_copy(update={"effect": ()})

    def left(joint: JointConfig) -> FloatArray:
        problem = Problem(joint, (), fit.problem.evidence, fit.problem.weighing)
        return np.concatenate(problem.left(problem.start, ANGLE))

    as_it_is = np.concatenate(fit.problem.left(fit.x))
    alone, beside = (float(np.std(left(j) - as_it_is)) for j in (bare, mount.joint))
    assert beside < 0.5 * alone


def test_what_is_none_of_an_effect_is_not_said_to_hide() -> None:
    """A guide without friction is free cable: a stiffer one makes up for it, and nothing of friction hides there."""
    loose = JOINT.model_copy(update={"tolerance": {"EA_N": 0.2, "pretension_N": 0.1, "mu_output": 0.3}})
    body = gather_body(loose, {"a/1": recorded(seed=1)})
    fit = calibrate_drive(loose, body.used, np.random.default_rng(0)).fit
    here = anchor(fit)
    guide = next(h for h in hypotheses(loose, body.used) if h.name == "routing_friction")
    entry = guide.entry({**guide.starts[0].values, "mu_angle": 1e-8, "arc_length_m": 0.02})
    problem = with_entry(fit.problem, guide, entry)
    there = problem.followed(np.concatenate([fit.x, problem.start[len(fit.x) :]]))
    assert there is not None
    hiding = replace(guide, starts=(replace(guide.starts[0], values=entry.parameters),))
    assert _hidden(here, hiding, 0, fit.residual - there[: len(fit.residual)], 1e-8) is None


def test_a_parameter_that_does_nothing_takes_no_step() -> None:
    """Two that do the same in part, one that shows nothing."""
    rng = np.random.default_rng(2)
    J = np.column_stack([rng.standard_normal(50), np.zeros(50), rng.standard_normal(50)])
    with np.errstate(all="raise"):
        s = _likeliest(J, 0.3 * J[:, 0] - 0.1 * J[:, 2], np.array([1.0, 0.5, 1.0]))
    assert s == pytest.approx([0.3, 0.0, -0.1], abs=0.05)
