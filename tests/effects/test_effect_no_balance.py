"""A row in which moments cannot balance is refused, and leaves the state as it was."""

from __future__ import annotations

from typing import Any

import pytest
from effect_cases import joint, register_alone

from cablecomp.effects import term, with_effects
from cablecomp.observer import Observer
from cablecomp.observer.refusal import SampleRefused
from cablecomp.signals import Sample

JUMP_RAD = 0.02


@term(parameters=("moment",))
def against(c: Any, p: Any, s: Any) -> None:
    """A moment that turns about at once at an angle: nothing holds a joint there."""
    c.moment += p.moment if c.joint > JUMP_RAD else -p.moment


def test_a_row_without_a_balance_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    register_alone(monkeypatch, "jump", "moment_Nm", lambda v: against(moment=v["moment_Nm"]))
    config = joint("snow-closed-rig")
    unit = config.drive.stage[-1].output_radius_m * config.drive.stage[-1].pretension_N
    observer = Observer(with_effects(config, [("jump", {"moment_Nm": 0.3 * unit})]))
    far = 0.5 / config.drive.ratio
    before = observer.step(Sample(0.0, 0.0, 0.0)).joint_position_rad
    assert before < JUMP_RAD
    with pytest.raises(SampleRefused):  # on the jump: the joint can be neither before nor beyond it
        observer.step(Sample(0.1, JUMP_RAD / config.drive.ratio, 0.0))
    fresh = Observer(with_effects(config, [("jump", {"moment_Nm": 0.3 * unit})]))
    fresh.step(Sample(0.0, 0.0, 0.0))
    after = observer.step(Sample(0.2, far, 0.0)).joint_position_rad
    assert after > JUMP_RAD
    assert after == fresh.step(Sample(0.2, far, 0.0)).joint_position_rad
