"""Predictive scores: leaving out is refitting, better models lead, clearly worse ones leave the confidence set."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from linear_fit import Linear

from cablecomp.diagnosis.explain import scores
from cablecomp.diagnosis.explain.scores import (
    huber,
    left_out,
    left_out_exactly,
    model_confidence_set,
    score_difference,
    selected_in,
)
from cablecomp.diagnosis.folds import Groups
from cablecomp.errors import InputError
from cablecomp.estimation.limits import HOPELESS
from cablecomp.estimation.parameter import Parameter
from cablecomp.signal.smoothing import BoolArray, FloatArray

BLOCKS, ROWS = 30, 20


def groups(folds: int = 6) -> Groups:
    block = np.repeat(np.arange(BLOCKS), ROWS)
    return Groups(block, block % folds, "block", np.zeros_like(block))


def linear(y: FloatArray, A: FloatArray, prior_sd: float) -> Linear:
    """argmin |y - A x|^2 + |x/prior_sd|^2, priors as rows."""
    n = A.shape[1]
    J = np.vstack([-A, np.eye(n) / prior_sd])
    x = np.linalg.lstsq(np.vstack([A, np.eye(n) / prior_sd]), np.concatenate([y, np.zeros(n)]), rcond=None)[0]
    problem = SimpleNamespace(
        bounds=lambda: (np.full(n, -1e3), np.full(n, 1e3)),
        parameters=[Parameter("gain", 0.0, -1e3, 1e3, False, sd=prior_sd) for _ in range(n)],
    )
    return Linear(problem, x, np.concatenate([y - A @ x, x / prior_sd]), J)


def test_leaving_a_fold_out_is_fitting_without_it() -> None:
    rng = np.random.default_rng(1)
    g = groups()
    A = rng.standard_normal((BLOCKS * ROWS, 4))
    y = A @ np.array([1.0, -2.0, 0.5, 0.0]) + rng.standard_normal(len(A))
    found = left_out(linear(y, A, 1.5), g)  # type: ignore[arg-type]  # a stand-in for a fit
    for fold in range(g.folds):
        out = g.fold == fold
        without = linear(y[~out], A[~out], 1.5)
        np.testing.assert_allclose(found[out], y[out] - A[out] @ without.x, atol=1e-6)


@pytest.mark.parametrize(
    ("by", "folds", "parts"), [("recording", 5, 5), ("recording", 12, 9), ("block", 6, 4)]
)
def test_of_a_drive_known_by_order_of_magnitude_recordings_are_left_out_one_by_one(
    monkeypatch: pytest.MonkeyPatch, by: str, folds: int, parts: int
) -> None:
    """The last one, which alone shows its session, stays in; of more than a search looks at, some go together."""
    fold = np.repeat(np.arange(folds + 1), ROWS)
    fold[fold == folds] = -1
    g = Groups(np.arange(len(fold)), fold, by, np.zeros_like(fold))
    left: list[tuple[int, ...]] = []

    def without(problem: object, out: BoolArray) -> list[object]:
        left.append(tuple(np.unique(fold[out]).tolist()))
        return []

    monkeypatch.setattr(scores, "_kept", without)
    monkeypatch.setattr(scores, "fitted_to_part", lambda fit, part, evaluations: fit)
    ones = np.ones(len(fold))
    problem = SimpleNamespace(followed=lambda x: 2.0 * ones)
    fit = SimpleNamespace(residual=ones, problem=problem, x=np.empty(0))
    found = left_out_exactly(fit, g)  # type: ignore[arg-type]  # a stand-in for a fit
    assert len(left) == parts
    assert sorted(f for some in left for f in some) == list(range(folds))
    np.testing.assert_array_equal(found, np.where(fold >= 0, 2.0, 1.0))


@pytest.mark.parametrize("lost", ["the rest", "what is left out"])
def test_what_cannot_be_followed_with_what_the_rest_tells_is_not_predicted(
    monkeypatch: pytest.MonkeyPatch, lost: str
) -> None:
    """Of two parts the drive of the first cannot be run: in the fit of both it may leave as little as it likes."""
    fold = np.repeat([0, 1], ROWS)
    monkeypatch.setattr(scores, "_kept", lambda problem, out: out)

    def again(fit: object, out: BoolArray, evaluations: int) -> SimpleNamespace:
        if out[0] and lost == "the rest":
            raise InputError("a drum runs out of cable")
        return SimpleNamespace(x=out)

    ones = np.ones(len(fold))
    problem = SimpleNamespace(followed=lambda out: None if out[0] else 2.0 * ones)
    monkeypatch.setattr(scores, "fitted_to_part", again)
    fit = SimpleNamespace(residual=ones, problem=problem, x=np.empty(0))
    g = Groups(np.arange(len(fold)), fold, "recording", np.zeros_like(fold))
    found = left_out_exactly(fit, g)  # type: ignore[arg-type]  # a stand-in for a fit
    np.testing.assert_array_equal(found, np.where(fold == 0, HOPELESS, 2.0))


def test_what_only_interpolates_does_not_lead_on_data_left_out() -> None:
    """A free step per block fits every block, and predicts none."""
    rng = np.random.default_rng(2)
    blocks = np.repeat(np.arange(BLOCKS), ROWS)
    g = Groups(blocks, blocks, "block", np.zeros_like(blocks))
    y = rng.standard_normal(BLOCKS * ROWS)
    steps = (g.block[:, None] == np.arange(BLOCKS)).astype(np.float64)
    plain = linear(y, np.ones((len(y), 1)), 1.5)
    fitted = linear(y, np.column_stack([np.ones(len(y)), steps]), 1.0)
    left = left_out(fitted, g), left_out(plain, g)  # type: ignore[arg-type]  # a stand-in for a fit
    step = score_difference(*left, g)
    assert np.mean(fitted.residual[: len(y)] ** 2) < np.mean(plain.residual[: len(y)] ** 2)
    assert step.gain < 0.02


def test_the_better_model_leads_by_what_it_takes_off() -> None:
    rng = np.random.default_rng(3)
    g = groups()
    better = rng.standard_normal(BLOCKS * ROWS)
    worse = better + 0.8 * np.sin(np.arange(len(better)) * 0.37)
    forth, back = score_difference(better, worse, g), score_difference(worse, better, g)
    assert forth.gain == pytest.approx(0.32 / 1.32, abs=0.05)
    assert forth.z > 3.0
    assert back.gain < 0.0
    assert back.z < 0.0
    same = score_difference(better, better, g)
    assert (same.gain, same.z) == (0.0, 0.0)


def test_chance_does_not_lead_far() -> None:
    """Two models that differ by noise of their own: |z| > 3 hardly ever."""
    rng = np.random.default_rng(4)
    g = groups()
    common = rng.standard_normal((200, BLOCKS * ROWS))
    far = sum(
        abs(
            score_difference(
                r + 0.3 * rng.standard_normal(r.size), r + 0.3 * rng.standard_normal(r.size), g
            ).z
        )
        > 3.0
        for r in common
    )
    assert far <= 6


@pytest.mark.parametrize(
    ("gain", "z", "first", "enters"),
    [
        (0.1, 2.6, False, True),
        (0.1, 2.4, False, False),
        (0.39, 2.46, False, True),  # a clearance of a sheath's, beside its friction
        (0.39, 1.6, False, False),
        (0.04, 6.0, False, True),
        (0.2, 1.2, True, True),
        (0.2, 1.2, False, False),
    ],
)
def test_what_takes_off_much_need_not_stand_out_as_far(
    gain: float, z: float, first: bool, enters: bool
) -> None:
    assert scores.demanded(scores.ScoreDifference(gain, z, z), first) is enters


def test_what_an_outlier_adds_grows_no_faster_than_itself() -> None:
    """Huber: ten times as far off counts ten times, not a hundred times."""
    near, far = huber(np.array([50.0, 500.0]))
    assert far / near == pytest.approx(10.0, rel=0.1)
    inside = np.linspace(-2.0, 2.0, 9)
    np.testing.assert_allclose(huber(inside), inside**2)


def test_the_confidence_set_keeps_the_best_and_drops_what_is_clearly_worse() -> None:
    rng = np.random.default_rng(6)
    base = rng.gamma(4.0, 1.0, BLOCKS)
    losses = {
        "best": base,
        "as good": base + 0.05 * rng.standard_normal(BLOCKS),
        "worse": base + 3.0 + rng.standard_normal(BLOCKS),
    }
    kept = model_confidence_set(losses, rng)
    assert "best" in kept
    assert "as good" in kept
    assert "worse" not in kept
    assert model_confidence_set({"alone": base}, rng) == ("alone",)


def test_models_are_chosen_in_shares_that_add_up() -> None:
    rng = np.random.default_rng(7)
    poor = 1.0 + 0.2 * rng.standard_normal(BLOCKS)
    shares = selected_in({"good": 0.2 * rng.standard_normal(BLOCKS), "poor": poor}, rng)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["good"] > 0.99
    assert selected_in({}, rng) == {}


def test_a_channels_unit_decides_nothing() -> None:
    """Each channel has its own yardstick: a torque in N mm differences as far as the same torque in N m."""
    rng = np.random.default_rng(6)
    block = np.tile(np.repeat(np.arange(BLOCKS), ROWS // 2), 2)
    channel = np.repeat(np.arange(2), BLOCKS * ROWS // 2)
    g = Groups(block, block, "block", channel)
    better = rng.standard_normal(block.size)
    worse = better + np.where(channel == 1, 1.0, 0.1) * rng.standard_normal(block.size)
    unit = np.where(channel == 1, 1000.0, 1.0)
    plain, scaled = score_difference(better, worse, g), score_difference(unit * better, unit * worse, g)
    assert scaled.gain == pytest.approx(plain.gain, rel=1e-9)
    assert scaled.z == pytest.approx(plain.z, rel=1e-9)


def test_a_further_channel_that_both_follow_makes_nothing_harder_to_see() -> None:
    rng = np.random.default_rng(8)
    gains = []
    for channels in (1, 2, 4):
        block = np.tile(np.repeat(np.arange(BLOCKS), ROWS // 2), channels)
        channel = np.repeat(np.arange(channels), BLOCKS * ROWS // 2)
        better = rng.standard_normal(block.size)
        worse = better + np.where(channel == 0, 1.2, 0.0) * rng.standard_normal(block.size)
        g = Groups(block, block, "block", channel)
        gains.append(score_difference(better, worse, g).gain)
        assert score_difference(worse, better, g).gain < 0.0
    one, two, four = gains
    added = one / (1.0 - one)  # loss of the worse over that of the better
    assert two == pytest.approx(added / (2.0 + added), rel=0.2)
    assert four == pytest.approx(two, rel=0.15)
