"""Effects on the cables: stiffness, length, the strand's inside; each against its own law."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from effect_cases import Floats, excitation, joint, run, still
from knees import bends, stiff_share
from scipy.integrate import quad

from cablecomp.config import JointConfig

LONG = 400.0  # m of free span: the wraps hardly matter beside it


def small_steps(config: JointConfig, samples: int = 200) -> dict[str, Floats]:
    """A load so small that the stiffness is that of the instant, changing once a second."""
    time = np.linspace(0.0, 4.0, samples)
    unit = config.drive.stage[0].output_radius_m * config.drive.stage[0].pretension_N
    return still(time, 1e-3 * unit * np.sign(np.sin(2.0 * np.pi * time)))


@pytest.mark.parametrize("fraction", [0.1, 0.5])
def test_a_strand_break_softens_one_side(fraction: float) -> None:
    """Long spans are springs: k_h + k_l falls from 2 to 2 - f, both tensions to T0 2(1 - f)/(2 - f)."""
    config = joint(free_length_m=LONG)
    columns = small_steps(config)
    before = run(config, columns)["deflection_rad"]
    after = run(config, columns, ("strand_break", {"fraction": fraction, "time_s": 2.0}))
    late = columns["time_s"] >= 2.0
    assert np.ptp(after["deflection_rad"][late]) == pytest.approx(
        2.0 / (2.0 - fraction) * np.ptp(before[late]), rel=1e-3
    )
    assert np.array_equal(after["deflection_rad"][~late], before[~late])
    settled = 33.54 * 2.0 * (1.0 - fraction) / (2.0 - fraction)
    assert 0.5 * (after["tension_h_N"] + after["tension_l_N"])[late] == pytest.approx(settled, rel=2e-3)


def test_a_strand_break_in_an_open_circuit() -> None:
    """Compliance over 1 - f; the weight stays, so the cable gives by T0 L/EA (1/(1 - f) - 1)."""
    config = joint("snow-open-rig", free_length_m=LONG)
    stage = config.drive.stage[0]
    columns = small_steps(config)
    before = run(config, columns)["deflection_rad"]
    after = run(config, columns, ("strand_break", {"fraction": 0.2, "time_s": 2.0}))["deflection_rad"]
    late = columns["time_s"] >= 2.0
    assert np.ptp(after[late]) == pytest.approx(np.ptp(before[late]) / 0.8, rel=1e-3)
    given = stage.pretension_N * LONG / stage.EA_N * 0.25 / stage.output_radius_m
    assert (after - before)[late].mean() == pytest.approx(given, rel=2e-3)


def test_a_clamp_that_slips_shifts_the_joint_and_loosens_both_sides() -> None:
    config = joint(free_length_m=LONG)
    stage = config.drive.stage[0]
    columns = small_steps(config)
    plain = run(config, columns)
    found = run(config, columns, ("clamp_slip", {"slip_m": 0.05, "time_s": 2.0}))
    late = columns["time_s"] >= 2.0
    moved = (found["deflection_rad"] - plain["deflection_rad"])[late]
    assert moved == pytest.approx(0.05 / (2.0 * stage.output_radius_m), rel=2e-3)
    lost = stage.EA_N * 0.05 / (2.0 * LONG)
    assert (plain["tension_h_N"] - found["tension_h_N"])[late] == pytest.approx(lost, rel=5e-3)
    assert (plain["tension_l_N"] - found["tension_l_N"])[late] == pytest.approx(lost, rel=5e-3)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_drum_that_slips_turns_the_joint_and_loosens_neither_side(way: float) -> None:
    """What one cable lets go the other takes up: by kinematics alone the joint stands off by s/R."""
    config = joint(free_length_m=LONG)
    columns = small_steps(config)
    plain = run(config, columns)
    slip = {"slip_m": way * 0.05, "time_s": 2.0, "taken_up": 1.0}
    found = run(config, columns, ("clamp_slip", slip))
    late = columns["time_s"] >= 2.0
    moved = (found["deflection_rad"] - plain["deflection_rad"])[late]
    assert moved == pytest.approx(way * 0.05 / config.drive.stage[0].output_radius_m, rel=2e-3)
    for side in ("tension_h_N", "tension_l_N"):
        assert found[side][late] == pytest.approx(plain[side][late], rel=2e-3)


def test_clamp_slip_in_an_open_circuit_is_a_lasting_step() -> None:
    config = joint("snow-open-rig")
    columns = excitation(config, moving=False)
    found = run(config, columns, ("clamp_slip", {"slip_m": 1e-4, "time_s": 1.0}))["deflection_rad"]
    step = found - run(config, columns)["deflection_rad"]
    late = columns["time_s"] >= 1.0
    assert step[~late] == pytest.approx(0.0, abs=1e-12)
    # the joint stands elsewhere, with a little more cable wound on: hence the tolerance
    assert step[late] == pytest.approx(1e-4 / config.drive.stage[0].output_radius_m, rel=5e-3)


@pytest.mark.parametrize("order", [1.0, 3.5])
@pytest.mark.parametrize("name", ["snow-closed-rig", "snow-open-rig"])
def test_runout_is_periodic_in_the_joint_angle(name: str, order: float) -> None:
    config = joint(name, wrap_output_rad=40.0, wrap_input_rad=40.0)
    radius = config.drive.stage[0].output_radius_m
    ratio = config.drive.stage[0].input_radius_m / radius
    time = np.linspace(0.0, 1.0, 400)
    turns = 4.0 * np.pi / ratio * time
    wobble = ("pulley_runout", {"eccentricity_m": 2e-4, "phase_rad": 0.6, "order": order})
    q = run(config, still(time, np.zeros(400), motor=turns), wobble)["joint_position_rad"]
    wound = radius * q + 2e-4 * (np.sin(order * q + 0.6) - math.sin(0.6))
    drive = run(config, still(time, np.zeros(400), motor=turns))["joint_position_rad"]
    # in an open circuit the lever arm lets the hanging load pull more or less: a stretch of some 1e-6 m
    tolerance = 1e-11 if name == "snow-closed-rig" else 2e-6 * order
    assert wound == pytest.approx(radius * drive, abs=tolerance)


@pytest.mark.parametrize("order", [1.0, 6.0])
def test_runout_does_no_work(order: float) -> None:
    """Lever arm and wound length belong together: (T_h - T_l)(R + e k cos(k q + phi)) = M."""
    config = joint()
    columns = excitation(config)
    eccentricity, phase = 1e-3, -0.4
    law = {"eccentricity_m": eccentricity, "phase_rad": phase, "order": order}
    found = run(config, columns, ("pulley_runout", law))
    swing = eccentricity * order * np.cos(order * found["joint_position_rad"] + phase)
    arm = config.drive.stage[0].output_radius_m + swing
    moment = (found["tension_h_N"] - found["tension_l_N"]) * arm
    assert moment == pytest.approx(columns["joint_torque_Nm"], abs=1e-11)


def test_runout_in_an_open_circuit_swings_the_hanging_load() -> None:
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    columns = excitation(config)
    found = run(config, columns, ("pulley_runout", {"eccentricity_m": 1e-3, "phase_rad": 0.3}))
    arm = stage.output_radius_m + 1e-3 * np.cos(found["joint_position_rad"] + 0.3)
    whole = columns["joint_torque_Nm"] + stage.pretension_N * stage.output_radius_m
    assert found["tension_h_N"] * arm == pytest.approx(whole, abs=1e-11)


def play(x: Floats, radius: float | Floats) -> Floats:
    """The play operator, started at zero; its radius may go along with x."""
    state, out = 0.0, []
    for value, held in zip(x, np.broadcast_to(radius, x.shape), strict=True):
        state = min(max(state, value - held), value + held)
        out.append(state)
    return np.array(out)


@pytest.mark.parametrize("radius", [0.5, 4.0])
def test_strand_friction_is_a_play_in_the_tension(radius: float) -> None:
    config = joint("snow-open-rig", EA_N=1e8, free_length_m=3.0)  # stiff: the joint hardly turns
    stage = config.drive.stage[0]
    columns = excitation(config, moving=False)
    found = run(config, columns, ("strand_friction", {"fraction": 0.7, "yield_N": radius}))
    extra = (found["deflection_rad"] - run(config, columns)["deflection_rad"]) * stage.output_radius_m
    expected = 0.7 * 3.0 / 1e8 * play(found["tension_h_N"] - stage.pretension_N, radius)
    assert extra == pytest.approx(expected, abs=1e-6 * np.ptp(expected))


@pytest.mark.parametrize("spread", [0.4, 1.0])
def test_wires_that_yield_one_after_the_other_are_many_plays(spread: float) -> None:
    """As many contacts as one likes, their limits evenly from y (1 - u) to y (1 + u): five do as well within 2 %."""
    config = joint("snow-open-rig", EA_N=1e8, free_length_m=3.0)
    stage = config.drive.stage[0]
    columns = excitation(config, moving=False)
    strands = {"fraction": 0.7, "yield_N": 4.0, "spread": spread}
    found = run(config, columns, ("strand_friction", strands))
    extra = (found["deflection_rad"] - run(config, columns)["deflection_rad"]) * stage.output_radius_m
    change = found["tension_h_N"] - stage.pretension_N
    radii = 4.0 * (1.0 + spread * (np.arange(400) / 199.5 - 1.0))
    expected = 0.7 * 3.0 / 1e8 * np.mean([play(change, r) for r in radii], axis=0)
    assert extra == pytest.approx(expected, abs=0.02 * np.ptp(expected))
    alike = 0.7 * 3.0 / 1e8 * play(change, 4.0)
    assert np.max(np.abs(extra - alike)) > 0.05 * np.ptp(expected)


@pytest.mark.parametrize("grading", [2.0, 3.5])
def test_layers_may_grip_ever_less(grading: float) -> None:
    """Contacts at z from 0 to 1, their limits 2 y z^k; five do as well within 3 %."""
    config = joint("snow-open-rig", EA_N=1e8, free_length_m=3.0)
    stage = config.drive.stage[0]
    columns = excitation(config, moving=False)
    strands = {"fraction": 0.7, "yield_N": 4.0, "spread": 1.0, "grading": grading}
    found = run(config, columns, ("strand_friction", strands))
    extra = (found["deflection_rad"] - run(config, columns)["deflection_rad"]) * stage.output_radius_m
    change = found["tension_h_N"] - stage.pretension_N
    radii = 8.0 * ((np.arange(400) + 0.5) / 400) ** grading
    expected = 0.7 * 3.0 / 1e8 * np.mean([play(change, r) for r in radii], axis=0)
    assert extra == pytest.approx(expected, abs=0.03 * np.ptp(expected))
    evenly = 0.7 * 3.0 / 1e8 * np.mean([play(change, r) for r in np.linspace(0.0, 8.0, 400)], axis=0)
    assert np.max(np.abs(extra - evenly)) > 0.05 * np.ptp(expected)


@pytest.mark.parametrize("pressed", [0.4, 1.0])
def test_a_grip_that_the_tension_makes_grows_with_it(pressed: float) -> None:
    """A play between the lines x - r and x + r, of which r is in part in proportion to T."""
    config = joint("snow-open-rig", EA_N=1e8, free_length_m=3.0)
    stage = config.drive.stage[0]
    columns = excitation(config, moving=False)
    strands = {"fraction": 0.7, "yield_N": 4.0, "pressed": pressed}
    found = run(config, columns, ("strand_friction", strands))
    extra = (found["deflection_rad"] - run(config, columns)["deflection_rad"]) * stage.output_radius_m
    change = found["tension_h_N"] - stage.pretension_N
    radius = 4.0 * (1.0 + pressed * change / stage.pretension_N)
    expected = 0.7 * 3.0 / 1e8 * play(change, radius)
    assert extra == pytest.approx(expected, abs=1e-6 * np.ptp(expected))
    alike = 0.7 * 3.0 / 1e8 * play(change, 4.0)
    assert np.max(np.abs(extra - alike)) > 0.05 * np.ptp(expected)


def test_greased_strands_follow_a_step_of_tension_in_their_own_time() -> None:
    """Up, to x - y, and half the way down: they stay until the step has left their grip."""
    config = joint("snow-open-rig", EA_N=1e8, free_length_m=3.0)
    stage = config.drive.stage[0]
    time = np.linspace(0.0, 4.0, 801)
    newton = np.where(time < 0.5, 0.0, np.where(time < 2.5, 10.0, 5.0))
    columns = still(time, newton * stage.output_radius_m)
    strands = ("strand_friction", {"fraction": 0.7, "yield_N": 4.0, "yields_in_s": 0.2})
    extra = (run(config, columns, strands)["deflection_rad"] - run(config, columns)["deflection_rad"]) / (
        0.7 * 3.0 / 1e8 / stage.output_radius_m
    )
    step = time[1] - time[0]
    up = time >= 0.5
    assert extra[~up] == pytest.approx(0.0, abs=1e-6)
    expected = 6.0 * (1.0 - np.exp(-(time[up] - time[up][0] + step) / 0.2))  # a step comes with its sample
    assert extra[up] == pytest.approx(expected, abs=0.01)


def test_strand_friction_makes_a_loop_where_the_wraps_cannot_slip() -> None:
    config = joint("tendon-finger", mu_output=80.0, mu_input=80.0)
    time = np.linspace(0.0, 2.0, 400)
    columns = still(time, 0.1 * np.sin(2.0 * np.pi * time))
    second = slice(200, None)
    plain = run(config, columns)["deflection_rad"]
    found = run(config, columns, ("strand_friction", {"fraction": 0.5, "yield_N": 3.0}))["deflection_rad"]
    load = columns["joint_torque_Nm"]
    assert abs(np.trapezoid(plain[second], load[second])) < 1e-3 * np.ptp(plain) * np.ptp(load)
    assert abs(np.trapezoid(found[second], load[second])) > 0.05 * np.ptp(found) * np.ptp(load)


def wrap_stretch(strain: Callable[[float], float], tau: float, mu: float) -> float:
    """Integral of e over a wrap loaded from T0 to tau T0: T = T0 exp(mu* s), s from the inner edge."""
    reach = abs(math.log(tau)) / mu
    sign = math.copysign(1.0, math.log(tau))
    return float(quad(lambda s: strain(math.exp(sign * mu * s)), 0.0, reach, epsabs=0.0, epsrel=1e-12)[0])


@pytest.mark.parametrize(
    ("b", "steady", "knee", "again"),
    [
        (-0.4, 0.0, 0.0, 0.0),
        (0.3, 0.0, 0.0, 0.0),
        (0.9, 0.0, 0.0, 0.0),
        (0.9, 0.5, 0.0, 0.0),
        (0.8, 0.0, 0.8, 0.0),
        (-0.4, 0.3, 0.7, 0.0),
        (0.8, 0.2, 0.6, 1.5),
    ],
)
def test_a_stiffening_cable_against_quadrature(b: float, steady: float, knee: float, again: float) -> None:
    """Free span and both wraps of an open circuit, unloaded from T0: stretched by int dT/EA(T)."""
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    again_at = again * knee

    def strain(tau: float) -> float:
        def gives(x: float) -> float:
            if knee:
                return 1.0 - b * float(stiff_share(x, knee, again_at))
            return 1.0 / (1.0 + b * (x - 1.0))

        def compliance(x: float) -> float:
            return steady + (1.0 - steady) * gives(x) / gives(1.0)

        inside = [x for x in bends(knee, again_at) if tau < x < 1.0]
        return float(quad(compliance, 1.0, tau, epsabs=0.0, epsrel=1e-12, points=inside or None)[0])

    time = np.linspace(0.0, 1.0, 60)
    unit = stage.output_radius_m * stage.pretension_N
    load = -0.5 * unit * time
    law = {"stiffening": b, "steady": steady, "knee": knee, "again": again}
    found = run(config, still(time, load), ("nonlinear_cable", law))["deflection_rad"]
    for k in (15, 35, 59):
        tau = 1.0 + load[k] / unit
        stretch = stage.free_length_m * strain(tau)
        stretch += stage.output_radius_m * wrap_stretch(strain, tau, stage.mu_output)
        stretch += stage.input_radius_m * wrap_stretch(strain, tau, stage.mu_input)
        expected = stretch * stage.pretension_N / stage.EA_N / stage.output_radius_m
        # the joint turns back by some 1e-2 rad, and with it the wraps: exact for M < 0, where
        # no tensioned cable winds on or off (thesis, 3-30)
        assert found[k] == pytest.approx(expected, rel=1e-9)


def test_a_stiffening_free_span_has_no_loop() -> None:
    config = joint("tendon-finger", mu_output=80.0, mu_input=80.0)
    time = np.linspace(0.0, 1.0, 400)
    columns = still(time, 0.2 * np.sin(2.0 * np.pi * time))
    q = run(config, columns, ("nonlinear_cable", {"stiffening": 0.6}))["deflection_rad"]
    assert abs(np.trapezoid(q, columns["joint_torque_Nm"])) < 1e-3 * np.ptp(q) * 0.4
