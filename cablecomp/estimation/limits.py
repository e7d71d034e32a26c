"""Numbers that bound a fit, whatever it is for: each with its unit and the reason for it.

What decides a verdict stands in `diagnosis/thresholds.py`.
"""

from __future__ import annotations

from typing import Final

DECADES: Final = 2.3
"""Decades either way that a quantity known by order of magnitude may go: two on either side hold what labs call
that."""
OWN_SD: Final = 1.0
"""Prior sd of a session's own value about the common one, in units of the common one's own prior."""
STEP: Final = 1e-3
"""Step of the difference quotients in x: large against round-off and the kinks of friction, small against what
matters."""
INSTANT_STEP_S: Final = 0.05
"""Step of the difference quotient by an event's instant: it has to move over rows that are thinned by travel."""
INSTANT_REACH_S: Final = 3.0
"""How far an event's instant may move from where it was found by asking."""
ZERO: Final = 0.1
"""How far recordings' zeros may depart from their session's, in what a model leaves (RMS): more takes up what
compliances do (with half of it zeros of a jaw's recordings followed the load by 0.7 degrees)."""
ZERO_FAINT: Final = 0.1
"""The same at least, in a reading's noise."""
TELLING: Final = 4
"""Recordings, beyond sessions and coefficients by load, from which their zeros tell what follows the load and what was
set anew."""
MOVED: Final = 4.0
"""Standard deviations (scaled median) beyond which a recording's zero was set anew."""
FAR: Final = 6.0
"""How far the zero of one of few recordings has to lie from the others', in what is left within them (RMS), to have
been set anew: a step within a recording, or what goes on through it, leaves as much within as it moves the zero."""
OF_HISTORY: Final = 3.0
"""The same, in what an unknown history moves zeros by."""
MOVED_SD: Final = 30.0
"""Prior sd of such a zero, in that of the others; of few recordings in what a row counts for, if that is more."""
CARRYOVER_SD: Final = 1.0
"""Prior sd of a recording's carry-over, in what the assumed histories add in the mean (RMS)."""
HISTORY_CUTS: Final = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2)
"""Shares of a recording that may be given up to an unknown history: what lasts longer is estimated."""
HISTORY_PARTS: Final = (1.0, 2.0 / 3.0, 1.0 / 3.0)
"""Of its reach, how far a drive went in an assumed history."""
HISTORY_LEG: Final = 12
"""Rows of one leg of an assumed history."""
DETOUR_PARTS: Final = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Of what a gap leaves time for, how far load or motor went in an assumed detour."""
DETOUR_BEYOND: Final = 0.15
"""Share of its range by which a channel may have gone beyond it in a gap."""
DETOUR_LEAST: Final = 0.05
"""Share of its range below which a channel's detour is not looked at."""
DETOUR_LEG: Final = 6
"""Rows of one leg of an assumed detour."""
GAPS_MOST: Final = 12
"""Gaps of a recording that are looked at, the longest."""
GAP_STEP: Final = 10.0
"""Usual steps of the misfit from row to row that one counts for at most where gaps are told."""
GAP_FAINT: Final = 0.1
"""The same, below which a detour is not worth a column there."""
GAP_LEAST: Final = 12.0
"""Squares of usual steps by which a gap's detours have to lower the misfit's to be looked at, ..."""
GAP_EACH: Final = 3.0
"""... and those for each column that they bring: some times what chance gives one."""
HISTORY_FAINT: Final = 0.02
"""Share of what is usually left over below which a carry-over is not worth a column."""
EXACT: Final = 0.003
"""Relative 1-sigma of a radius that is stated without a tolerance: what drawings and calipers leave. Without
it, calibration would answer a slightly wrong ratio by physics."""
BY_TAPE: Final = 0.02
"""Relative 1-sigma of a free length that is stated without a tolerance, where physics that is missing is looked for:
where a cable leaves its drums and how much its ends yield is on no drawing. Without it, a slightly wrong length is
answered by a coupling that yields or by friction (blind trials draw 1.5 %)."""
ZERO_OF_TORQUE: Final = 0.005
"""1-sigma of a torque sensor's zero that `[session] own` names without a tolerance, over the largest torque it reads:
what mounting and warming up leave (blind trials draw 0.4 %)."""
GAIN_OF_TORQUE: Final = 0.02
"""Relative 1-sigma of a joint's torque sensor against what else reads force (the motor's torque, tensions), where no
tolerance is stated: what calibrating two sensors apart leaves (blind trials draw 1 %). Without it, a percent of the
load that the motor's torque does not show is answered by friction of the motor, or by a weight."""
HOPELESS: Final = 30.0
"""Weighted residual of a trial that the drive cannot follow: far worse than any real one."""
AVERAGED_MOST: Final = 12
"""Fine rows on either side that a judged row's readings are averaged over, at most: in a hold, where rows are far
apart, a drift is not straight for ever."""
AVERAGED_AGREE: Final = 2.0
"""Deviations about each of ever wider means within which all of them have to agree: at 1.5 chance alone parts so many
that what is left is 12 % noisier than its number says."""
