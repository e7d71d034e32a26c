"""Names in order: what moves the joint most stands first, by as much as the plant's joint is moved."""

from __future__ import annotations

import numpy as np
import pytest
from joints import SMALL, closed
from small_drive import TOLERANT, course, recorded

from cablecomp.diagnosis.diagnose import diagnose
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

SECONDS = 40.0


def _weight(moment_Nm: float) -> EffectSpec:
    return EffectSpec("gravity_load", {"moment_Nm": moment_Nm, "phase_rad": 0.4})


def _play(gap_rad: float) -> EffectSpec:
    return EffectSpec("termination_backlash", {"gap_rad": gap_rad})


def _moved(effects: list[EffectSpec], without: list[EffectSpec]) -> float:
    """RMS by which the plant's joint is moved by what is left out."""
    config, inputs = PlantConfig.from_dict(closed(dict(SMALL))), course(SECONDS)
    more, less = (simulate(config, *inputs, effects=e).joint_position_rad for e in (effects, without))
    return float(np.std(more - less))


@pytest.mark.parametrize(
    ("concealed", "first"),
    [
        ([_weight(0.3), _play(4e-4)], "gravity_load"),
        ([_weight(0.15), _play(2e-3)], "termination_backlash"),
    ],
)
def test_what_moves_the_joint_most_stands_first(concealed: list[EffectSpec], first: str) -> None:
    found = diagnose(TOLERANT, {"small/1": recorded(concealed, SECONDS)}).named
    moved = {e.id: _moved(concealed, [o for o in concealed if o is not e]) for e in concealed}
    assert max(moved, key=moved.__getitem__) == first == found[0].effect
    assert {n.effect for n in found} == set(moved)
    for n in found:
        assert n.evidence["moves_rad"] == pytest.approx(moved[n.effect], rel=0.1), n.effect
