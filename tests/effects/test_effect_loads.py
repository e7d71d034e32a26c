"""Effects in the load path: the cables feel the measured moment less what the effect takes."""

from __future__ import annotations

import numpy as np
import pytest
from effect_cases import Columns, Floats, excitation, fed_with, joint, run, second_differences, still, unit
from scipy.signal import lsim

JOINTS = ("snow-closed-rig", "tendon-finger", "snow-open-rig", "two-stage-series")


@pytest.mark.parametrize("name", JOINTS)
def test_gravity_turns_with_the_joint(name: str) -> None:
    config = joint(name)
    columns = excitation(config)
    weight = 0.4 * unit(config)
    found = run(config, columns, ("gravity_load", {"moment_Nm": weight, "phase_rad": 0.7}))[
        "joint_position_rad"
    ]
    expected = fed_with(config, columns, columns["joint_torque_Nm"] - weight * np.sin(found + 0.7))
    assert found == pytest.approx(expected, abs=1e-10)


def test_a_weights_lever_may_grow_with_the_joint() -> None:
    """As on a linkage: m g l (1 + p q) sin(q + phase)."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    weight = 0.4 * unit(config)
    for growth in (0.8, -0.6):
        values = {"moment_Nm": weight, "phase_rad": 0.7, "growth_per_rad": growth}
        found = run(config, columns, ("gravity_load", values))["joint_position_rad"]
        load = columns["joint_torque_Nm"] - weight * (1.0 + growth * found) * np.sin(found + 0.7)
        assert found == pytest.approx(fed_with(config, columns, load), abs=1e-10)


@pytest.mark.parametrize("always", [0.0, 0.4])
def test_a_payload_weighs_while_it_is_held(always: float) -> None:
    """For 0.7 s of every 2 s from 0.5 s on, taken up and set down within 0.2 s; before 0.5 s as after it."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    time, weight = columns["time_s"], 0.4 * unit(config)
    starts = 0.5 + 2.0 * np.arange(-2, int(time[-1]))
    at = np.add.outer(starts, [0.0, 0.2, 0.7, 0.9]).ravel()
    there = np.interp(time, at, np.tile([0.0, 1.0, 1.0, 0.0], len(starts)))
    cycle = {"period_s": 2.0, "picked_up_s": 0.5, "held": 0.35, "lift_s": 0.2, "always": always}
    found = run(config, columns, ("gravity_load", {"moment_Nm": weight, "phase_rad": 0.7, **cycle}))
    turned = found["joint_position_rad"]
    load = columns["joint_torque_Nm"] - weight * (always + (1.0 - always) * there) * np.sin(turned + 0.7)
    assert np.ptp(there) > 0.9
    assert turned == pytest.approx(fed_with(config, columns, load), abs=1e-10)


@pytest.mark.parametrize("held", [0.9, 1.0])
def test_a_payload_that_is_hardly_set_down_still_weighs(held: float) -> None:
    """Taken up again within less than the 0.4 s that it takes: what is not down yet goes on weighing."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    weight = 0.4 * unit(config)
    cycle = {"period_s": 1.0, "picked_up_s": -9.5, "held": held, "lift_s": 0.4}
    found = run(config, columns, ("gravity_load", {"moment_Nm": weight, "phase_rad": 0.7, **cycle}))
    turned, least = found["joint_position_rad"], 1.0 - (1.0 - held) / 0.4
    at = np.array([0.0, 0.4 - (1.0 - held), 0.4, held, 1.0])
    there = np.interp((columns["time_s"] + 9.5) % 1.0, at, [least, least, 1.0, 1.0, least])
    load = columns["joint_torque_Nm"] - weight * there * np.sin(turned + 0.7)
    assert turned == pytest.approx(fed_with(config, columns, load), abs=1e-10)


def test_gravity_turns_with_the_joint_that_carries_the_base() -> None:
    """As the same weight at the phase that the other joint's angle makes of it; where that is not read, as untilted."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    roll = 0.8 * np.sin(3.0 * columns["time_s"])
    roll[50:60] = np.nan
    columns["other_roll_rad"] = roll
    weight = 0.4 * unit(config)
    values = {"moment_Nm": weight, "phase_rad": 0.7, "tilt_rad_per_unit": -0.9, "channel": "other_roll_rad"}
    found = run(config, columns, ("gravity_load", values))["joint_position_rad"]
    turned = found + 0.7 - 0.9 * np.nan_to_num(roll)
    expected = fed_with(config, columns, columns["joint_torque_Nm"] - weight * np.sin(turned))
    assert found == pytest.approx(expected, abs=1e-10)


def test_gravity_leans_with_the_joint_that_carries_the_base() -> None:
    """As a load that is the same weight's, of which the joint's axis feels the share across its slope."""
    config = joint(JOINTS[0])
    columns = excitation(config)
    roll = 0.8 * np.sin(3.0 * columns["time_s"])
    roll[50:60] = np.nan
    columns["other_roll_rad"] = roll
    weight = 0.4 * unit(config)
    lean = {"lean_rad_per_unit": 1.1, "upright_rad": -0.4, "channel": "other_roll_rad"}
    found = run(config, columns, ("gravity_load", {"moment_Nm": weight, "phase_rad": 0.7, **lean}))
    angle = found["joint_position_rad"]
    taken = weight * np.cos(1.1 * np.nan_to_num(roll) - 0.4) * np.sin(angle + 0.7)
    expected = fed_with(config, columns, columns["joint_torque_Nm"] - taken)
    assert angle == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("name", JOINTS)
def test_inertia_takes_mass_times_acceleration(name: str) -> None:
    config = joint(name)
    columns = excitation(config)
    inertia = 0.02 * unit(config)
    found = run(config, columns, ("inertial_load", {"inertia_kgm2": inertia}))["joint_position_rad"]
    load = columns["joint_torque_Nm"] - inertia * second_differences(columns["time_s"], found)
    assert found == pytest.approx(fed_with(config, columns, load), abs=1e-9)


def test_an_arm_that_folds_obeys_lagrange() -> None:
    """d/dt (J(q) q') - J'(q) q'^2/2 is taken off the load."""
    config = joint("tendon-finger")
    columns = moved_motor(6401)
    law = {"inertia_kgm2": 2e-4, "by_cosine": 0.4, "by_sine": -0.3}
    found = run(config, columns, ("inertial_load", law))["joint_position_rad"]
    time = columns["time_s"]
    speed = np.gradient(found, time)
    inertia = 2e-4 * (1.0 + 0.4 * np.cos(found) - 0.3 * np.sin(found))
    by_angle = 2e-4 * (-0.4 * np.sin(found) - 0.3 * np.cos(found))
    taken = np.gradient(inertia * speed, time) - 0.5 * by_angle * speed**2
    expected = fed_with(config, columns, columns["joint_torque_Nm"] - taken)
    still_so = run(config, columns, ("inertial_load", {"inertia_kgm2": 2e-4}))["joint_position_rad"]
    late = slice(100, -5)
    moves = np.ptp((found - still_so)[late])
    assert np.max(np.abs(found - expected)[late]) < 0.02 * moves


@pytest.mark.parametrize(("share", "pulsation"), [(1.0, 40.0), (0.4, 6.0)])
def test_what_swings_after_the_joint_is_an_oscillator_on_it(share: float, pulsation: float) -> None:
    """x'' = w^2 (q - x) + 2 z w (q' - x') as a filter of q'', of the joint's own course."""
    config = joint("tendon-finger")
    columns = moved_motor(6401)
    swings = {"swings": share, "swings_rad_s": pulsation, "damping_ratio": 0.2}
    found = run(config, columns, ("inertial_load", {"inertia_kgm2": 2e-4, **swings}))["joint_position_rad"]
    time = columns["time_s"]
    drag, stiff = 0.4 * pulsation, pulsation**2
    rigid = np.gradient(np.gradient(found, time), time)
    _, rate, _ = lsim(([drag, stiff], [1.0, drag, stiff]), rigid, time)
    taken = 2e-4 * ((1.0 - share) * rigid + share * rate)
    expected = fed_with(config, columns, columns["joint_torque_Nm"] - taken)
    still_so = run(config, columns, ("inertial_load", {"inertia_kgm2": 2e-4}))["joint_position_rad"]
    late = slice(100, -5)
    assert np.max(np.abs(found - expected)[late]) < 0.02 * np.ptp((found - still_so)[late])


def moved_motor(samples: int) -> Columns:
    time = np.linspace(0.0, 1.0, samples)
    return still(time, np.zeros(samples), motor=0.3 * np.sin(9.0 * time) ** 3)


def test_a_gap_makes_no_pull_of_its_own() -> None:
    """Steps left out of an even swing: what is predicted beyond the gap is what it would have been without."""
    config = joint("tendon-finger")
    effect = ("inertial_load", {"inertia_kgm2": 2e-4})
    columns = moved_motor(1601)
    whole = run(config, columns, effect)["deflection_rad"]
    moves = np.ptp(whole - run(config, columns)["deflection_rad"])
    for begin in (300, 640, 905, 1210):
        kept = np.delete(np.arange(1601), slice(begin, begin + 12))
        found = run(config, {name: v[kept] for name, v in columns.items()}, effect)["deflection_rad"]
        assert np.max(np.abs(found - whole[kept])) < 0.04 * moves


def test_inertia_converges_with_the_square_of_the_step() -> None:
    config = joint("tendon-finger")
    effect = ("inertial_load", {"inertia_kgm2": 2e-4})
    counts = (801, 1601, 3201)
    q = [run(config, moved_motor(n), effect)["joint_position_rad"][:: (n - 1) // 200] for n in counts]
    assert np.abs(q[0] - q[1]).max() / np.abs(q[1] - q[2]).max() == pytest.approx(4.0, rel=0.25)


def test_inertia_swings_on_the_free_span() -> None:
    """Resonance of J on the free spans, 2 EA R^2/L: amplification 1/(1 - (w/w0)^2) of a small load."""
    config = joint("tendon-finger", mu_output=50.0, mu_input=50.0)  # no slip: the free span alone
    stage = config.drive.stage[0]
    stiffness = 2.0 * stage.EA_N * stage.output_radius_m**2 / stage.free_length_m
    inertia = 1e-3
    natural = np.sqrt(stiffness / inertia)
    drive = 0.5 * natural
    time = np.linspace(0.0, 24.0 * 2.0 * np.pi / natural, 4801)
    load = 1e-3 * np.sin(drive * time) * np.clip(time / time[-1] * 2.0, 0.0, 1.0)
    q = run(config, still(time, load), ("inertial_load", {"inertia_kgm2": inertia}))["joint_position_rad"]
    tail = time > 0.6 * time[-1]
    assert np.abs(q[tail]).max() == pytest.approx(1e-3 / stiffness / (1.0 - 0.25), rel=0.02)


def test_inertia_takes_uneven_steps_and_repeated_times() -> None:
    config = joint("tendon-finger")
    effect = ("inertial_load", {"inertia_kgm2": 2e-4})
    even = moved_motor(8001)
    rng = np.random.default_rng(5)
    keep = np.sort(np.append(rng.choice(np.arange(1, 8000), 5600, replace=False), [0, 8000]))
    uneven = {key: value[keep] for key, value in even.items()}
    repeated = {key: np.repeat(value[:1000], 2) for key, value in even.items()}
    reference = run(config, even, effect)["joint_position_rad"]
    scale = np.abs(reference - even["motor_position_rad"] * 0.75).max()
    assert run(config, uneven, effect)["joint_position_rad"] == pytest.approx(
        reference[keep], abs=0.02 * scale
    )
    assert run(config, repeated, effect)["joint_position_rad"][::2] == pytest.approx(
        reference[:1000], abs=1e-7
    )


def test_even_motion_from_the_start_makes_no_jerk() -> None:
    config = joint("tendon-finger")
    time = np.linspace(0.0, 1.0, 501)
    columns = still(time, np.zeros(501), motor=0.8 * time)
    q = run(config, columns, ("inertial_load", {"inertia_kgm2": 0.01}))["joint_position_rad"]
    assert q == pytest.approx(0.75 * 0.8 * time, abs=1e-9)


def presliding(q: Floats, start: float, width: float) -> Floats:
    """State z of one elasto-plastic element that follows the angle, -1 <= z <= 1."""
    z, states = 0.0, []
    for moved in np.diff(q, prepend=start):
        z = min(max(z + moved / width, -1.0), 1.0)
        states.append(z)
    return np.array(states)


@pytest.mark.parametrize(("width", "growth"), [(1e-6, 0.0), (1e-3, 0.0), (1e-3, 3.0)])
@pytest.mark.parametrize("name", ["snow-closed-rig", "tendon-finger", "two-stage-series"])
def test_bearing_friction_holds_back_more_where_the_load_tilts_the_bearing(
    name: str, width: float, growth: float
) -> None:
    config = joint(name)
    columns = excitation(config)
    torque, load = 0.05 * unit(config), columns["joint_torque_Nm"]
    values = {"torque_Nm": torque, "load_coefficient": 0.0, "presliding_rad": width}
    values["growth_per_Nm"] = growth / unit(config)
    found = run(config, columns, ("bearing_friction", values))["joint_position_rad"]
    limit = torque * (1.0 + growth * np.abs(load) / unit(config))
    load = load - limit * presliding(found, 0.0, width)
    expected = fed_with(config, columns, load)
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ["snow-closed-rig", "tendon-finger", "two-stage-series"])
def test_bearing_friction_in_grease_drags_with_the_joints_speed(name: str) -> None:
    config = joint(name)
    columns = excitation(config)
    torque = 0.02 * unit(config)
    values = {"torque_Nm": torque, "load_coefficient": 0.0, "presliding_rad": 1e-3, "viscous_s_per_rad": 3.0}
    found = run(config, columns, ("bearing_friction", values))["joint_position_rad"]
    speed = np.concatenate(([0.0], np.diff(found) / np.diff(columns["time_s"])))
    load = columns["joint_torque_Nm"] - torque * (presliding(found, 0.0, 1e-3) + 3.0 * speed)
    assert found == pytest.approx(fed_with(config, columns, load), abs=1e-9)


def test_bearing_friction_grows_with_its_load() -> None:
    config = joint("snow-open-rig")
    columns = excitation(config)
    values = {"torque_Nm": 0.0, "load_coefficient": 0.08, "presliding_rad": 1e-4}
    found = run(config, columns, ("bearing_friction", values))
    radial = config.drive.stage[0].output_radius_m * found["tension_h_N"]
    load = columns["joint_torque_Nm"] - 0.08 * radial * presliding(found["joint_position_rad"], 0.0, 1e-4)
    assert found["joint_position_rad"] == pytest.approx(fed_with(config, columns, load), abs=1e-9)


def test_a_locked_joint_with_bearing_friction_lets_go_after_twice_the_torque() -> None:
    """Tell-tale: a step of 2 tau_b in the load path at each reversal, whatever the wraps do."""
    config = joint()
    torque = 0.1
    time = np.linspace(0.0, 1.0, 2001)
    load = 1.5 - 1.5 * np.abs(2.0 * time - 1.0)
    values = {"torque_Nm": torque, "load_coefficient": 0.0, "presliding_rad": 1e-9}
    q = run(config, still(time, load), ("bearing_friction", values))["deflection_rad"]
    back = np.flatnonzero((time > 0.5) & (q < q.max() - 1e-8))[0]
    assert load.max() - load[back] == pytest.approx(2.0 * torque, abs=0.01)
