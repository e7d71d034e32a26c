"""Friction that depends on tension or on place: the cone law in new variables, against direct integration."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from effect_cases import excitation, joint, run, still
from scipy.integrate import quad, solve_ivp

from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.observer import Observer

Law = Callable[[float, float], float]  # mu at (tension ratio, angle from the departure point)


def unloading(config: JointConfig, samples: int = 80) -> dict[str, np.ndarray]:
    """An open circuit's load goes from 0 to half of slack: monotone, so every wrap holds one slip zone."""
    time = np.linspace(0.0, 1.0, samples)
    unit = config.drive.stage[0].output_radius_m * config.drive.stage[0].pretension_N
    return still(time, -0.5 * unit * time)


def stretch(law: Law, tau: float, wrap: float) -> float:
    """int (T/T0 - 1) dθ over a wrap whose tension rises from tau inward by dT/dθ = mu T, up to T0."""

    def slope(angle: float, state: np.ndarray) -> list[float]:
        return [law(state[0], angle) * state[0], state[0] - 1.0]

    def at_rest(angle: float, state: np.ndarray) -> float:
        return float(state[0] - 1.0)

    at_rest.terminal = True
    found = solve_ivp(slope, (0.0, wrap), [tau, 0.0], rtol=1e-11, atol=1e-13, events=at_rest)
    assert found.t_events[0].size == 1
    return float(found.y[1, -1])


def expected_deflection(config: JointConfig, load: float, output: Law, inner: Law) -> float:
    stage = config.drive.stage[0]
    tau = 1.0 + load / (stage.output_radius_m * stage.pretension_N)
    total = stage.free_length_m * (tau - 1.0)
    total += stage.output_radius_m * stretch(output, tau, stage.wrap_output_rad)
    total += stage.input_radius_m * stretch(inner, tau, stage.wrap_input_rad)
    return total * stage.pretension_N / stage.EA_N / stage.output_radius_m


def unloads_by(values: dict[str, float], factor: Callable[[float], float], rel: float) -> None:
    """Asserts that an open drive with this law of pressure unloads as direct integration of mu0 times `factor` of
    T/T0 has it."""
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    columns = unloading(config)
    found = run(config, columns, ("pressure_dependent_friction", values))["deflection_rad"]
    for k in (20, 50, 79):
        expected = expected_deflection(
            config,
            columns["joint_torque_Nm"][k],
            lambda tau, _: stage.mu_output * factor(tau),
            lambda tau, _: stage.mu_input * factor(tau),
        )
        assert found[k] == pytest.approx(expected, rel=rel)


@pytest.mark.parametrize("exponent", [-0.4, 1.0 / 3.0, 0.8])
def test_friction_that_falls_with_pressure(exponent: float) -> None:
    unloads_by({"exponent": exponent}, lambda tau: tau**-exponent, rel=1e-7)


@pytest.mark.parametrize(("lost", "exponent"), [(0.7, 0.0), (-0.5, 0.2)])
def test_a_coat_that_is_pressed_through_loses_its_friction_there(lost: float, exponent: float) -> None:
    """Half of what is lost where T = 0.8 T0; a tenth and nine tenths of it a factor of 1.25 to either side."""

    def factor(tau: float) -> float:
        return float(tau**-exponent * (1.0 - lost * tau**10 / (tau**10 + 0.8**10)))

    assert factor(0.8) * 0.8**exponent == pytest.approx(1.0 - 0.5 * lost)
    assert factor(1.0) * 1.0 == pytest.approx(1.0 - 0.903 * lost, abs=1e-3)
    unloads_by({"exponent": exponent, "lost": lost, "place": 0.8}, factor, rel=1e-6)


@pytest.mark.parametrize(("adhesion", "power"), [(0.6, 1.0), (0.3, 2.5)])
def test_friction_with_a_part_that_sticks_falls_to_a_floor(adhesion: float, power: float) -> None:
    unloads_by(
        {"adhesion": adhesion, "adhesion_power": power},
        lambda tau: 1.0 - adhesion + adhesion * max(tau, 0.1) ** -power,
        rel=1e-6,
    )


def test_pressure_dependence_in_a_full_loop_against_a_grid() -> None:
    """Nested reversals on one pulley: grid points that slip in turn, mu by their own tension."""
    config = joint("snow-open-rig", input_radius_m=1e-6, free_length_m=1e-6, wrap_output_rad=9.0)
    stage = config.drive.stage[0]
    unit = stage.output_radius_m * stage.pretension_N
    turns = np.array([0.0, -0.5, -0.1, -0.35, -0.2, -0.6, 0.0])
    load = unit * np.interp(np.linspace(0.0, 6.0, 241), np.arange(7.0), turns)
    time = np.arange(241.0)
    n = 0.5
    q = run(config, still(time, load), ("pressure_dependent_friction", {"exponent": n}))["deflection_rad"]
    points = 6000
    step = stage.wrap_output_rad / points
    w = np.zeros(points + 1)  # (tau^n - 1)/n at every grid point, the free end first
    for value in load:
        w[0] = ((1.0 + value / unit) ** n - 1.0) / n
        reach = stage.mu_output * step * np.arange(points + 1)
        w = np.clip(w, w[0] - reach, w[0] + reach)
    tau = (1.0 + n * w) ** (1.0 / n)
    expected = np.trapezoid(tau - 1.0, dx=step) * stage.pretension_N / stage.EA_N
    assert q[-1] == pytest.approx(expected, rel=1e-3)
    assert abs(q[-1]) > 1e-5


@pytest.mark.parametrize("order", [1.0, 3.5])
def test_friction_that_depends_on_the_place_in_the_groove(order: float) -> None:
    """The place at s from the departure point is the one that the cable leaves at joint angle q - s."""
    config = joint("snow-open-rig", wrap_output_rad=25.0)
    stage = config.drive.stage[0]
    amplitude, phase = 0.7, 0.9
    columns = unloading(config)
    values = {"amplitude": amplitude, "phase_rad": phase} | ({} if order == 1.0 else {"order": order})
    found = run(config, columns, ("position_dependent_friction", values))["deflection_rad"]
    for k in (20, 50, 79):
        here = found[k]  # input locked: joint angle = deflection
        expected = expected_deflection(
            config,
            columns["joint_torque_Nm"][k],
            lambda _, s, here=here: (
                stage.mu_output * (1.0 + amplitude * math.cos(order * (here - s) - phase))
            ),
            lambda *_: stage.mu_input,
        )
        # on so long a wrap the table has a step of 0.03 rad
        assert found[k] == pytest.approx(expected, rel=1e-6 if order == 1.0 else 1e-4)


def test_a_patch_of_the_groove_counts_where_the_cable_lies_on_it() -> None:
    """A patch 0.4 rad wide about the place that the cable leaves at joint angle -0.3: rough for what lies about
    0.3 rad from where the cable departs, and nowhere else; on a wavy groove both factors multiply."""
    config = joint("snow-open-rig", wrap_output_rad=25.0)
    stage = config.drive.stage[0]
    columns = unloading(config)
    patch = {"patch": 3.0, "place_rad": -0.3, "width_rad": 0.2}
    for values, wave in ((patch, 0.0), ({**patch, "amplitude": 0.4, "phase_rad": 0.9}, 0.4)):
        found = run(config, columns, ("position_dependent_friction", values))["deflection_rad"]
        for k in (20, 50, 79):
            place = found[k]

            def rough(_: float, s: float, place: float = place, wave: float = wave) -> float:
                away = (place - s + 0.3) / 0.2
                return (
                    stage.mu_output * (1.0 + 3.0 / (1.0 + away**4)) * (1.0 + wave * math.cos(place - s - 0.9))
                )

            expected = expected_deflection(
                config, columns["joint_torque_Nm"][k], rough, lambda *_: stage.mu_input
            )
            assert found[k] == pytest.approx(
                expected, rel=1e-3
            )  # on so long a wrap the table has a step of 0.03 rad
    plain = run(config, columns)["deflection_rad"]
    assert abs(found[79] / plain[79]) < 0.95


@pytest.mark.parametrize("guide", [0.0, 0.2])
def test_friction_that_depends_on_the_place_in_the_input_drums_groove(guide: float) -> None:
    """The place at s from where the cable leaves the input drum is the one that it leaves at motor angle q + s, for the
    motor winds on what the joint winds off; behind a guide as well, where the cable's tension is nearer to T0."""
    config = joint("snow-open-rig", wrap_output_rad=25.0, wrap_input_rad=25.0)
    stage = config.drive.stage[0]
    amplitude, phase, motor = 0.7, 0.9, 2.3
    columns = unloading(config)
    columns["motor_position_rad"] += motor
    rough = ("position_dependent_friction", {"input_amplitude": amplitude, "input_phase_rad": phase})
    bent = [("routing_friction", {"mu_angle": guide, "arc_length_m": 0.0})] if guide else []
    found = run(config, columns, rough, *bent)["deflection_rad"]
    plain = run(config, columns, *bent)["deflection_rad"]

    def groove(_: float, s: float) -> float:
        return stage.mu_input * (1.0 + amplitude * math.cos(motor + s - phase))

    unit = stage.pretension_N / stage.EA_N * stage.input_radius_m / stage.output_radius_m
    for k in (40, 60, 79):
        load = columns["joint_torque_Nm"][k]
        tau = (1.0 + load / (stage.output_radius_m * stage.pretension_N)) * math.exp(guide)
        even = stretch(lambda *_: stage.mu_input, tau, stage.wrap_input_rad)
        expected = unit * (stretch(groove, tau, stage.wrap_input_rad) - even)
        assert found[k] - plain[k] == pytest.approx(expected, rel=3e-4)  # the table has a step of 0.02 rad
        assert abs(expected) > 1e-6


@pytest.mark.parametrize("drum", ["", "input_"])
def test_the_other_cable_sees_the_groove_the_other_way_round(drum: str) -> None:
    """Closed circuit, mirrored: reversing load, motion and phase reverses the joint exactly."""
    config = joint()
    columns = excitation(config)
    mirrored = columns | {k: -columns[k] for k in ("motor_position_rad", "joint_torque_Nm")}
    amplitude, phase = f"{drum}amplitude", f"{drum}phase_rad"
    ahead = run(config, columns, ("position_dependent_friction", {amplitude: 0.8, phase: 0.5}))
    back = run(config, mirrored, ("position_dependent_friction", {amplitude: 0.8, phase: -0.5}))
    assert back["deflection_rad"] == pytest.approx(-ahead["deflection_rad"], abs=1e-10)
    assert back["tension_l_N"] == pytest.approx(ahead["tension_h_N"], rel=1e-8)


def test_loops_are_narrow_where_the_groove_is_rough() -> None:
    """mu larger near q = 0 than near q = pi: the loop's width tells where the joint stands."""
    config = joint(wrap_output_rad=12.0, wrap_input_rad=12.0)
    time = np.linspace(0.0, 1.0, 400)
    values = {"amplitude": 0.9, "phase_rad": 0.0}

    def width(motor: float) -> float:
        load = np.concatenate([np.zeros(100), 1.2 * np.sin(np.linspace(0.0, 4.0 * np.pi, 300))])
        turn = motor * np.minimum(time / time[100], 1.0)
        q = run(config, still(time, load, motor=turn), ("position_dependent_friction", values))[
            "deflection_rad"
        ]
        return float(abs(np.trapezoid(q[250:], load[250:])))

    assert width(0.0) < 0.85 * width(math.pi)


def test_exponent_and_place_act_together() -> None:
    """Both factors multiply: on a groove of constant roughness 1 + a the coefficient is just mu (1 + a)."""
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    columns = unloading(config)
    both = run(
        config,
        columns,
        ("pressure_dependent_friction", {"exponent": 0.3}),
        ("position_dependent_friction", {"amplitude": 0.5, "phase_rad": 0.2}),
    )["deflection_rad"]
    k = 60
    expected = expected_deflection(
        config,
        columns["joint_torque_Nm"][k],
        lambda tau, s: stage.mu_output * tau**-0.3 * (1.0 + 0.5 * math.cos(both[k] - s - 0.2)),
        lambda tau, _: stage.mu_input * tau**-0.3,
    )
    assert both[k] == pytest.approx(expected, rel=1e-6)


def test_closed_circuit_tensions_with_pressure_dependence() -> None:
    """Nearly tangent closed circuit: both wraps' stretches cancel, each integrated on its own."""
    config = joint(free_length_m=1e-9)
    stage = config.drive.stage[0]
    n = 0.5
    time = np.linspace(0.0, 1.0, 60)
    unit = stage.output_radius_m * stage.pretension_N
    found = run(config, still(time, 0.8 * unit * time), ("pressure_dependent_friction", {"exponent": n}))
    tau_h, tau_l = (found[key][-1] / stage.pretension_N for key in ("tension_h_N", "tension_l_N"))
    assert tau_h - tau_l == pytest.approx(0.8, rel=1e-9)

    def wrap(tau: float) -> float:  # int (T - T0)/T0 d theta = int (T - T0)/T0 dT/(mu(T) T)
        return float(quad(lambda t: (t - 1.0) * t ** (n - 1.0), 1.0, tau, epsrel=1e-12)[0])

    assert wrap(tau_h) == pytest.approx(wrap(tau_l), rel=2e-3)  # l winds off a little, h on


def strain(stiffening: float, tau: float) -> float:
    """EA/T0 times the strain beyond that at T0 of a cable of tangent stiffness EA (1 + b (T/T0 - 1))."""
    return math.log1p(stiffening * (tau - 1.0)) / stiffening if stiffening else tau - 1.0


def slid(tau: float, width: float, mu: float, exponent: float, stiffening: float) -> tuple[float, float]:
    """int strain dθ over cable whose tension rises from tau by dT/dθ = mu (T/T0)^-n T, at most up to T0 or over
    `width`; T/T0 at its end."""
    if tau > 1.0 - 1e-9:  # at T0 already, to within the root finder's rounding: nothing slides
        return 0.0, tau

    def slope(_: float, state: np.ndarray) -> list[float]:
        return [mu * state[0] ** (1.0 - exponent), strain(stiffening, state[0])]

    def at_rest(_: float, state: np.ndarray) -> float:
        return float(state[0] - 1.0)

    at_rest.terminal = True
    found = solve_ivp(slope, (0.0, width), [tau, 0.0], rtol=1e-11, atol=1e-13, events=at_rest)
    return float(found.y[1, -1]), float(found.y[0, -1])


@pytest.mark.parametrize("lies", [{}, {"place": 0.2}, {"place": 0.9, "spread": 0.4}])
@pytest.mark.parametrize("mu_angle", [0.2, 1.5])  # slides through; holds
@pytest.mark.parametrize(("exponent", "stiffening"), [(0.4, 0.0), (0.0, 0.6), (-0.3, 0.3)])
def test_a_guide_where_friction_or_stiffness_depends_on_tension(
    mu_angle: float, exponent: float, stiffening: float, lies: dict[str, float]
) -> None:
    """What lies on the guide obeys the cable's own laws; so does what its friction leaves to the input drum; wherever
    in the free span it lies, and however much of that lies within it."""
    config = joint("snow-open-rig")
    stage = config.drive.stage[0]
    columns = unloading(config)
    effects = [("routing_friction", {"mu_angle": mu_angle, "arc_length_m": 0.02, **lies})]
    effects += [("pressure_dependent_friction", {"exponent": exponent})] if exponent else []
    effects += [("nonlinear_cable", {"stiffening": stiffening})] if stiffening else []
    observer = Observer(with_effects(config, effects))
    found = observer.run(columns)
    observer.check_state()
    tau = 0.5
    on_guide, tau_in = slid(tau, mu_angle, 1.0, exponent, stiffening)
    place, within = lies.get("place", 0.5), lies.get("spread", 0.0) * stage.free_length_m
    span = stage.free_length_m - within
    total = span * (place * strain(stiffening, tau) + (1.0 - place) * strain(stiffening, tau_in))
    total += on_guide * (0.02 + within) / mu_angle
    for end, wrap, mu, radius in (
        (tau, stage.wrap_output_rad, stage.mu_output, stage.output_radius_m),
        (tau_in, stage.wrap_input_rad, stage.mu_input, stage.input_radius_m),
    ):
        total += radius * slid(end, wrap, mu, exponent, stiffening)[0]
    expected = total * stage.pretension_N / stage.EA_N / stage.output_radius_m
    assert found["deflection_rad"][-1] == pytest.approx(expected, rel=1e-6)
    assert found["tension_h_input_N"][-1] == pytest.approx(tau_in * stage.pretension_N, rel=1e-7)


@pytest.mark.parametrize("mu_angle", [0.5, 1.4, 3.0])
def test_guides_of_cables_that_hang_one_behind_the_other_are_solved(mu_angle: float) -> None:
    """What sticks keeps the turn of the shaft between the two from the joint: its cable's give is not the joint's."""
    config = joint("two-stage-parallel")
    columns = excitation(config, 200)
    guides = ("routing_friction", {"mu_angle": mu_angle, "arc_length_m": 0.02, "place": 0.3})
    found = run(config, columns, guides)
    pull = columns["joint_torque_Nm"] / config.drive.stage[-1].output_radius_m
    assert found["tension_h_N"] - found["tension_l_N"] == pytest.approx(pull, abs=1e-9)


def test_a_guide_may_lie_where_the_cable_leaves_the_joints_drum() -> None:
    """As one that is a ten-thousandth of the free cable away."""
    config = joint()
    columns = excitation(config, 200)
    at, near = (
        run(config, columns, ("routing_friction", {"mu_angle": 0.3, "arc_length_m": 0.02, "place": place}))
        for place in (0.0, 1e-4)
    )
    deflection = near["deflection_rad"]
    assert at["deflection_rad"] == pytest.approx(deflection, abs=1e-3 * np.ptp(deflection))
