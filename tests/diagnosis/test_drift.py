"""Clocks that run at unlike speed: found where they do, dropped where they do not."""

from __future__ import annotations

import pytest
from small_drive import TOLERANT, recorded

from cablecomp.diagnosis.diagnose import diagnose
from firmware_sim.plant import EffectSpec

SECONDS = 40.0
LATEST_S = 4e-3


def found(effect: EffectSpec) -> dict[str, float]:
    """The clock's parameters in the joint that the diagnosis ends with; it names nothing else."""
    d = diagnose(TOLERANT, {"small/1": recorded([effect], SECONDS)})
    assert [n.effect for n in d.named] == ["clock_skew"]
    (entry,) = (e for e in d.augmented_joint.effect if e.id == "clock_skew")
    return {k: float(v) for k, v in entry.parameters.items()}


def test_a_clock_that_runs_slow_is_found_with_its_speed() -> None:
    """From a quarter of the delay at first to all of it at the end."""
    law = {"delay_s": LATEST_S, "at_start": 0.25, "span_s": SECONDS}
    here = found(EffectSpec("clock_skew:drift", law))
    assert here["drift"] == pytest.approx(0.75 * LATEST_S / SECONDS, rel=0.05)
    assert here["delay_s"] == pytest.approx(0.25 * LATEST_S, rel=0.1)


def test_where_clocks_run_alike_no_drift_stays_in_the_model() -> None:
    """A controller would run away with it, however little it is."""
    here = found(EffectSpec("clock_skew", {"delay_s": LATEST_S}))
    assert "drift" not in here
    assert here["delay_s"] == pytest.approx(LATEST_S, rel=0.02)
