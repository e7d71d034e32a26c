"""A row in which moments cannot balance, or the angle does not settle, is refused, and leaves the state as it was; one
where a law in tables jumps by its rounding is not; a stiffness that follows the angle is that of the angle found."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from effect_cases import CONFIGS, joint, register_alone

from cablecomp.config import load_joint
from cablecomp.effects import term, with_effects
from cablecomp.observer import Observer
from cablecomp.observer.refusal import SampleRefused
from cablecomp.signals import Sample

JUMP_RAD = 0.02


@term(parameters=("length",))
def elsewhere(c: Any, p: Any, s: Any) -> None:
    """A length that turns about at once at an angle: whichever it is, the joint stands where it is the other."""
    c.length_h += p.length if c.joint > JUMP_RAD else -p.length


@term(parameters=("share",))
def softer(c: Any, p: Any, s: Any) -> None:
    """Cables the softer, the farther the joint has turned."""
    c.stiffness_h *= 1.0 - p.share * c.joint
    c.stiffness_l *= 1.0 - p.share * c.joint


@term(parameters=("share",))
def soft(c: Any, p: Any, s: Any) -> None:
    """Cables softer by so much."""
    c.stiffness_h *= 1.0 - p.share
    c.stiffness_l *= 1.0 - p.share


@term(parameters=("moment",))
def against(c: Any, p: Any, s: Any) -> None:
    """A moment that turns about at once at an angle: nothing holds a joint there."""
    c.moment += p.moment if c.joint > JUMP_RAD else -p.moment


@pytest.mark.parametrize("what", ["moment", "length"])
def test_a_row_without_a_balance_is_refused(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    config = joint("snow-closed-rig")
    stage = config.drive.stage[-1]
    if what == "moment":
        register_alone(monkeypatch, "jump", "amount", lambda v: against(moment=v["amount"]))
        amount = 0.3 * stage.output_radius_m * stage.pretension_N
    else:
        register_alone(monkeypatch, "jump", "amount", lambda v: elsewhere(length=v["amount"]))
        amount = 2e-3 * stage.output_radius_m
    jump = with_effects(config, [("jump", {"amount": amount})])
    observer = Observer(jump)
    far = 0.5 / config.drive.ratio
    before = observer.step(Sample(0.0, 0.0, 0.0)).joint_position_rad
    assert before < JUMP_RAD
    with pytest.raises(SampleRefused):  # on the jump: the joint can be neither before nor beyond it
        observer.step(Sample(0.1, JUMP_RAD / config.drive.ratio, 0.0))
    fresh = Observer(jump)
    fresh.step(Sample(0.0, 0.0, 0.0))
    after = observer.step(Sample(0.2, far, 0.0)).joint_position_rad
    assert after > JUMP_RAD
    assert after == fresh.step(Sample(0.2, far, 0.0)).joint_position_rad


def test_a_stiffness_that_follows_the_angle_is_that_of_the_angle_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Loaded and turned at once, against the drive with the factor that belongs to where it ends."""
    config = joint("snow-closed-rig")
    unit = config.drive.stage[-1].output_radius_m * config.drive.stage[-1].pretension_N
    share, rows = 0.4, [Sample(0.0, 0.0, 0.0), Sample(0.1, 0.6 / config.drive.ratio, 0.5 * unit)]
    register_alone(monkeypatch, "softer", "share", lambda v: softer(share=v["share"]))
    observer = Observer(with_effects(config, [("softer", {"share": share})]))
    start, found = (observer.step(row).joint_position_rad for row in rows)
    assert start == pytest.approx(0.0, abs=1e-12)
    register_alone(monkeypatch, "soft", "share", lambda v: soft(share=v["share"]))
    given = with_effects(config, [("soft", {"share": share * found})])
    observer = Observer(given)
    _, expected = (observer.step(row).joint_position_rad for row in rows)
    assert found == pytest.approx(expected, abs=1e-12)


def test_no_row_of_friction_that_grows_with_pressure_beside_a_weight_is_refused() -> None:
    """An instrument's jaw by orders of magnitude, 34 drawn joints (seed 0): of five, a row's moments could not be
    balanced, as the law's table was coarse where the cable is all but slack and jumped where bumps are erased."""
    config = load_joint(CONFIGS.parent / "hardware" / "davinci-jaw.toml")
    rng = np.random.default_rng(0)
    time = 0.05 * np.arange(400)
    motor = np.sin(0.2 * np.pi * time) * (1.0 + 0.3 * np.sin(0.37 * time))
    for _ in range(34):
        exponent, moment = rng.uniform(-0.8, -0.5), rng.uniform(0.02, 0.14)
        effects = (
            ("gravity_load", {"moment_Nm": moment, "phase_rad": 3.0}),
            ("pressure_dependent_friction", {"exponent": exponent}),
            ("routing_friction", {"mu_angle": 0.05, "arc_length_m": 0.2}),
        )
        observer = Observer(with_effects(config, effects))
        for t, q in zip(time, motor, strict=True):
            observer.step(Sample(float(t), float(q), 0.0))  # raises where it refuses


@pytest.mark.parametrize(
    ("amplitude", "phase", "order"), [(0.104, -0.689, 4.0), (0.387, -0.248, 4.0), (0.404, -2.178, 3.0)]
)
def test_no_row_of_a_groove_with_waves_is_refused_where_bumps_are_erased(
    amplitude: float, phase: float, order: float
) -> None:
    """Ever smaller swings of the load, each back to nothing: the long slipped arc that is left jumped as it was cut."""
    groove = {"amplitude": amplitude, "phase_rad": phase, "order": order}
    open_rig = load_joint(CONFIGS / "snow-open-rig.toml")
    observer = Observer(with_effects(open_rig, [("position_dependent_friction", groove)]))
    shares = np.concatenate(
        [most * (1.0 - np.abs(np.linspace(-1.0, 1.0, 121))) for most in (1.0, 0.75, 0.5, 0.25)]
    )
    for k, load in enumerate(1.85 * shares):
        observer.step(Sample(0.05 * k, 0.0, float(load)))  # raises where it refuses
