"""What an effect promises before it is fitted: held against the independent plant."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace

import pytest
from small_drive import TOLERANT, calibrated, recorded

from cablecomp.config import JointConfig
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.linear import anchor
from cablecomp.diagnosis.explain.screening import ask
from cablecomp.effects import catalogue
from cablecomp.mechanics.change import Change, together
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


def test_an_event_that_is_undone_soon_is_asked_at_every_instant(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over before the first sample a knock of the encoder has done nothing: its instant is not told from that."""
    lasts_s, size_rad = 5.0, 2e-3

    def knock(values: Mapping[str, float], config: JointConfig) -> Change:
        """A slip that comes back, of the length that turns the joint so far."""
        here = {"slip_m": values["slip_m"], "time_s": values["time_s"], "duration_s": 0.0, "steps": 0.0}
        clamps = ("creep_m_per_Ns", "holds_N", "creep_l_m_per_Ns", "holds_l_N")
        here |= {"taken_up": 1.0, **dict.fromkeys(clamps, 0.0)}
        back = {**here, "slip_m": -values["slip_m"], "time_s": values["time_s"] + lasts_s}
        return together([catalogue()["clamp_slip"].change(v, config) for v in (here, back)])

    slip = catalogue()["clamp_slip"]
    kept = tuple(p for p in slip.parameters if p.name in ("slip_m", "time_s"))
    registry = importlib.import_module("cablecomp.effects.catalogue")
    monkeypatch.setattr(registry, "_registered", {})
    registry.register(replace(slip, id="knock", parameters=kept, change=knock, unbounded_by=()))
    columns = recorded([], 20.0)
    during = (columns["time_s"] >= EVENT_S) & (columns["time_s"] < EVENT_S + lasts_s)
    columns["joint_position_rad"] = columns["joint_position_rad"] + size_rad * during
    body, drive = calibrated(columns)
    (knocked,) = (h for h in hypotheses(TOLERANT, body.used) if h.name == "knock")
    answer = ask(anchor(drive.fit), knocked)
    assert answer is not None
    promised = answer.problem.values(answer.starts[0])
    assert promised["effect.knock.time_s"] == pytest.approx(EVENT_S, abs=0.2)
    assert answer.cost < 0.1 * drive.fit.cost
