"""What was seen of effects beside an earlier model: the same answers beside the next one, from fewer runs."""

from __future__ import annotations

import numpy as np
import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.linear import Anchor, anchor, likeliest
from cablecomp.diagnosis.explain.screening import ask, rough
from cablecomp.diagnosis.explain.seen import Seen
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.simulate import Simulator
from firmware_sim.plant import EffectSpec

CONCEALED = [
    EffectSpec("termination_backlash", {"gap_rad": 2e-3}),
    EffectSpec("position_dependent_friction", {"amplitude": 0.5, "phase_rad": 0.7}),
    EffectSpec("clamp_slip", {"slip_m": 4e-5, "time_s": 13.0}),
]


@pytest.fixture(scope="module")
def asked() -> tuple[list[Hypothesis], Seen, Fit]:
    """All hypotheses asked beside the calibrated drive; the fit with the backlash in it."""
    body, drive = calibrated(recorded(CONCEALED, 24.0))
    pool, seen = hypotheses(TOLERANT, body.used), Seen()
    here = anchor(drive.fit, seen=seen)
    answers = {h.name: ask(here, h) for h in pool}
    gap = answers["termination_backlash"]
    assert gap is not None
    (fit, *_) = rough([gap], 12)
    return pool, seen, fit


def _runs(monkeypatch: pytest.MonkeyPatch, here: Anchor, h: Hypothesis) -> tuple[int, float]:
    """How many runs it takes to ask, and what is promised."""
    count, run = [0], Simulator.run

    def counted(self: Simulator, *args: object) -> object:
        count[0] += 1
        return run(self, *args)  # type: ignore[arg-type]  # handed on as they come

    with monkeypatch.context() as m:
        m.setattr(Simulator, "run", counted)
        answer = ask(here, h)
    return count[0], np.inf if answer is None else answer.cost


def test_fewer_points_are_run_again_and_promise_as_much(
    asked: tuple[list[Hypothesis], Seen, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    pool, seen, fit = asked
    whole = saved = 0
    for h in (h for h in pool if h.effect.id != "termination_backlash" and not h.has_instant):
        runs, cost = _runs(monkeypatch, anchor(fit), h)
        fewer, again = _runs(monkeypatch, anchor(fit, seen=seen), h)
        whole, saved = whole + runs, saved + runs - fewer
        if cost < 0.9 * fit.cost:
            assert again < 1.05 * cost, h.name
    assert saved > 0.25 * whole


def test_what_promises_most_is_known_before_it_is_asked_again(
    asked: tuple[list[Hypothesis], Seen, Fit],
) -> None:
    pool, seen, fit = asked
    others = [h for h in pool if h.effect.id != "termination_backlash" and not h.has_instant]
    fresh = {h.name: ask(anchor(fit), h) for h in others}
    costs = {name: a.cost for name, a in fresh.items() if a is not None}
    first = likeliest(anchor(fit, seen=seen), others, 3, lambda h: False)
    assert min(costs, key=costs.__getitem__) in [h.name for h in first]
    saturating = [h for h in others if h.effect.saturates]
    assert saturating  # at another size than was seen it may do anything
    assert all(h in first for h in saturating)
    assert len(first) == 3 + len(saturating)
    aside = next(h for h in others if h not in first)
    assert aside in likeliest(anchor(fit, seen=seen), others, 3, lambda h: h is aside)
    assert likeliest(anchor(fit, seen=Seen()), others, 3, lambda h: False) == others
    events = [h for h in pool if h.has_instant]
    assert likeliest(anchor(fit, seen=seen), events, 0, lambda h: False) == events


def test_what_is_seen_apart_is_not_seen_here_until_it_is_learnt(
    asked: tuple[list[Hypothesis], Seen, Fit],
) -> None:
    pool, seen, fit = asked
    h = next(h for h in pool if h.effect.id == "pretension_relaxation")
    other = next(h for h in pool if h.effect.id == "series_compliance")
    known = seen.starts_of(h)
    assert known
    assert seen.starts_of(other)
    own, aside = seen.only(h), seen.apart()
    assert own.starts_of(h) == known
    assert not own.starts_of(other)
    start = (h.starts[0],)
    for one in (own, aside):
        one.keep(h, start, fit, [])  # as if nothing could be followed from there
        assert one.recall(h, start, fit) == []
    assert seen.recall(h, start, fit)
    here = seen.apart()
    here.learn(own)
    assert here.recall(h, start, fit) == []
    assert here.starts_of(other) == seen.starts_of(other)
