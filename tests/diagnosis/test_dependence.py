"""Parameters that differ between sessions: judged where recordings left out tell it, said where they do not."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, recorded

from cablecomp.diagnosis.answer.verdict import not_alike
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.search import search
from cablecomp.diagnosis.pace import Pace
from firmware_sim.plant import EffectSpec


@pytest.mark.parametrize(("coefficients", "said"), [((0.05, 0.1, 0.2, 0.4, 0.8), 1), (5 * (0.2,), 0)])
def test_friction_that_differs_between_recordings_of_a_session_each_is_said(
    coefficients: tuple[float, ...], said: int
) -> None:
    """Five bends of a sheath that no channel tells: with one left out the others do not say how it rubs."""
    many = {
        f"bend {k}/1": recorded([EffectSpec("routing_friction", {"mu_angle": c, "arc_length_m": 0.05})], 8.0)
        for k, c in enumerate(coefficients)
    }
    body = gather_body(TOLERANT, many)
    drive = calibrate_drive(TOLERANT, body.used, np.random.default_rng(0))
    pool = [h for h in hypotheses(TOLERANT, body.used) if h.name == "routing_friction"]
    found = search(drive, pool, np.random.default_rng(0), Pace(lambda what, share: None))
    assert [t.name for t in found.final.terms] == ["routing_friction"]
    lines = list(not_alike(found.final, found.groups.by))
    assert len(lines) == said
    assert all(line.startswith("effect.routing_friction.mu_angle is not the same") for line in lines)
    assert not list(not_alike(found.final, "block"))
