"""One wrap by itself: unwinding, a pulley that turns steadily, and energy, against the thesis and against the
profile."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from wrap_energy import friction_work_J, stored_J

from cablecomp.mechanics import arc
from cablecomp.mechanics.cable import drum_eval, span_play
from cablecomp.mechanics.profile import Meet, Points, set_pending, wrap_commit, wrap_eval, wrap_fill
from cablecomp.mechanics.records import POINT, STEP
from cablecomp.mechanics.tables import law_table

Array = NDArray[np.float64]


def one_wrap(values: list[tuple[float, float]], start_rad: float, mu: float) -> tuple[Points, int]:
    """A single wrap through (wrap angle, end value) steps from uniform tension."""
    p = np.zeros(512, POINT)
    n = wrap_fill(p, None, 0, start_rad, 0.0, 0.0)
    for w, v in values:
        n, _ = moved(p, n, w, v, mu)
    return p, n


def moved(p: Points, n: int, w: float, v: float, mu: float) -> tuple[int, Meet]:
    """One step of the wrap p; its new number of points, and the step's evaluation."""
    step = np.zeros(1, STEP)[0]
    step.w, step.end_v, step.end_tau = w, v, float(np.exp(v))
    meet = wrap_eval(p, None, 0, n, w, v, step.end_tau, mu)
    set_pending(step, meet)
    return wrap_commit(p, None, 0, n, step, 0.0), meet


def turned(p: Points, n: int, turn: float, v: float) -> int:
    """A pulley turns: cable arrives at the near end of its only arc at v, as much leaves at the far end."""
    y, width = p[:n]["y"].copy(), p[n - 1]["y"]
    inside = int(np.searchsorted(y, width - turn))
    last = np.interp(width - turn, y, p[:n]["v"])
    places = [0.0, *(y[:inside] + turn), width]
    values = [v, *p[:inside]["v"], last]
    p[: len(places)]["y"], p[: len(places)]["v"] = places, values
    return len(places)


@pytest.mark.parametrize("now", [1.3, 0.8])
def test_unwinding_moves_the_corner_by_half_and_erases_the_bump(now: float) -> None:
    mu, peak, w = 0.15, 2.2, 25.0
    corner = np.log(peak / now) / (2.0 * mu)
    # each end value holds |ln T|/mu of wrap: (2-74) is the special case of an end value at or below 1
    erased_by = (abs(np.log(peak)) - abs(np.log(now))) / mu
    for unwound in np.linspace(0.1, 0.95, 5) * min(erased_by, 2.0 * corner):
        steps = [(w, np.log(peak)), (w, np.log(now))]
        steps += [(w - b, np.log(now)) for b in np.linspace(0.0, unwound, 50)[1:]]
        p, n = one_wrap(steps, w, mu)
        top = int(np.argmax(p[:n]["v"]))
        assert (w - unwound) - p[top].y == pytest.approx(corner - unwound / 2.0, abs=1e-9)  # (2-72)
    if now > 1.0:
        steps = [(w, np.log(peak)), (w, np.log(now)), (w - 1.0001 * erased_by, np.log(now))]
        p, n = one_wrap(steps, w, mu)
        assert np.max(p[:n]["v"]) <= np.log(now) + 1e-9


@pytest.mark.parametrize("v", [0.08, -0.08])
@pytest.mark.parametrize("w", [7.0, 8.2])
def test_what_turning_does_under_friction_by_place_is_told(v: float, w: float) -> None:
    """Where the cone of the end cuts the profile, it falls by mu (1 + a sin w) as the drum turns on (differences)."""
    law = np.stack([law_table(np.ones_like, lambda y: 1.0 + 0.6 * np.sin(y), 12.0)])
    p, cable = np.zeros(64, POINT), SimpleNamespace(mu=(0.1, 0.1), law=(0, 0), viscous=0.0)
    n = wrap_fill(p, law, 0, w, 0.0, 0.0)
    steps = np.zeros(2, STEP).view(np.recarray)
    drive: Any = SimpleNamespace(cables=[cable], steps=steps, profiles=[p], heights=[n])

    def there(at: float) -> Any:
        return drum_eval.py_func(drive, law, 0, 0, np.exp(v), v, at)  # the kernel has no entry from Python

    step = 1e-5
    told = (there(w + step).total - there(w - step).total) / (2.0 * step)
    assert there(w).by_wrap == pytest.approx(told, rel=1e-5)


def test_a_belt_pulley_loses_what_slip_at_its_exit_takes() -> None:
    mu, width, low, high = 0.2, 3.0, np.log(0.8), np.log(1.15)
    p = np.zeros(400, POINT)
    n = arc.arc_fill(p, None, width, 0.0)
    turn = 0.005
    for _ in range(1500):
        n = turned(p, n, turn, low)
        n = arc.arc_commit(p, None, n, low, high, mu)
    y, tension = p[:n]["y"], np.exp(p[:n]["v"])
    slips = width - float(y[np.argmax(tension > np.exp(low) * (1.0 + 1e-9)) - 1])
    assert slips == pytest.approx((high - low) / mu, rel=1e-3)  # (2-99), at the exit only
    # work of friction per radian turned, from the profile: force dT times slip, strain beyond the entry's
    fine = np.linspace(0.0, width, 200001)
    T = np.exp(np.interp(fine, y, p[:n]["v"]))
    loss = float(np.sum(np.diff(T) * (0.5 * (T[1:] + T[:-1]) - T[0])))
    assert loss == pytest.approx((T[-1] - T[0]) ** 2 / 2.0, rel=1e-3)  # (2-113) in units of R T0^2/EA
    strain = 1e-3  # T0/EA: two such pulleys make the drive's efficiency limit (2-118)
    efficiency = 1.0 - 2.0 * loss * strain / (T[-1] - T[0])
    assert 1.0 - efficiency == pytest.approx((T[-1] - T[0]) * strain, rel=1e-3)


def test_work_in_is_what_is_stored_and_what_slip_takes() -> None:
    mu, w, radius, stiffness = 0.15, 20.0, 0.04, 25000.0
    p = np.zeros(512, POINT)
    n = wrap_fill(p, None, 0, w, 0.0, 0.0)
    corners = [0.0, 0.6, -0.4, 0.3, -0.1, 0.5, 0.0]
    values = np.concatenate([np.linspace(a, b, 151)[1:] for a, b in pairwise(corners)])
    work = taken = 0.0
    before, tension, length = (p[:n]["y"].copy(), np.exp(p[:n]["v"])), 1.0, 0.0
    first = stored_J(before[0], before[1], radius, stiffness)
    for v in values:
        n, meet = moved(p, n, w, v, mu)
        after = (p[:n]["y"].copy(), np.exp(p[:n]["v"]))
        work += 0.5 * (tension + np.exp(v)) * (meet.total - length) * radius / stiffness
        taken += friction_work_J(before, after, radius, stiffness)
        before, tension, length = after, float(np.exp(v)), meet.total
    stored = stored_J(before[0], before[1], radius, stiffness) - first
    assert taken > 0.0
    assert work == pytest.approx(stored + taken, rel=2e-3)


def test_a_play_follows_outside_its_radius_and_keeps_what_it_has_within() -> None:
    z = 0.0
    for x in np.concatenate([np.linspace(0.0, 3.0, 31), np.linspace(3.0, -3.0, 61)]):
        before = z
        z, slope = span_play(1.0, 0.0, z, float(x))
        assert abs(x - z) <= 1.0 + 1e-15
        assert slope == (1.0 if abs(x - before) > 1.0 else 0.0)
        assert slope == 1.0 or z == before
    assert span_play(0.0, 0.3, 0.7, 2.0) == (0.0, 0.0)  # no play at all


def test_a_pressed_play_holds_more_the_more_it_is_pressed() -> None:
    z = 0.0
    for x in np.concatenate(
        [np.linspace(0.0, 2.0, 41), np.linspace(1.99, -2.0, 81), np.linspace(-1.99, 1.0, 61)]
    ):
        before = z
        z, slope = span_play(0.5, 0.3, z, float(x))
        holds = 0.5 * (1.0 + 0.3 * x)
        assert abs(x - z) <= holds + 1e-15
        assert z == before if abs(x - before) < holds else abs(x - z) == pytest.approx(holds)
        step = 1e-6
        assert slope == pytest.approx(
            (span_play(0.5, 0.3, before, x + step)[0] - span_play(0.5, 0.3, before, x - step)[0])
            / (2.0 * step),
            abs=1e-8,
        )


@numba.njit
def near_change(p: Points, n: int, near: float, far: float) -> float:
    """How much cable an arc of mu = 1 takes up between its near end and the point that sticks."""
    return float(arc.arc_meet(p, None, n, near, math.exp(near), far, 1.0).change)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_an_arc_about_to_slide_takes_up_as_much_as_just_before(way: float, share: float) -> None:
    """To the last bit of the limit, where rounding says whether the slip zones touch or overlap."""
    width = 0.0316
    p = np.zeros(64, POINT)
    n = arc.arc_fill(p, None, width, 0.0)
    n = arc.arc_commit(
        p, None, n, -0.08 * way, (width - 0.08) * way, 1.0
    )  # slid as a whole, and now the other way
    middle = (2.0 * share * width - 0.08) * way
    before = near_change(p, n, middle, middle - (width - 1e-8) * way)
    for ulps in range(-6, 7):
        limit = middle - width * way * (1.0 + ulps * 2.0**-53)
        assert near_change(p, n, middle, limit) == pytest.approx(before, abs=2e-8)
