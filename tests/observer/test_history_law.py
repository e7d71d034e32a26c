"""The thesis's closed forms must come out of the general history law; none of them is coded into it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from observer_joints import joint, pull_unit
from wrap_energy import friction_work_J, stored_J

from cablecomp.mechanics import arc
from cablecomp.mechanics.profile import ROWS, Meet, V, Y, set_pending, wrap_commit, wrap_eval, wrap_fill
from cablecomp.mechanics.records import STEP
from cablecomp.observer import Observer
from cablecomp.thesis.closed_forms.closed import (
    closed_loading_deflection_rad,
    closed_unloading_deflection_rad,
)
from cablecomp.thesis.closed_forms.open import open_loading_deflection_rad, open_unloading_deflection_rad
from cablecomp.thesis.closed_forms.series import (
    series_loading_deflection_rad,
    series_unloading_deflection_rad,
)
from cablecomp.thesis.closed_forms.stage import equivalent_stage

Array = NDArray[np.float64]
STIFF = 6e11  # N: strains of 1e-10, so that the drums hardly turn and the thesis's locked pulleys are met
LONG = {"wrap_output_rad": 60.0, "wrap_input_rad": 60.0, "EA_N": STIFF}


def locked(observer: Observer, loads: Array) -> Array:
    """Deflection under loads with the motor at zero."""
    return observer.run(
        {
            "time_s": np.arange(float(len(loads))),
            "motor_position_rad": np.zeros(len(loads)),
            "joint_torque_Nm": loads,
        }
    )["deflection_rad"]


def ramp(*corners: float, points: int = 40) -> Array:
    """Straight segments through corners."""
    parts = [np.linspace(a, b, points + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([[corners[0]], *parts])


@pytest.mark.parametrize("length", [1e-3, 0.08, 1.0, 10.0])
@pytest.mark.parametrize("peak", [0.4, 1.3, -0.9])
def test_closed_circuit_loading_and_unloading(length: float, peak: float) -> None:
    config = joint("closed", {**LONG, "free_length_m": length})
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, peak * unit)[1:], ramp(peak * unit, 0.05 * peak * unit)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [closed_loading_deflection_rad(up, stage), closed_unloading_deflection_rad(down, peak * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


@pytest.mark.parametrize("peak", [1.5, -0.6])
def test_open_circuit_loading_and_unloading(peak: float) -> None:
    config = joint("open", LONG)
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, peak * unit)[1:], ramp(peak * unit, 0.0)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [open_loading_deflection_rad(up, stage), open_unloading_deflection_rad(down, peak * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_a_cable_that_goes_slack_and_is_taken_up_again() -> None:
    config = joint("closed", {**LONG, "free_length_m": 40.0})
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up = ramp(0.0, 3.0 * unit, points=60)[1:]
    loads = np.concatenate([[0.0], up, ramp(3.0 * unit, 0.0)[1:]])
    observer = Observer(config)
    found = locked(observer, loads)
    expected = closed_loading_deflection_rad(up, stage)
    assert found[1:61] == pytest.approx(expected, rel=2e-5)  # a slack cable keeps a millionth of T0
    assert np.all(np.diff(found[60:]) < 0.0)


def test_chains_of_open_stages_are_their_equivalent_stage() -> None:
    first = {
        **LONG,
        "pretension_N": 60.0 * (0.015 / 0.04) * 0.04 / 0.03,
        "output_radius_m": 0.03,
        "mu_output": 0.2,
    }
    config = joint("open", first, LONG)
    stage, unit = equivalent_stage(config.drive), pull_unit(config)
    up, down = ramp(0.0, 0.9 * unit)[1:], ramp(0.9 * unit, 0.0)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [open_loading_deflection_rad(up, stage), open_unloading_deflection_rad(down, 0.9 * unit, stage)]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_closed_stages_in_series_add_with_their_ratios() -> None:
    config = joint("closed", {**LONG, "free_length_m": 0.3}, LONG)
    unit = pull_unit(config)
    up, down = ramp(0.0, 1.1 * unit)[1:], ramp(1.1 * unit, 0.1 * unit)[1:]
    found = locked(Observer(config), np.concatenate([[0.0], up, down]))[1:]
    expected = np.concatenate(
        [
            series_loading_deflection_rad(up, config.drive),
            series_unloading_deflection_rad(down, 1.1 * unit, config.drive),
        ]
    )
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(np.max(np.abs(expected))))


def test_return_point_memory_and_wiping_out() -> None:
    config = joint("closed")
    unit = pull_unit(config)
    outer = ramp(0.0, 1.2 * unit, -1.0 * unit, 0.5 * unit)
    inner = ramp(0.5 * unit, 0.1 * unit, 0.4 * unit, 0.2 * unit, 0.5 * unit)[1:]
    rest = ramp(0.5 * unit, 1.1 * unit, -0.4 * unit)[1:]
    plain = locked(Observer(config), np.concatenate([outer, rest]))
    nested = locked(Observer(config), np.concatenate([outer, inner, rest]))
    scale = float(np.ptp(plain))
    assert abs(nested[len(outer) + len(inner) - 1] - plain[len(outer) - 1]) < 1e-12 * scale
    assert np.max(np.abs(nested[-len(rest) :] - plain[-len(rest) :])) < 1e-12 * scale


def one_wrap(values: list[tuple[float, float]], start_rad: float, mu: float) -> tuple[Array, int]:
    """A single wrap through (wrap angle, end value) steps from uniform tension."""
    G = np.zeros((1, ROWS, 512))
    n = wrap_fill(G, None, 0, 0, start_rad, 0.0, 0.0)
    for w, v in values:
        n, _ = moved(G, n, w, v, mu)
    return G[0], n


def moved(G: Array, n: int, w: float, v: float, mu: float) -> tuple[int, Meet]:
    """One step of the only wrap in G; its new number of points, and the step's evaluation."""
    step = np.zeros(1, STEP)[0]
    step.w, step.end, step.tau = w, v, float(np.exp(v))
    meet = wrap_eval(G, None, 0, 0, n, w, v, step.tau, mu)
    set_pending(step, meet)
    return wrap_commit(G, None, 0, 0, n, step, 0.0), meet


def turned(G: Array, n: int, turn: float, v: float) -> int:
    """A pulley turns: cable arrives at the near end of its only arc at v, as much leaves at the far end."""
    y, width = G[0, Y, :n].copy(), G[0, Y, n - 1]
    inside = int(np.searchsorted(y, width - turn))
    last = np.interp(width - turn, y, G[0, V, :n])
    places = [0.0, *(y[:inside] + turn), width]
    values = [v, *G[0, V, :inside], last]
    G[0, Y, : len(places)], G[0, V, : len(places)] = places, values
    return len(places)


@pytest.mark.parametrize("now", [1.3, 0.8])
def test_unwinding_moves_the_corner_by_half_and_erases_the_bump(now: float) -> None:
    mu, peak, w = 0.15, 2.2, 25.0
    corner = np.log(peak / now) / (2.0 * mu)
    erased_by = (
        abs(np.log(peak)) - abs(np.log(now))
    ) / mu  # (2-74), from any level: each step of ln T erases |ln T|/mu of wrap
    for turned in np.linspace(0.1, 0.95, 5) * min(erased_by, 2.0 * corner):
        steps = [(w, np.log(peak)), (w, np.log(now))]
        steps += [(w - b, np.log(now)) for b in np.linspace(0.0, turned, 50)[1:]]
        G, n = one_wrap(steps, w, mu)
        top = int(np.argmax(G[V, :n]))
        assert (w - turned) - G[Y, top] == pytest.approx(corner - turned / 2.0, abs=1e-9)  # (2-72)
    if now > 1.0:
        steps = [(w, np.log(peak)), (w, np.log(now)), (w - 1.0001 * erased_by, np.log(now))]
        G, n = one_wrap(steps, w, mu)
        assert np.max(G[V, :n]) <= np.log(now) + 1e-9


def test_a_belt_pulley_loses_what_slip_at_its_exit_takes() -> None:
    mu, width, low, high = 0.2, 3.0, np.log(0.8), np.log(1.15)
    G = np.zeros((1, ROWS, 400))
    n = arc.arc_fill(G, 0, width, 0.0)
    turn = 0.005
    for _ in range(1500):
        n = turned(G, n, turn, low)
        n = arc.arc_commit(G, 0, n, low, high, mu)
    y, tension = G[0, Y, :n], np.exp(G[0, V, :n])
    slips = width - float(y[np.argmax(tension > np.exp(low) * (1.0 + 1e-9)) - 1])
    assert slips == pytest.approx((high - low) / mu, rel=1e-3)  # (2-99), at the exit only
    # work of friction per radian turned, from the profile: force dT times slip, strain beyond the entry's
    fine = np.linspace(0.0, width, 200001)
    T = np.exp(np.interp(fine, y, G[0, V, :n]))
    loss = float(np.sum(np.diff(T) * (0.5 * (T[1:] + T[:-1]) - T[0])))
    assert loss == pytest.approx((T[-1] - T[0]) ** 2 / 2.0, rel=1e-3)  # (2-113) in units of R T0^2/EA
    strain = 1e-3  # T0/EA: two such pulleys make the drive's efficiency limit (2-118)
    efficiency = 1.0 - 2.0 * loss * strain / (T[-1] - T[0])
    assert 1.0 - efficiency == pytest.approx((T[-1] - T[0]) * strain, rel=1e-3)


def test_work_in_is_what_is_stored_and_what_slip_takes() -> None:
    mu, w, radius, stiffness = 0.15, 20.0, 0.04, 25000.0
    G = np.zeros((1, ROWS, 512))
    n = wrap_fill(G, None, 0, 0, w, 0.0, 0.0)
    values = ramp(0.0, 0.6, -0.4, 0.3, -0.1, 0.5, 0.0, points=150)[1:]
    work = taken = 0.0
    before, tension, length = (G[0, Y, :n].copy(), np.exp(G[0, V, :n])), 1.0, 0.0
    first = stored_J(before[0], before[1], radius, stiffness)
    for v in values:
        n, meet = moved(G, n, w, v, mu)
        after = (G[0, Y, :n].copy(), np.exp(G[0, V, :n]))
        work += 0.5 * (tension + np.exp(v)) * (meet.total - length) * radius / stiffness
        taken += friction_work_J(before, after, radius, stiffness)
        before, tension, length = after, float(np.exp(v)), meet.total
    stored = stored_J(before[0], before[1], radius, stiffness) - first
    assert taken > 0.0
    assert work == pytest.approx(stored + taken, rel=2e-3)
