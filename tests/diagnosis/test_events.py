"""What an event has to show for its name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cablecomp.diagnosis.explain.events import untold
from cablecomp.diagnosis.explain.hypotheses import Hypothesis
from cablecomp.effects.catalogue import catalogue
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import DECADE, Parameter

SLIP_M = 1e-4
REACH_S = 6.0


def fitted(parameters: tuple[Parameter, ...], J: Any) -> Any:
    """A fit of a recording of 60 s: these parameters, a step of each over its scale, the derivative by it."""
    low, high = (
        np.array([-1e4, *(p.low for p in parameters[1:])]),
        np.array([1e4, *(p.high for p in parameters[1:])]),
    )
    problem: Any = SimpleNamespace(
        config=SimpleNamespace(effect=()),
        parameters=parameters,
        bounds=lambda: (low, high),
        values=lambda x: {p.name: p.value(v) for p, v in zip(parameters, x, strict=True)},
        evidence=[SimpleNamespace(columns={"time_s": np.array([0.0, 60.0])})],
    )
    return Fit(problem, np.array([1.0, *(p.start for p in parameters[1:])]), np.zeros(0), J)


def slip(size_sd: float, instant_sd: float) -> tuple[Any, Hypothesis]:
    """A fit that holds a slip of 0.1 mm, with these deviations (by the likelihood) of its size, in units of it, and of
    its instant [s]; and the hypothesis."""
    size = Parameter("effect.clamp_slip.slip_m", 0.0, -1.0, 1.0, False, SLIP_M)
    when = Parameter("effect.clamp_slip.time_s", 40.0, 40.0 - REACH_S / 2, 40.0 + REACH_S / 2, False)
    fit = fitted((size, when), np.diag([1.0 / size_sd, 1.0 / instant_sd if instant_sd < REACH_S else 0.0]))
    effect = catalogue()["clamp_slip"]
    term = Hypothesis(effect, effect.id, effect.parameter("slip_m"), (), two_sided=True)
    return fit, term


@pytest.mark.parametrize(
    ("size_sd", "instant_sd", "removes", "said"),
    [
        (0.05, 0.1, 0.1, ""),
        (0.2, 0.1, 0.9, "its size is 3.1 of its own deviations"),  # stated 1.6 times as wide
        (0.05, REACH_S, 0.1, "do not tell when it happened, and it takes off 10% alone"),
        (0.05, REACH_S, 0.9, ""),
    ],
)
def test_an_event_shows_its_size_and_its_place(
    size_sd: float, instant_sd: float, removes: float, said: str
) -> None:
    fit, term = slip(size_sd, instant_sd)
    reason = untold(fit, term, removes)
    assert said in reason
    assert bool(said) == bool(reason)


def test_a_size_that_trades_places_with_a_vague_drive_is_not_held_against_it() -> None:
    fit, term = slip(0.5, REACH_S)
    assert untold(fit, term, 0.0)
    own = Parameter("mu_output", 0.1, 1e-3, 10.0, True, centre=0.1, sd=DECADE)
    shape = replace(own, name="effect.thermal_pretension.lag_s")
    for beside, said in ((own, False), (shape, True)):
        J = np.pad(fit.J, ((0, 1), (0, 1)), constant_values=0.0) + np.diag([0, 0, 9.0])
        also = fitted((*fit.problem.parameters, beside), J)
        assert bool(untold(also, term, 0.0)) is said


@pytest.mark.parametrize("lasts_s", [15.0, 45.0])
def test_a_slip_that_still_goes_on_is_judged_by_how_fast_it_goes(lasts_s: float) -> None:
    """Begun at 40 s, of a recording of 60 s: what shows of one that lasts for 45 s is its rate, size over duration."""
    (size, when), term = slip(0.05, 0.1)[0].problem.parameters, slip(0.05, 0.1)[1]
    lasts = Parameter("effect.clamp_slip.duration_s", lasts_s, 0.0, 3600.0, False, 50.0)
    rate = np.array([[20.0, 0.0, -20.0 / lasts_s * 50.0], [0.0, 10.0, 0.0]])
    fit = replace(fitted((size, when, lasts), rate), x=np.array([1.0, 40.0, lasts_s / 50.0]))
    assert bool(untold(fit, term, 0.1)) is (lasts_s < 20.0)


def test_a_share_that_trades_with_a_slips_size_is_not_held_against_it() -> None:
    """The joint moves by s (1 + k)/2R: what of s the other cable takes up, k, is told by the tensions alone."""
    (size, when), term = slip(0.05, 0.1)[0].problem.parameters, slip(0.05, 0.1)[1]
    share = Parameter("effect.clamp_slip.taken_up", 0.5, 0.0, 1.0, False)
    told = np.array([[20.0, 0.0, 13.0], [0.0, 10.0, 0.0], [1.0, 0.0, 0.0]])
    fit = replace(fitted((size, when, share), told), x=np.array([1.0, 40.0, 0.5]))
    assert untold(fit, term, 0.1) == ""
    other = replace(share, name="effect.strand_break.fraction")
    trades = replace(fitted((size, when, other), told), x=fit.x)
    assert "of its own deviations" in untold(trades, term, 0.1)
    assert "of its own deviations" in untold(trades, term, 0.1, 4.9)
    assert (
        untold(trades, term, 0.1, 5.0) == ""
    )  # ahead of none and of every rival, whatever its size trades with


def test_what_is_no_event_has_nothing_to_place() -> None:
    fit, _ = slip(0.5, REACH_S)
    effect = catalogue()["thermal_pretension"]
    assert untold(fit, Hypothesis(effect, effect.id, effect.parameters[0], (), two_sided=True), 0.0) == ""
