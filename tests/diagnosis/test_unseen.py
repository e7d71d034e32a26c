"""What could hide: the joint that is said to look alike does look alike."""

from __future__ import annotations

import numpy as np
from turning import JOINT, recorded

from cablecomp.config import JointConfig
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.unseen import could_be_unseen
from cablecomp.estimation.evidence import JOINT as ANGLE
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray


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
