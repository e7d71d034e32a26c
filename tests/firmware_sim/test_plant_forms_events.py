"""Other forms of what befalls one of two cables, slips and breaks, against laws worked out apart."""

from __future__ import annotations

import numpy as np
import pytest
from plant_effect_course import T
from plant_joints import joint

from firmware_sim.plant import EffectSpec, PlantRun, simulate
from firmware_sim.plant.forms.courses import worked

STICKS = 50.0


def _alone(effect: EffectSpec, circuit: str = "open", load: float = 0.5) -> PlantRun:
    """A steady load on a joint whose cables do not slip on their drums."""
    config = joint(circuit, mu_output=STICKS, mu_input=STICKS)
    s = config.stages[0]
    moment = np.full(len(T), load * s.output_radius_m * s.pretension_N)
    return simulate(config, T, 0 * T, moment, effects=(effect,))


def test_a_clamp_slides_in_steps_or_for_a_while() -> None:
    radius = joint().stages[0].output_radius_m
    gradual = _alone(
        EffectSpec("clamp_slip:gradual", {"slip_m": 2e-4, "time_s": 1.0, "duration_s": 1.5, "cable_l": 0.0})
    )
    moved = (gradual.joint_position_rad - gradual.joint_position_rad[0]) * radius
    np.testing.assert_allclose(moved, 2e-4 * np.clip((T - 1.0) / 1.5, 0, 1), atol=2e-8)
    steps = _alone(
        EffectSpec("clamp_slip:in_steps", {"slip_m": 3e-4, "time_s": 1.0, "duration_s": 1.0, "steps": 3.0})
    )
    moved = (steps.joint_position_rad - steps.joint_position_rad[0]) * radius
    for at, share in ((0.98, 0.0), (1.2, 1 / 3), (1.7, 2 / 3), (2.2, 1.0)):
        assert moved[round(at * 100)] == pytest.approx(3e-4 * share, abs=2e-8)
    bites = _alone(EffectSpec("clamp_slip:settling", {"slip_m": 2e-4, "time_s": 1.0, "lag_s": 0.5}))
    moved = (bites.joint_position_rad - bites.joint_position_rad[0]) * radius
    np.testing.assert_allclose(moved, 2e-4 * (1.0 - np.exp(-np.maximum(T - 1.0, 0.0) / 0.5)), atol=2e-8)
    values = {"slip_m": 7e-4, "time_s": 0.5, "duration_s": 1.5, "steps": 3.0, "growth": 2.0, "wait": 0.5}
    unequal = _alone(EffectSpec("clamp_slip:unequal_steps", values))
    moved = (unequal.joint_position_rad - unequal.joint_position_rad[0]) * radius
    for at, gone in ((0.48, 0.0), (0.52, 1e-4), (1.48, 1e-4), (1.52, 3e-4), (1.98, 3e-4), (2.02, 7e-4)):
        assert moved[round(at * 100)] == pytest.approx(gone, abs=2e-8)


def test_what_the_load_works_at_goes_on_while_that_moves_alone() -> None:
    """Half of it before the load rests, the other half after; by how far it goes, up or down."""
    time = np.linspace(0.0, 8.0, 801)
    load = np.interp(time, [0.0, 2.0, 3.0, 5.0, 5.5, 8.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    gone = worked(time, load, 1.0, 6.0)
    for at, share in ((1.99, 0.0), (2.5, 0.25), (3.0, 0.5), (4.9, 0.5), (5.25, 0.75), (5.5, 1.0), (8.0, 1.0)):
        assert gone[np.searchsorted(time, at)] == pytest.approx(share, abs=0.006)
    np.testing.assert_array_equal(worked(time, 0.0 * load, 1.0, 6.0), time >= 1.0)
    # what went on before and after is not its
    assert worked(time, load, 2.5, 0.25)[np.searchsorted(time, 2.625)] == pytest.approx(0.5, abs=0.03)
    config = joint("open")
    moment = np.interp(T, [0.0, 1.5, 2.0], [0.2, 0.2, 0.4]) * config.stages[0].output_radius_m
    moment *= config.stages[0].pretension_N
    law = EffectSpec("clamp_slip:worked_loose", {"slip_m": 2e-4, "time_s": 0.5, "duration_s": 2.0})
    plain, loose = (simulate(config, T, 0 * T, moment, effects=e) for e in ((), (law,)))
    moved = (loose.joint_position_rad - plain.joint_position_rad) * config.stages[0].output_radius_m
    np.testing.assert_allclose(moved, 2e-4 * np.clip((T - 1.5) / 0.5, 0.0, 1.0), atol=2e-7)


@pytest.mark.parametrize("cable", [0.0, 1.0])
def test_a_clamp_that_walks_gives_way_to_pulls_beyond_what_it_holds(cable: float) -> None:
    """Three pulls while it walks, of 1.0, 1.5 and 0.5 times what it holds, and 2.0 times; none gives anything back."""
    config = joint("closed" if cable else "open", mu_output=STICKS, mu_input=STICKS)
    s = config.stages[0]
    holds, way = 0.3 * s.output_radius_m * s.pretension_N, -1.0 if cable else 1.0
    pull = np.interp(T, np.linspace(0.0, 4.0, 9), [0.0, 1.6, 0.0, 1.5, 0.0, 0.5, -1.0, 2.0, 0.0])
    law = {"slip_m": 6e-6, "time_s": 0.7, "duration_s": 3.0, "holds_Nm": holds, "cable_l": cable}
    plain, run = (
        simulate(config, T, 0 * T, way * holds * pull, effects=e)
        for e in ((), (EffectSpec("clamp_slip:ratcheting", law),))
    )
    share = np.interp(T, [0.0, 1.0 + 1 / 3, 1.5, 3.0 + 1 / 3, 3.5, 4.0], [0.0, 0.0, 1 / 3, 1 / 3, 1.0, 1.0])
    moved = way * (run.joint_position_rad - plain.joint_position_rad) * s.output_radius_m
    shafts = 2.0 if cable else 1.0  # of two cables each takes half
    np.testing.assert_allclose(shafts * moved, 6e-6 * share, atol=2e-7)


@pytest.mark.parametrize("effect", ["clamp_slip", "strand_break"])
def test_the_other_cable_is_the_mirror_image(effect: str) -> None:
    size = {"slip_m": 4e-6} if effect == "clamp_slip" else {"fraction": 0.4}
    here = _alone(EffectSpec(effect, {**size, "time_s": 1.0}), "closed", 0.4)
    there = _alone(EffectSpec(f"{effect}:other_cable", {**size, "time_s": 1.0}), "closed", -0.4)
    np.testing.assert_allclose(there.joint_position_rad, -here.joint_position_rad, atol=1e-9)
    np.testing.assert_allclose(there.tension_l_N, here.tension_h_N, rtol=1e-6)


def test_a_clamp_that_is_pulled_too_hard_creeps_by_the_excess() -> None:
    config = joint("open")
    tension = 1.5 * config.stages[0].pretension_N
    for holds, excess in ((tension + 1.0, 0.0), (tension - 4.0, 4.0)):
        run = _alone(EffectSpec("clamp_slip:overload", {"rate_m_per_Ns": 2e-6, "holds_N": holds}))
        speed = np.gradient(run.joint_position_rad, T) * config.stages[0].output_radius_m
        np.testing.assert_allclose(speed[5:-5], 2e-6 * excess, atol=1e-9)


def test_wires_that_fray_or_break_in_steps_end_where_they_break_at_once() -> None:
    once = _alone(EffectSpec("strand_break", {"fraction": 0.4, "time_s": 1.0}))
    lasts = {"duration_s": 2.0}
    for form, goes in (
        ("fraying", lasts),
        ("accelerating", lasts),
        ("settling", {"lag_s": 0.2}),
        ("in_steps", {**lasts, "steps": 4.0}),
        ("unequal_steps", {**lasts, "growth": 0.5}),
    ):
        run = _alone(EffectSpec(f"strand_break:{form}", {"fraction": 0.4, "time_s": 1.0, **goes}))
        assert run.joint_position_rad[-1] == pytest.approx(once.joint_position_rad[-1], rel=1e-4)
        np.testing.assert_array_equal(run.joint_position_rad[T < 1.0], once.joint_position_rad[T < 1.0])
        between = run.joint_position_rad[(T > 1.2) & (T < 2.8)]
        assert np.all(between < once.joint_position_rad[-1])
        assert np.all(np.diff(run.joint_position_rad) > -1e-12)


def test_wires_that_are_bent_over_drums_break_by_the_way_and_not_by_the_time() -> None:
    """The motor goes to and fro so little that next to nothing is wound, rests for a second, and goes on."""
    config = joint("open", mu_output=STICKS, mu_input=STICKS)
    s = config.stages[0]
    steps = np.where((T > 1.5) & (T < 2.5), 0.0, 2e-4 * (-1.0) ** (np.arange(len(T)) // 5))
    steps[0] = 0.0
    moment = np.full(len(T), 0.5 * s.output_radius_m * s.pretension_N)
    law = {"fraction": 0.4, "time_s": 0.5, "travel_rad": 0.03, "power": 2.0}
    way = np.cumsum(np.abs(steps) * (T > 0.5))
    for start, before in ((0.0, 0.0), (3.0, 2.5 * 0.008)):
        effect = EffectSpec("strand_break:bent_over_drums", {**law, "pace_rad_s": 0.008})
        run = simulate(config, T + start, np.cumsum(steps), moment, effects=(effect,))
        gone = way if start == 0.0 else before + np.cumsum(np.abs(steps))
        left = 1.0 - 0.4 * (1.0 - np.exp(-((gone / 0.03) ** 2)))
        stretch = 1.5 * s.pretension_N / s.EA_N * s.free_length_m / s.output_radius_m / left
        shown = run.deflection_rad - run.deflection_rad[0]
        np.testing.assert_allclose(shown, stretch - stretch[0], atol=0.015 * np.ptp(stretch))
