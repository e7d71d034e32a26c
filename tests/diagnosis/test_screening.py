"""What an effect promises before it is fitted: held against the independent plant."""

from __future__ import annotations

from dataclasses import replace

import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.screening import ask
from firmware_sim.plant import EffectSpec

EVENT_S = 11.0


@pytest.mark.parametrize(("form", "sign"), [("", 1.0), (":other_cable", -1.0)])
@pytest.mark.parametrize(
    ("effect", "amount", "true"), [("strand_break", "fraction", 0.15), ("clamp_slip", "slip_m", 1e-4)]
)
def test_an_event_is_promised_of_the_cable_that_it_happens_to(
    effect: str, amount: str, true: float, form: str, sign: float
) -> None:
    concealed = [EffectSpec(effect + form, {amount: true, "time_s": EVENT_S})]
    body, drive = calibrated(recorded(concealed, 20.0))
    (hypothesis,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == effect)
    answer = ask(anchor(drive.fit), hypothesis)
    assert answer is not None
    plain = answer.plain or answer
    promised = plain.problem.values(plain.starts[0])
    assert promised[f"effect.{effect}.{amount}"] == pytest.approx(sign * true, rel=0.1)
    assert promised[f"effect.{effect}.time_s"] == pytest.approx(EVENT_S, abs=0.2)
    assert plain.cost < 0.1 * drive.fit.cost


def test_an_event_of_a_law_that_knows_no_duration_is_asked_at_once_alone() -> None:
    """A user's own event may have an instant and nothing of a course."""
    body, drive = calibrated(recorded([EffectSpec("clamp_slip", {"slip_m": 1e-4, "time_s": EVENT_S})], 20.0))
    (slip,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == "clamp_slip")
    kept = tuple(p for p in slip.effect.parameters if p.role not in ("duration", "steps"))
    sudden = replace(slip, effect=replace(slip.effect, parameters=kept))
    assert sudden.duration == ""
    answer = ask(anchor(drive.fit), sudden)
    assert answer is not None
    assert "duration_s" not in answer.problem.config.effect[-1].parameters
