"""Newton's last step, applied to what has been evaluated, against the same evaluated once more."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from cablecomp.mechanics.nudge import wrap_nudge
from cablecomp.mechanics.profile import accumulate, set_pending, wrap_eval
from cablecomp.mechanics.records import POINT, STEP

MU, WRAP_RAD, TOP = 0.12, 7.45, 2
nudge = wrap_nudge.py_func  # the kernel has no entry from Python


@pytest.mark.parametrize("short_of_mu", [0.5, 1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("dv", [-9e-8, -1e-9, 9e-8])
def test_a_small_step_is_the_evaluation_of_its_end_or_none(short_of_mu: float, dv: float) -> None:
    """Where the profile is nearly as steep as friction holds, a small step slips far inward: 9e-8 in v by 0.75 rad at
    a slope that is short of mu by a millionth. At a hundredth of that it meets the next piece already."""
    p = np.zeros(16, POINT)
    p["y"][: TOP + 1] = 0.0, 3.0, WRAP_RAD
    p["v"][: TOP + 1] = 0.0, 0.1, 0.1 - MU * (1.0 - short_of_mu) * (WRAP_RAD - 3.0)
    accumulate.py_func(p, None, 0, TOP + 1)
    end = float(p[TOP].v) - 1e-7  # slips a little already
    before, anew = np.zeros(1, STEP)[0], np.zeros(1, STEP)[0]
    for step, v in ((before, end), (anew, end + dv)):
        step.w, step.end_v, step.end_tau = WRAP_RAD, v, exp(v)
        set_pending(step, wrap_eval(p, None, 0, TOP + 1, WRAP_RAD, v, exp(v), MU))
    done = nudge(before, p, TOP + 1, MU, dv, 0.0)
    assert done == {0.5: True, 1e-2: True, 1e-6: False}.get(short_of_mu, done)
    if done:
        for name in ("total", "y", "v", "stretch", "tau", "end_tau"):
            assert getattr(before, name) == pytest.approx(getattr(anew, name), rel=1e-12), name
