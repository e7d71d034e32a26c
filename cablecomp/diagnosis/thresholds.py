"""Every number that steers a verdict, in one frozen place: its unit, the reason for it, and which trials set it.

"Trials" are those of `firmware_sim.trials.make`; seeds named here were used to set numbers and judge nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Thresholds:
    """The verdict's numbers; `LIMITS` are those in force."""

    rows: int = 1200
    """Judged rows of all recordings together while hypotheses are compared: a friction loop is told from another by
    its shape, which some hundred rows a stroke hold; cost is in proportion."""
    rows_each: int = 120
    """Judged rows that a recording has at least, however many recordings there are: six strokes of twenty."""
    searched: int = 9
    """Recordings among which hypotheses are compared, spread over sessions and order; the final model is fitted
    to all."""
    search_weight: float = 0.5
    """Part of what the best model so far leaves that a row counts for while hypotheses are fitted: small, so
    that the priors of the calibration do not stand in the way of a better law."""
    rounds: int = 4
    """Effects and dependences that are added at most; nobody has named five from one body of recordings."""
    zero: float = 0.7
    """How far a recording's zero may depart from its session's while hypotheses are fitted, in what a row
    counts for."""
    promise: float = 0.98
    """Cost after a linear step over the cost before, above which a hypothesis is not tried at all."""
    rough: int = 5
    """Evaluations (residual and derivative) of a first fit from each anchor."""
    promising: int = 6
    """Hypotheses of a round that are fitted to the end, best first (trials seed 101: the true one was among the first
    four of the rough answers wherever it was found at all)."""
    tried_later: int = 7
    """Hypotheses of a later round that are tried, by what they promise."""
    beam: int = 2
    """Models carried from round to round: two kinds of friction may look alike until a third effect is there."""
    worth_rates: float = 1.08
    """Cost before over cost after, by a linear step on thinned rows, from which a law with rates is run on
    every sample."""
    settled: int = 30
    """Evaluations at most of the fit that hypotheses are held against: where it has not come to rest, whatever is added
    beside it seems to help (trials seed 604: a fifth of the cost was left to win in two of ten after six)."""
    tolerance: float = 1e-3
    """Share of the cost that a step has to win while hypotheses are compared, or the fit ends: names differ by
    far more."""
    none: float = 2e-4
    """Share of the largest plausible amount up to which an effect's amount is none, and it is not that effect that
    helps (trials seed 602: a mount that yields one way was answered by a guide without friction)."""
    none_of_least: float = 0.1
    """The same, over the least plausible amount, where amounts are known by orders of magnitude (a share of the
    largest, which lies six decades above the least, took 0.12 of a loop of viscous slip for none)."""
    beyond: tuple[float, ...] = (1.2, 1.5, 2.0)
    """Loads over those seen at which a model still has to be solvable, where any of a round is (a coefficient that
    falls with pressure fitted light loads, and had no solution at the next)."""
    tie: float = 0.01
    """Share of the loss on data left out by which a law with more parameters has to be better than one with fewer."""
    dethrone: float = 0.1
    """Share of what the best model so far takes off, by which one without its effects has to take off more (trials
    seed 604: two right effects took off twice as much as a wrong one; on a jaw friction at both ends took off 2 % more
    than the path's)."""
    hopeless: float = 2.5
    """A hypothesis whose rough fit leaves this many times the cost of the best one's is not fitted to the end."""
    close: float = 2.0
    """The second model is carried on where its loss on data left out is less than this many times the best one's."""
    quiet: float = 1.15
    """Mean square over the sensors' noise at which nothing further is asked: what is left is noise."""
    z_first: float = 1.7
    """Standard errors of the paired held-out difference that the first effect must show to enter the model;
    whether it is named is its confidence's matter (what is missing first leaves few, long waves, whose scatter
    is large)."""
    z_large: float = 1.0
    """The same for a first effect that takes off much: a slow drift is one wave, whose z is small whatever its size."""
    gain_large: float = 0.15
    """That much (trials seeds 602, 603: four of four such effects were right; where nothing was missing none
    took 0.07)."""
    z: float = 2.5
    """The same for every further effect: one in 160 by chance, about twenty asked."""
    gain: float = 0.06
    """Share of the held-out square of what is left that an effect must take off to be looked at as a name:
    below it, laws of another form and calibration trade places."""
    z_sure: float = 5.0
    """Standard errors from which a smaller share is enough: many recordings show a small effect surely."""
    gain_sure: float = 0.03
    """That share."""
    part: float = 0.4
    """Part of its amount with which an effect of the model begins beside one that was found without it."""
    tail: float = 3.0
    """Standard deviations of the remainder beyond which a misfit counts linearly (Huber): outliers decide nothing."""
    memory: float = 2.0
    """Blocks are this many times as long as the remainder remembers, so that blocks are nearly independent."""
    blocks: tuple[int, int] = (12, 60)
    """Fewest and most blocks of all recordings together: fewer have no scatter, more are dependent."""
    resamples: int = 400
    """Draws of blocks for `selected_in` and for the model confidence set."""
    rival: float = 0.10
    """Level of the model confidence set: models that are as good in a tenth of resampled bodies of data stay in."""
    recordings: int = 4
    """Recordings from which whole ones are left out, and from which their zeros can tell a compliance; of fewer,
    blocks are left out."""
    followed: float = 0.9
    """What the final model leaves of a further channel over what the calibrated drive leaves (RMS), below which it
    follows that channel better: a name may rest on this where the joint's angle is predicted no better."""
    final_share: float = 0.15
    """Share of the data that nothing is chosen or fitted on."""
    history: float = 0.15
    """Part of what is usually left over that an unknown history may still move the joint by where rows count."""
    history_most: float = 0.4
    """Share of a recording that may be given up to an unknown history."""
    structured: float = 1.5
    """Mean square of what is left over what repeats or is noise, beyond which it is called structured."""
    beyond_noise: float = 4.0
    """The same where it follows nothing that can be shown (a single recording of few cycles) and physics is
    named: twice the noise is not noise."""
    far_beyond_noise: float = 25.0
    """The same where nothing is named: five times the noise is a mismatch, whether or not it follows anything."""
    recalibrate: float = 0.9
    """What calibration leaves over what the nominal drive leaves (RMS), below which *recalibrate* is said."""
    name: float = 0.5
    """Confidence from which an effect is named; weaker ones are candidates."""


LIMITS: Final = Thresholds()
