"""What an effect promises before it is fitted: held against the independent plant."""

from __future__ import annotations

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed

from cablecomp.config import parse_joint
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.screening import anchor, ask
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

EVENT_S = 11.0


@pytest.mark.parametrize(("form", "sign"), [("", 1.0), (":other_cable", -1.0)])
@pytest.mark.parametrize(
    ("effect", "amount", "true"), [("strand_break", "fraction", 0.15), ("clamp_slip", "slip_m", 1e-4)]
)
def test_an_event_is_promised_of_the_cable_that_it_happens_to(
    effect: str, amount: str, true: float, form: str, sign: float
) -> None:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.04)
    soft = 1.0 - np.exp(-time)
    motor = soft * (0.8 * np.sin(1.1 * time) + 0.5 * np.sin(2.1 * time))
    load = soft * (0.9 * np.sin(1.7 * time) + 0.6 * np.sin(2.9 * time))
    concealed = [EffectSpec(effect + form, {amount: true, "time_s": EVENT_S})]
    found = simulate(PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=concealed).channels()
    columns = {"time_s": time}
    for name, noise in SMALL_NOISE.items():
        columns[name] = found[name] + noise * rng.standard_normal(len(time))
    joint = parse_joint(
        {**closed(SMALL, "small"), "tolerance": {"pretension_N": 0.06, "mu_output": 0.25}}, "small"
    )
    body = gather_body(joint, {"small/1": columns}, None)
    drive = calibrate_drive(joint, body.used, np.random.default_rng(0))
    (hypothesis,) = (h for h in hypotheses(joint, body.used) if h.name == effect)
    answer = ask(anchor(drive.fit), hypothesis)
    assert answer is not None
    plain = answer.plain or answer
    promised = plain.problem.values(plain.starts[0])
    assert promised[f"effect.{effect}.{amount}"] == pytest.approx(sign * true, rel=0.1)
    assert promised[f"effect.{effect}.time_s"] == pytest.approx(EVENT_S, abs=0.2)
    assert plain.cost < 0.1 * drive.fit.cost
