"""What could hide: the joint that is said to look alike does look alike."""

from __future__ import annotations

import numpy as np
import pytest
from turning import JOINT, recorded

from cablecomp.config import EffectEntry, JointConfig
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.unseen import could_be_unseen
from cablecomp.estimation.evidence import JOINT as ANGLE
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


def bounds(moment_Nm: float) -> dict[str, float | None]:
    """What is said of two recordings of a joint that lifts a weight."""
    entry = EffectEntry(id="gravity_load", moment_Nm=moment_Nm, phase_rad=0.4)
    lifting = JOINT.model_copy(update={"effect": (entry,)})
    loose = JOINT.model_copy(update={"tolerance": {"EA_N": 0.2, "pretension_N": 0.1, "mu_output": 0.3}})
    body = gather_body(loose, {f"a/{k}": recorded(lifting, seed=k) for k in (1, 2)})
    fit = calibrate_drive(loose, body.used, np.random.default_rng(0)).fit
    found, _ = could_be_unseen(fit, hypotheses(loose, body.used), [])
    return {u["effect"]: u["below"] for u in found}


@pytest.mark.parametrize("moment_Nm", [0.0, 0.01, 0.2])
def test_what_is_there_lies_below_its_bound(moment_Nm: float) -> None:
    """Whether or not it shows: 0.01 N m are three standard deviations, 0.2 N m are sixty."""
    below = bounds(moment_Nm)["gravity_load"]
    assert below is not None
    assert moment_Nm < below < 2.0 * moment_Nm + 0.02


def test_a_joint_with_a_hidden_effect_predicts_what_the_one_without_it_does() -> None:
    """A mount that yields is made up for by a stiffer cable."""
    loose = JOINT.model_copy(update={"tolerance": {"EA_N": 0.2, "pretension_N": 0.1, "mu_output": 0.3}})
    body = gather_body(loose, {"a/1": recorded(seed=1), "a/2": recorded(seed=2)})
    fit = calibrate_drive(loose, body.used, np.random.default_rng(0)).fit
    pool = hypotheses(loose, body.used)
    _, hidden = could_be_unseen(fit, pool, [])
    mount = next(h for h in hidden if h.effect == "series_compliance")
    assert mount.amount > 0.0
    bare = mount.joint.model_copy(update={"effect": ()})

    def left(joint: JointConfig) -> FloatArray:
        problem = Problem(joint, (), fit.problem.evidence, fit.problem.weighing)
        return np.concatenate(problem.left(problem.start, ANGLE))

    as_it_is = np.concatenate(fit.problem.left(fit.x))
    alone, beside = (float(np.std(left(j) - as_it_is)) for j in (bare, mount.joint))
    assert beside < 0.5 * alone
