"""A check before belief, of sensors by themselves: one that stands still while the other goes on, one that is clipped,
an angle that begins anew at each turn, a load that was never read, rows that were made up between readings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf
from typing import Final

import numpy as np

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import INPUT, JOINT, MOTOR
from cablecomp.estimation.view import Suspicion, View
from cablecomp.recording.inspection import (
    NOISE_ROWS,
    clipped_share,
    clipped_words,
    runs,
    stuck_words,
    turns_words,
    whole_turns,
)
from cablecomp.signal.noise import channel_noise
from cablecomp.signal.smoothing import FloatArray

FEWEST_ROWS: Final = 5
"""Rows without any change from which on a rest is looked at."""
FEWEST_BENDS: Final = 50
"""Bends from which on it is looked at how far apart they are."""
BENT: Final = 20.0
"""Times what the load bends the nominal drive that the other end has to go on by while a sensor rests: friction, slack
and compliances beside it make a few."""
OF_RANGE: Final = 0.2
"""Share of the joint's range that the other end has to go on by as well."""
JUMP: Final = 3.0
"""Quick steps (1 % are quicker) from which on a sensor comes back with a jump, as no joint that was held does."""
NOISY: Final = 1e-5
"""Share of its range from which on a channel's noise is a sensor's, and none of arithmetic."""
LONGER: Final = 3.0
"""Times as long as anywhere else that a clipped channel rests on its extreme value."""
OFTEN: Final = 0.03
"""Least share of the rows that a channel bends in where it bends at readings: corners of a course are few."""
BENDS: Final = 0.1
"""Share of what it bends by in so many rows, those that it bends most in, from which on it bends."""
AT_READINGS: Final = 0.9
"""Share of the stretches between bends that are as many rows long as one between readings, or several of these."""
SWINGS: Final = 0.5
"""Share of the motor torque's variance that neither friction nor a weight explains, from which on there was a load."""
FORCES: Final = ("joint_torque_Nm", MOTOR, "tension_h_N", "tension_l_N")
"""Channels that are clipped where they rest on an extreme value; a joint has stops."""


def odd_sensors(view: View, columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    """What sensors show by themselves: nothing of rests, of a locked input, of a joint that is free."""
    yield from _stuck(view, JOINT, view.y, view.ratio * view.q, "motor")
    yield from _stuck(view, INPUT, view.ratio * view.q, view.y, "joint")
    yield from _wrapped(columns)
    yield from _clipped(columns)
    yield from _unread(view, columns)
    yield from _made_up(columns)


def _stuck(view: View, name: str, values: FloatArray, other: FloatArray, end: str) -> Iterator[Suspicion]:
    """The longest rest of an encoder in which the other end goes on (both as angles of the joint) by more than friction
    and load make, and after which it jumps, or comes not back; whatever the load makes, where it jumps by as much of
    the joint's range as the other end has to go on by."""
    steps = np.abs(np.diff(values))
    last = view.config.drive.stage[-1]
    load_Nm = float(np.ptp(view.M)) if view.channel else last.output_radius_m * last.pretension_N
    least = OF_RANGE * float(np.ptp(view.y))
    bent = max(BENT * view.compliance * load_Nm, least)
    quick = float(np.percentile(steps, 99.0))
    found = (0.0, 0.0)
    for begin, stop in runs(steps == 0.0):
        if stop - begin < FEWEST_ROWS:
            continue
        moved = float(np.ptp(other[begin : stop + 1]))
        jump = float(steps[stop]) if stop < len(steps) else inf
        if moved > (least if least < jump < inf else bent) and jump > JUMP * quick:
            found = max(found, (float(view.time[stop] - view.time[begin]), moved))
    if found[0] > 0.0:
        rests_s, moved = found
        words = f"{name} {stuck_words(rests_s, end)} The other end goes {moved:.3g} rad of the joint's angle meanwhile"
        yield Suspicion("stuck", name, words, {"rests_s": rests_s, "moved_rad": moved})


def _wrapped(columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    """Angles that jump by whole turns, as of an encoder that counts within one."""
    for name in (INPUT, JOINT):
        kept = np.isfinite(columns[name])
        at = whole_turns(columns[name][kept])
        if len(at):
            first_s = float(columns["time_s"][kept][at[0] + 1])
            words = f"{name} {turns_words(len(at))} First at {first_s:.6g} s; write it on without jumps (numpy.unwrap)"
            yield Suspicion("wrapped", name, words, {"jumps": float(len(at)), "first_s": first_s})


def _clipped(columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    """Forces whose noise stops at their greatest or least value, and there alone: what is coarse, or commanded, rests
    elsewhere too."""
    for name in (name for name in FORCES if name in columns):
        values = columns[name]
        known = values[np.isfinite(values)]
        try:
            noise = channel_noise(columns["time_s"][:NOISE_ROWS], values[:NOISE_ROWS])
        except InputError:  # too few readings to tell
            continue
        reach = float(np.ptp(known))
        share = clipped_share(known, noise.resolution)
        noisy = noise.white > max(0.5 * noise.resolution, NOISY * reach)
        if share > 0.0 and noisy and _rests_there_alone(known):
            words = f"{name} is {clipped_words(share)}, at {known.min():.4g} or {known.max():.4g}"
            yield Suspicion("clipped", name, words, {"share": share})


def _rests_there_alone(values: FloatArray) -> bool:
    """Whether the longest run of one and the same value is at the greatest or the least, far longer than elsewhere."""
    longest, ends = {True: 0, False: 0}, (values.min(), values.max())
    for begin, stop in runs(np.diff(values) == 0.0):
        extreme = bool(values[begin] in ends)
        longest[extreme] = max(longest[extreme], stop - begin)
    return longest[True] > LONGER * longest[False]


def _unread(view: View, columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    """A load that is 0 in every row, where the motor's torque swings by more than friction and a weight make."""
    if view.channel != "joint_torque_Nm" or np.any(view.M != 0.0) or MOTOR not in columns:
        return
    torque = columns[MOTOR]
    kept = np.isfinite(torque) & np.isfinite(columns[INPUT])
    torque, q = torque[kept], columns[INPUT][kept]
    if len(torque) < FEWEST_ROWS or not np.ptp(torque) > 0.0:
        return
    v = np.gradient(q)
    known = np.column_stack((np.ones_like(q), np.sign(v), v, q, q**2))
    left = float(np.var(torque - known @ np.linalg.lstsq(known, torque, rcond=None)[0]) / np.var(torque))
    if left > SWINGS:
        words = (
            f"{view.channel} is 0 in every row while {MOTOR} swings by {np.ptp(torque):.3g} Nm, by more than friction "
            "and a weight make: was the load read? Without a sensor of it leave the channel out"
        )
        yield Suspicion("unread", view.channel, words, {"left": left})


def _made_up(columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    """A joint's angle that bends in every n-th row alone: a log that was brought to a higher rate by straight lines,
    which hold no noise of their own."""
    bent = np.abs(np.diff(columns[JOINT][np.isfinite(columns[JOINT])], 2))
    usual = float(np.quantile(bent, 1.0 - OFTEN)) if OFTEN * len(bent) > FEWEST_BENDS else 0.0
    if not usual > 0.0:
        return
    bends = np.flatnonzero(bent > BENDS * usual)
    apart = np.diff(bends)
    every = int(np.argmax(np.bincount(apart)))
    if every > 2 and float(np.mean(apart % every == 0)) > AT_READINGS:
        words = (
            f"{JOINT} bends in one row of {every} alone and is straight between: made up from fewer readings, it seems "
            "less noisy than these are, and what is left of it more than noise; give the log at the rate it was read at"
        )
        yield Suspicion("made up", JOINT, words, {"every": float(every)})
