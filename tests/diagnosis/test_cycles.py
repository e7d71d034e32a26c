"""What comes and goes again and again: by inner products over short stretches of time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.cycles import Cycle, Products, best_cycle, gains, likeliest, there
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor, best_pair
from cablecomp.diagnosis.explain.screening import ask
from firmware_sim.plant import EffectSpec

ENDS_S = np.linspace(0.0, 30.0, 121)
MIDDLE_S = 0.5 * (ENDS_S[1:] + ENDS_S[:-1])


def products(rows: np.ndarray, left: np.ndarray) -> Products:
    """Of rows (all samples) x (cosine and sine) x (stretches)."""
    flat = rows.reshape(len(rows), -1)
    count = rows.shape[2]
    return Products((flat.T @ flat).reshape(2, count, 2, count), (flat.T @ left).reshape(2, count), ENDS_S)


def by_stretches(cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Rows of which each shows the stretch it lies in."""
    own = np.repeat(np.eye(len(MIDDLE_S)), len(cosine) // len(MIDDLE_S), axis=0)
    return np.stack([cosine[:, None] * own, sine[:, None] * own], axis=1)


def test_it_is_there_for_its_share_of_every_stretch() -> None:
    cycle = Cycle(7.0, 3.1, 0.4)
    fine = np.linspace(ENDS_S[0], ENDS_S[-1], 1200001)[:-1]
    held = np.mod(fine - cycle.start_s, cycle.period_s) < cycle.held * cycle.period_s
    expected = held.reshape(len(MIDDLE_S), -1).mean(axis=1)
    assert there([cycle], ENDS_S)[0] == pytest.approx(expected, abs=1e-3)
    assert 0.0 <= cycle.turned(0.0).start_s < cycle.period_s
    assert there([cycle.turned(0.0)], ENDS_S)[0] == pytest.approx(1.0 - expected, abs=1e-3)


def test_what_a_cycle_takes_off_is_that_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    rows = by_stretches(*rng.standard_normal((2, 1200)))
    left = rng.standard_normal(1200)
    for cycle in (Cycle(7.0, 3.1, 0.4), Cycle(50.0, 12.0, 0.5)):
        courses = np.stack([np.ones(len(MIDDLE_S)), there([cycle], ENDS_S)[0]])
        A = np.einsum("rak,ik->ria", rows, courses).reshape(1200, 4)
        pairs, rest, *_ = np.linalg.lstsq(A, left)
        gone, found = gains(products(rows, left), [cycle])
        assert gone[0] == pytest.approx(0.5 * (left @ left - rest[0]), rel=1e-6)
        assert found[0] == pytest.approx(pairs, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize(
    "cycle", [Cycle(6.3, 2.0, 0.55), Cycle(90.0, 11.3, 0.5)], ids=["again and again", "once"]
)
def test_a_cycle_is_found_in_noise(cycle: Cycle) -> None:
    rng = np.random.default_rng(5)
    angle = 0.8 * np.sin(1.1 * np.linspace(0.0, 30.0, 1200)) + 0.3 * np.sin(
        2.3 * np.linspace(0.0, 30.0, 1200)
    )
    rows = by_stretches(np.cos(angle), np.sin(angle))
    course = 0.3 + 0.7 * there([cycle], ENDS_S)[0]
    left = np.einsum("rak,a,k->r", rows, [0.6, 0.8], course) + 0.2 * rng.standard_normal(1200)
    found, pairs = likeliest(products(rows, left))
    assert there([found], ENDS_S)[0] == pytest.approx(there([cycle], ENDS_S)[0], abs=0.35)
    assert np.mean(np.abs(there([found], ENDS_S)[0] - there([cycle], ENDS_S)[0])) < 0.02
    assert pairs == pytest.approx([0.18, 0.24, 0.42, 0.56], abs=0.1)


@pytest.mark.parametrize("form", ["", ":picked_up"], ids=["always there", "picked up"])
def test_a_weight_comes_and_goes_where_that_leaves_far_less_and_recordings_share_a_clock(form: str) -> None:
    law = {"moment_Nm": 0.15, "phase_rad": 0.4}
    cycle = {"share": 0.2, "start_s": 2.0, "period_s": 5.0, "held": 0.6} if form else {}
    body, drive = calibrated(recorded([EffectSpec("gravity_load" + form, law | cycle)], 20.0))
    weight = next(h for h in hypotheses(TOLERANT, body.used) if h.name == "gravity_load")
    here = anchor(drive.fit)
    answer = ask(here, weight)
    assert answer is not None
    free = {p.base for p in answer.problem.parameters}
    assert (weight.key("period_s") in free) == bool(form)
    plain = best_pair(here, weight, [{}])
    assert plain is not None
    problem = drive.fit.problem
    apart = replace(problem, evidence=tuple(replace(e, shift_s=100.0) for e in problem.evidence))
    assert best_cycle(anchor(replace(drive.fit, problem=apart)), weight, plain) is None
