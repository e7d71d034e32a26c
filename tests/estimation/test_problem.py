"""The fitting problem: zeros projected out are zeros solved for, priors are rows, a solution is a minimum."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_problem import ANGLE, SIGMA, SPREAD, evidence, problem, three_recordings
from turning import JOINT, recorded

from cablecomp.config import Limits, with_values
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.history import forgotten
from cablecomp.estimation.least_squares import Fit, covariance, inside, rms_left, rms_of_rows, solve, weighed
from cablecomp.estimation.limits import MOVED_SD, STEP
from cablecomp.estimation.parameter import Parameter, by_condition, of_drive, own_of
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.estimation.simulate import Simulator
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

UNLIMITED = JOINT.model_copy(update={"limits": Limits()})


@pytest.fixture(scope="module")
def three() -> tuple[Evidence, ...]:
    return three_recordings()


@pytest.mark.parametrize("moved", [(), ("1",)])
def test_zeros_projected_out_are_those_of_an_explicit_least_squares_fit(
    three: tuple[Evidence, ...], moved: tuple[str, ...]
) -> None:
    """min over zeros of |w (m - z)/s|^2 + |d/spread|^2, z = session's + recording's departure d; spread is larger for
    one that was set anew."""
    p = problem(three)
    p = p.with_weighing(replace(p.weighing, moved={ANGLE: dict.fromkeys(moved, MOVED_SD * SPREAD)}))
    misfits = p.misfits(p.start)[ANGLE]
    rows, design = [], []
    for k, (e, m) in enumerate(zip(three, misfits, strict=True)):
        w = e.weight[e.counted[ANGLE]] / SIGMA
        rows.append(w * m[e.counted[ANGLE]])
        columns = np.zeros((len(w), 5))
        columns[:, p.sessions.index(e.session)] = w
        columns[:, 2 + k] = w
        design.append(columns)
    spreads = [SPREAD * (MOVED_SD if e.name in moved else 1.0) for e in three]
    penalty = np.hstack([np.zeros((3, 2)), np.diag(1.0 / np.array(spreads))])
    A = np.vstack([*design, penalty])
    b = np.concatenate([*rows, np.zeros(3)])
    solved = np.linalg.lstsq(A, b, rcond=None)[0]
    left = b - A @ solved
    found = p.residual(p.start)[: len(b)]
    np.testing.assert_allclose(found, left, atol=1e-7 * np.abs(b).max())
    zeros = p.zeros(p.start)[ANGLE]
    for k, e in enumerate(three):
        assert zeros[e.name][0] == pytest.approx(
            solved[p.sessions.index(e.session)] + solved[2 + k], abs=1e-9
        )


def test_zeros_of_the_recordings_come_out(three: tuple[Evidence, ...]) -> None:
    p = problem(three, spread=1e-2)
    zeros = p.zeros(p.start)[ANGLE]
    assert [zeros[e.name][0] for e in three] == pytest.approx([1e-3, 1.2e-3, -4e-3], abs=2e-5)


def test_priors_are_departures_in_units_of_their_sd() -> None:
    p = problem((evidence(recorded(), "one", "a"),), spread=0.0)
    moved = p.start.copy()
    moved[0] += 2.0 * p.parameters[0].sd
    assert p.prior(p.start) == pytest.approx(np.zeros(len(p.start)))
    assert p.prior(moved)[0] == pytest.approx(2.0)


def test_the_fit_finds_what_made_the_recording_and_no_step_leads_lower() -> None:
    true = {"EA_N": 1.05 * JOINT.drive.stage[0].EA_N, "mu_output": 0.15, "mu_input": 0.10}
    p = problem((evidence(recorded(with_values(JOINT, true)), "one", "a"),), spread=0.0)
    fit = solve(p, evaluations=20)
    fit = solve(p.with_weighing(weighed(fit, Weighing({ANGLE: SIGMA}, {}))), fit.x, 10)
    sd = np.sqrt(np.diag(covariance(fit)))
    for k, q in enumerate(fit.problem.parameters):
        if q.name in true:
            assert abs(fit.values[q.name] - true[q.name]) < 4.0 * sd[k] * q.slope(float(fit.x[k]))
        for step in (0.3 * sd[k], -0.3 * sd[k]):
            moved = fit.x.copy()
            moved[k] += step
            r = fit.problem.residual(moved)
            assert 0.5 * float(r @ r) >= fit.cost - 0.02 * fit.cost


def test_own_values_apply_to_their_session_alone(three: tuple[Evidence, ...]) -> None:
    p = problem(three)
    place = next(k for k, q in enumerate(p.parameters) if q.name == "mu_output")
    own = own_of(p.parameters[place], p.sessions)
    free = replace(p, parameters=(*p.parameters[:place], *own, *p.parameters[place + 1 :]))
    x = free.start.copy()
    x[place + 1] += 0.3  # session b
    common, moved = free.misfits(free.start)[ANGLE], free.misfits(x)[ANGLE]
    for a, b in zip(common[:2], moved[:2], strict=True):
        np.testing.assert_array_equal(a, b)
    assert np.abs(common[2] - moved[2]).max() > SIGMA


@pytest.mark.parametrize("session", ["run~1", "run@1~2", "~"])
def test_a_sessions_name_may_hold_what_stands_before_a_condition(session: str) -> None:
    """It is a folder's, and a folder may be called anything."""
    e = evidence(recorded(), "one", session)
    mu = next(q for q in problem((e,)).parameters if q.name == "mu_output")
    (own,) = own_of(mu, [session])
    assert (own.base, own.session, own.condition) == ("mu_output", session, None)
    free = replace(problem((e,)), parameters=(own,))
    assert np.isfinite(free.misfits(free.start)[ANGLE]).all()
    assert free.joint(np.log([0.3]), e).drive.stage[0].mu_output == pytest.approx(0.3)


def test_a_gain_by_condition_adds_rate_times_condition(three: tuple[Evidence, ...]) -> None:
    bent = tuple(replace(e, condition={"bend": c}) for e, c in zip(three, (0.0, 1.0, 2.0), strict=True))
    p = problem(bent)
    mu = next(q for q in p.parameters if q.name == "mu_output")
    free = replace(p, parameters=(*p.parameters, by_condition(mu, "bend", 2.0)))
    x = free.start.copy()
    x[-1] = free.parameters[-1].x(0.02)
    stood = [free.joint(x, e).drive.stage[0].mu_output for e in bent]
    base = JOINT.drive.stage[0].mu_output
    assert stood == pytest.approx([base, base + 0.02, base + 0.04])


@pytest.mark.parametrize(
    "p",
    [Parameter("a", 3.0, 0.1, 50.0, True), Parameter("b", 0.2, -1.0, 1.0, False, 0.4)],
    ids=["log", "linear"],
)
def test_coordinates_turn_into_values_and_back(p: Parameter) -> None:
    for value in (p.low, p.start, p.high):
        x = p.x(value)
        assert p.value(x) == pytest.approx(value)
        assert (p.value(x + 1e-6) - p.value(x - 1e-6)) / 2e-6 == pytest.approx(p.slope(x), rel=1e-6)
    assert p.value(p.x(2.0 * p.high)) == pytest.approx(p.high)


def moved(motor: FloatArray, load: FloatArray) -> dict[str, FloatArray]:
    """A course of motor angles and loads, the joint's angle without noise."""
    columns = {"time_s": 0.02 * np.arange(len(load)), "motor_position_rad": motor, "joint_torque_Nm": load}
    return {**columns, "joint_position_rad": Observer(JOINT).run(columns)["joint_position_rad"]}


def held(load: FloatArray) -> dict[str, FloatArray]:
    """A load course with the motor at rest."""
    return moved(np.zeros(len(load)), load)


def test_what_went_before_is_forgotten_once_the_load_has_been_both_ways_as_far_as_ever() -> None:
    """Return-point memory: a swing to both extremes wipes out every smaller one before it, where the motor rests."""
    ramp = np.linspace(0.0, 1.0, 60)
    swing = np.concatenate([2.0 * ramp, 2.0 - 4.0 * ramp, -2.0 + 3.0 * ramp])
    small = np.concatenate([1.0 - 1.6 * ramp, -0.6 + 1.4 * ramp, 0.8 - 1.5 * ramp])
    first, last = (
        evidence(held(np.concatenate(order)), "one", "a")
        for order in ((swing, *[small] * 6), (*[small] * 6, swing))
    )
    p = problem((first, last), joint=UNLIMITED)
    wiped, kept = (forgotten(p, p.start, e, {ANGLE: 1e-6}, 0.1) for e in (first, last))
    assert wiped.left_rad <= 1e-7
    assert 0 < wiped.first < len(first.rows) // 2
    assert kept.left_rad > 1e-6


def test_a_history_that_nobody_recorded_is_estimated_with_the_zeros() -> None:
    """Half of the way to the greatest load and back went before; small swings keep its bump, a constant does
    not hide it."""
    ramp = np.linspace(0.0, 1.0, 60)
    before = np.concatenate([2.0 * ramp, 2.0 - 2.0 * ramp])
    small = np.concatenate([0.8 * ramp, 0.8 - 1.2 * ramp, -0.4 + 1.8 * ramp])
    whole = held(np.concatenate([before, small, 1.4 - 0.8 * ramp]))
    seen = {k: v[len(before) :] for k, v in whole.items()}
    blind = evidence(seen, "one", "a")
    p = problem((blind,), spread=0.0)
    found = forgotten(p, p.start, blind, {ANGLE: SIGMA}, 1e-9)
    told = p.with_evidence([replace(blind, carryover=found.carryover)])
    without, with_ = (float(np.sum(q.residual(q.start) ** 2)) for q in (p, told))
    assert without > 100.0
    assert with_ < 0.1 * without
    np.testing.assert_allclose(
        np.concatenate(told.left(told.start)) / SIGMA, told.residual(told.start)[: len(blind.rows)] / blind.weight,
        atol=1e-6,
    )  # fmt: skip


def test_a_drive_that_was_wound_under_load_is_not_taken_for_a_fresh_one() -> None:
    """The motor wound loaded and came back unloaded before a recording in which it rests: what that left in the
    cable is told by the joint's limits, or by another recording that goes as far; without either nobody could
    know."""
    ramp = np.linspace(0.0, 1.0, 60)
    load = np.concatenate([2.0 * ramp, 2.0 + 0.0 * ramp, 2.0 - 2.0 * ramp])
    motor = np.concatenate([0.0 * ramp, 1.5 * ramp, 1.5 - 1.5 * ramp])
    small = np.concatenate([1.5 * ramp, 1.5 - 2.7 * ramp, -1.2 + 2.4 * ramp])
    whole = moved(np.concatenate([motor, np.zeros_like(small)]), np.concatenate([load, small]))
    blind = evidence({k: v[len(load) :] for k, v in whole.items()}, "one", "a")
    limits = Limits(motor_position_min_rad=-1.5, motor_position_max_rad=1.5, joint_torque_max_Nm=2.0)
    left = []
    for joint in (UNLIMITED, JOINT.model_copy(update={"limits": limits})):
        p = problem((blind,), spread=0.0, joint=joint)
        carryover = forgotten(p, p.start, blind, {ANGLE: SIGMA}, 1e-9).carryover
        told = p.with_evidence([replace(blind, carryover=carryover)])
        left.append(float(np.sum(told.residual(told.start) ** 2)))
    far = evidence(
        moved(np.concatenate([1.5 * ramp, -1.5 * ramp]), np.concatenate([2.0 * ramp, 2.0 * ramp])), "far", "b"
    )
    p = problem((blind, far), spread=0.0, joint=UNLIMITED)
    beside = forgotten(p, p.start, blind, {ANGLE: SIGMA}, 1e-9).carryover
    told = problem((replace(blind, carryover=beside),), spread=0.0, joint=UNLIMITED)
    left.append(float(np.sum(told.residual(told.start) ** 2)))
    unknown, limited, seen = left
    assert limited < 0.1 * unknown
    assert seen < 0.1 * unknown


def test_an_amount_is_begun_where_it_was_seen_however_far_its_bounds(three: tuple[Evidence, ...]) -> None:
    """Viscous slip is known by orders of magnitude: a millionth of its range is far more than what was seen."""
    amount = Parameter("effect.viscous_slip.coefficient_Ns_per_m_rad", 30.0, 0.0, 4e9, False, 2e3)
    p = replace(problem(three), parameters=(*of_drive(JOINT), amount))
    for value in (30.0, 0.3):
        begun = inside(p, np.append(p.start[:-1], amount.x(value)))
        assert amount.value(float(begun[-1])) == pytest.approx(value, rel=1e-9)
        assert np.allclose(begun[:-1], p.start[:-1])


def test_a_point_that_was_just_asked_is_not_run_again(
    three: tuple[Evidence, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    p = problem(three)
    x = p.start.copy()
    first = p.misfits(x)
    ran: list[str] = []
    run = Simulator.run

    def counted(self: Simulator, recording: Evidence, *args: Any) -> object:
        ran.append(recording.name)
        return run(self, recording, *args)

    monkeypatch.setattr(Simulator, "run", counted)
    p.zeros(x), p.left(x), p.aside(x), p.followed(x)
    heavier = p.with_weighing(replace(p.weighing, sigma={ANGLE: 3.0 * SIGMA}))
    assert heavier.misfits(x) is first  # weights are none of its business
    assert not ran
    fewer = p.with_evidence(three[:2])
    fewer.misfits(x)
    assert ran == ["0", "1"]
    x[0] += STEP  # another point, if in the same array
    moved = p.misfits(x)[ANGLE]
    assert ran == ["0", "1", "0", "1", "2"]
    assert not any(np.array_equal(a, b) for a, b in zip(moved, first[ANGLE], strict=True))
    with pytest.raises(ValueError, match="read-only"):
        moved[0] += 1.0  # whoever asks next gets the same


def test_weights_of_another_channel_have_it_asked(three: tuple[Evidence, ...]) -> None:
    torque = "motor_torque_Nm"
    felt = tuple(
        replace(
            e,
            columns={**e.columns, torque: np.zeros_like(e.columns[ANGLE])},
            counted={**e.counted, torque: e.counted[ANGLE]},
        )
        for e in three
    )
    p = problem(felt)
    assert set(p.misfits(p.start)) == {ANGLE}
    both = p.with_weighing(Weighing({ANGLE: SIGMA, torque: 1e-3}, {}))
    assert set(both.misfits(p.start)) == {ANGLE, torque}


def test_what_nothing_shows_stays_as_wide_as_its_bounds_beside_what_is_well_known(
    three: tuple[Evidence, ...],
) -> None:
    """A column of nothing, and two of the same, within bounds that lie 1e5 and 1e6 units apart."""
    free = tuple(
        Parameter(name, 0.0, -w, w, False) for name, w in (("a", 1.0), ("b", 5e5), ("c", 5e4), ("d", 5e4))
    )
    J = np.column_stack((np.full(9, 1e4), np.zeros(9), np.full(9, 0.0), np.full(9, 0.0)))
    J[:5, 2:] = 1.0
    J[:5, 0] = 0.0
    p = Problem(JOINT, free, three, Weighing({ANGLE: SIGMA}, {}))
    sd = np.sqrt(np.diag(covariance(Fit(p, np.zeros(4), np.zeros(9), J))))
    assert sd == pytest.approx([0.5e-4, 1e6, 1e5 / 2**0.5, 1e5 / 2**0.5], rel=1e-3)


def test_what_is_left_is_over_the_time_of_the_rows_that_count(three: tuple[Evidence, ...]) -> None:
    rough = np.where(np.arange(2000) % 2, 1e-3, -1e-3)
    for some in (lambda w: w > 1.2, lambda w: w < 0.8):
        parts = [
            replace(
                e,
                columns={**e.columns, ANGLE: e.columns[ANGLE] + rough[: len(e.columns[ANGLE])]},
                counted={ANGLE: some(e.weight)},
            )
            for e in three
        ]
        p = problem(tuple(parts), spread=1e-2)
        fit = Fit(p, p.start, np.zeros(0), np.zeros((0, len(p.start))))
        assert rms_left(fit) == pytest.approx(1e-3, rel=0.05)
        assert abs(np.log(rms_of_rows(fit) / 1e-3)) > 0.1


def test_misfits_are_those_of_what_was_asked_while_another_thread_asks_for_others(
    three: tuple[Evidence, ...],
) -> None:
    p = problem(three)
    asked = p.misfits(p.start)

    class Meanwhile(tuple[Any, ...]):
        def __getitem__(self, k: Any) -> Any:
            object.__setattr__(p, "_last", (b"elsewhere", {}))
            return super().__getitem__(k)

    object.__setattr__(p, "_last", Meanwhile((p.start.tobytes(), asked)))
    assert p.misfits(p.start) is asked
