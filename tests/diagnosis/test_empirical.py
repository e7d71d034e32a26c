"""Laws without a name: what the diagnosis counts is what the observer runs, and a series fitted again finds
what is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cablecomp.config import Empirical
from cablecomp.diagnosis.describe.empirical import _curve, _own_curve, _Rows, _wave, refitted, value_of
from cablecomp.diagnosis.folds import Groups
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.simulate import simulator
from cablecomp.signal.smoothing import FloatArray
from tests.diagnosis.test_diagnose import joint, recording

LAW = Empirical(
    id="ripple_by_motor_angle", law="chebyshev", of="motor_position_rad", centre=0.2, half_width=1.4,
    coefficients_rad=(0.0, 1e-3, -2e-3, 5e-4, 0.0, 3e-4, 0.0, 0.0, 0.0, 0.0, 1e-4),
)  # fmt: skip


def evidence() -> Evidence:
    return gather(joint(), "small/1", recording([]), "small", fine_rows=2000, judged_rows=400)


def test_what_is_counted_for_a_law_is_what_the_observer_adds() -> None:
    here = evidence()
    plain = joint()
    with_law = plain.model_copy(update={"empirical": (LAW,)})
    kept = here.counted[JOINT]
    added = simulator(with_law).predict(here)[JOINT][kept] - simulator(plain).predict(here)[JOINT][kept]
    np.testing.assert_allclose(value_of(LAW, here)[kept], added, atol=1e-12)


@pytest.mark.parametrize(("by_level", "kept"), [(False, True), (True, False)])
def test_a_law_by_load_has_to_hold_where_recordings_reach_further(by_level: bool, kept: bool) -> None:
    """Recordings at four levels of load: a ripple that is the same curve at every level is a law; one that turns over
    at the greatest level, as another law's remainder does, is none, though it helps with recordings left out."""
    parts = []
    left = []
    for k, level in enumerate((0.4, 0.4, 0.4, 0.6, 0.6, 0.6, 0.8, 0.8, 0.8, 1.0, 1.0)):
        one = gather(joint(), f"small/{k}", scaled(level, k), "small", fine_rows=600, judged_rows=200)
        load = one.at_rows("joint_torque_Nm")[one.counted[JOINT]]
        turned = -0.3 if by_level and level == 1.0 else 1.0
        parts.append(one)
        left.append(
            turned * 1e-3 * np.sin(4.0 * load) + 1e-4 * np.random.default_rng(k).standard_normal(len(load))
        )
    owner = np.repeat(np.arange(len(left)), [len(v) for v in left])
    groups = Groups(owner, owner, "recording", np.zeros_like(owner))
    rows = _Rows(parts, np.concatenate(left), np.ones(len(owner)), groups)
    assert (_curve("joint_torque_Nm", rows) is not None) is kept


@pytest.mark.parametrize(("turned", "own"), [(-1.0, True), (0.0, True), (1.0, False)])
def test_a_ripple_of_each_sessions_own_is_told_from_one_that_they_share(turned: float, own: bool) -> None:
    """Six recordings of each of two sessions; in the second one the ripple is turned over, none, the same."""
    rows, left = of_two_sessions(turned=turned)
    shared = _curve("motor_position_rad", rows)
    held = _own_curve(rows if shared is None else replace(rows, left=rows.left - shared.predicted))
    assert (held is not None) is own
    assert (shared is not None) is (not own)
    if held is None:
        return
    assert [law.session for law in held.found.laws] == (["monday", "tuesday"] if turned else ["monday"])
    laws = [*(shared.found.laws if shared else ()), *held.found.laws]
    here = rows.evidence[0]
    added = sum(value_of(law, here) for law in laws)[here.counted[JOINT]]
    there = 1e-3 * np.sin(4.0 * here.at_rows("motor_position_rad")[here.counted[JOINT]])
    assert np.std(added - there) < 0.15 * np.std(there)
    again = refitted(held.found.laws, rows.evidence[:6], left[:6])
    assert [any(law.coefficients_rad) for law in again] == [law.session == "monday" for law in again]


@pytest.mark.parametrize("elsewhere_rad", [3.0, 40.0])
def test_a_motor_that_counts_from_elsewhere_has_a_ripple_of_its_sessions_own(elsewhere_rad: float) -> None:
    """As fine as where both count alike: a series over both places at once would be the coarser, the further apart."""
    rows, left = of_two_sessions(turned=-1.0, elsewhere_rad=elsewhere_rad)
    held = _own_curve(rows)
    assert held is not None
    for e, ripple in zip(rows.evidence, left, strict=True):
        added = sum(value_of(law, e) for law in held.found.laws)[e.counted[JOINT]]
        assert np.var(added - ripple) - NOISE_RAD**2 < (0.15 * np.std(ripple)) ** 2


@pytest.mark.parametrize("turned", [-1.0, 0.0])
def test_sessions_of_unlike_strokes_have_ripples_of_their_own(turned: float) -> None:
    """One session says nothing of the other's: how far recordings reach is compared within each."""
    rows, _ = of_two_sessions(turned=turned, stroke=0.5)
    held = _own_curve(rows)
    assert held is not None
    assert [law.session for law in held.found.laws] == (["monday", "tuesday"] if turned else ["monday"])


NOISE_RAD = 1e-4


def of_two_sessions(
    *, turned: float, elsewhere_rad: float = 0.0, stroke: float = 1.0
) -> tuple[_Rows, list[FloatArray]]:
    """Six recordings of each of two sessions with a ripple by motor angle, in the second one so many times as large,
    where the motor counts from elsewhere and goes a part of the way; and what is left of each [rad]."""
    parts, left = [], []
    for k in range(12):
        session = "monday" if k < 6 else "tuesday"
        one = gather(joint(), f"{session}/{k}", recording([], k), session, fine_rows=600, judged_rows=200)
        if k >= 6:
            motor = elsewhere_rad + stroke * one.columns["motor_position_rad"]
            one = replace(one, columns={**one.columns, "motor_position_rad": motor})
        angle = one.at_rows("motor_position_rad")[one.counted[JOINT]]
        noise = NOISE_RAD * np.random.default_rng(k).standard_normal(len(angle))
        parts.append(one)
        left.append((1.0 if k < 6 else turned) * 1e-3 * np.sin(4.0 * angle) + noise)
    owner = np.repeat(np.arange(len(left)), [len(v) for v in left])
    groups = Groups(owner, owner, "recording", np.zeros_like(owner))
    return _Rows(parts, np.concatenate(left), np.ones(len(owner)), groups), left


def test_a_session_of_which_nothing_else_tells_has_no_ripple_of_its_own() -> None:
    """One recording: left out, all of its session is."""
    rows, _ = of_two_sessions(turned=1.0)
    first = rows.at(rows.groups.fold < 7, rows.evidence[:7])
    held = _own_curve(first)
    assert held is not None
    assert [law.session for law in held.found.laws] == ["monday"]


def scaled(level: float, seed: int) -> dict[str, FloatArray]:
    """A recording whose load goes this far."""
    columns = recording([], seed)
    return {**columns, "joint_torque_Nm": level * columns["joint_torque_Nm"]}


def test_a_series_fitted_again_finds_the_curve_that_is_there() -> None:
    here = evidence()
    there = value_of(LAW, here)[here.counted[JOINT]]
    blank = LAW.model_copy(update={"coefficients_rad": (0.0,) * 11})
    (again,) = refitted([blank], [here], [there])
    assert np.std(value_of(again, here)[here.counted[JOINT]] - there) < 0.05 * np.std(there)
    half = replace(here, counted={JOINT: here.counted[JOINT] & (np.arange(len(here.rows)) % 2 == 0)})
    (unseen,) = refitted([blank], [half], [value_of(LAW, half)[half.counted[JOINT]]])
    assert np.std(value_of(unseen, here)[here.counted[JOINT]] - there) < 0.05 * np.std(there)


WAVE = Empirical(
    id="wave_by_motor_angle", law="fourier", of="motor_position_rad", half_width=np.pi / 16.0,
    coefficients_rad=(0.0, 1.6e-4, -1.2e-4),
)  # fmt: skip


def test_what_is_counted_for_a_wave_is_what_the_observer_adds() -> None:
    here, plain = evidence(), joint()
    kept = here.counted[JOINT]
    waving = simulator(plain.model_copy(update={"empirical": (WAVE,)})).predict(here)[JOINT][kept]
    added = waving - simulator(plain).predict(here)[JOINT][kept]
    angle = here.at_rows("motor_position_rad")[kept]
    np.testing.assert_allclose(
        added, 1.6e-4 * np.sin(16.0 * angle) - 1.2e-4 * np.cos(16.0 * angle), atol=1e-12
    )
    np.testing.assert_allclose(value_of(WAVE, here)[kept], added, atol=1e-12)


@pytest.mark.parametrize(("amplitude_rad", "found"), [(2e-4, True), (0.0, False)])
def test_sixteen_teeth_a_turn_are_found_beside_noise_and_none_in_noise(
    amplitude_rad: float, found: bool
) -> None:
    here = evidence()
    angle = here.at_rows("motor_position_rad")[here.counted[JOINT]]
    noise = 1e-4 * np.random.default_rng(3).standard_normal(len(angle))
    block = np.arange(len(angle)) * 24 // len(angle)
    groups = Groups(block, block % 6, "block", np.zeros_like(block))
    left = amplitude_rad * np.sin(16.0 * angle + 0.4) + noise
    held = _wave(_Rows([here], left, np.ones(len(angle)), groups))
    assert (held is not None) is found
    if held is not None:
        law = held.found.law
        assert np.pi / law.half_width == pytest.approx(16.0, abs=0.05)
        assert np.hypot(*law.coefficients_rad[1:]) == pytest.approx(amplitude_rad, rel=0.15)


def test_a_wave_fitted_to_other_data_has_the_frequency_that_these_have() -> None:
    """As the errors on data left out ask: a frequency from the data that judge it would be told them."""
    here = evidence()
    x = here.at_rows(WAVE.of)[here.counted[JOINT]]
    elsewhere = 1.09 * np.pi / WAVE.half_width
    there = 1e-3 * np.sin(elsewhere * x + 0.4)
    (again,) = refitted([WAVE], [here], [there])
    assert np.pi / again.half_width == pytest.approx(elsewhere, rel=5e-3)
    assert np.std(value_of(again, here)[here.counted[JOINT]] - there) < 0.05 * np.std(there)
