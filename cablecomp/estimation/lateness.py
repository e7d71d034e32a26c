"""Whether a channel of a recording comes late: by a time, as a delay does, or by an angle, as lost motion does.

The nominal drive, which knows its own hysteresis, is run with each channel shifted. Lost motion trails by an angle,
whatever the speed; a delay by a time. So both may explain what is left: a delay is said only for what it takes beyond
lost motion of any width, and both are where all moves at one speed.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Final

import numpy as np

from cablecomp.errors import CablecompError
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.view import INPUT, Suspicion, View, bare, mrad, rms
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

LATE_GAIN: Final = 0.75
"""A delay is believed where it takes what nothing else follows down to this share."""
LATE_OR_LOST_GAIN: Final = 0.5
"""The same, where all moves at one speed."""
MOST_LATE_S: Final = 0.25
"""Greatest delay that is looked for."""
DELAY_ROWS: Final = 1500
"""Rows on which delays are looked for."""
LOST: Final = np.array((0.004, 0.008, 0.016, 0.032, 0.064, 0.128, 0.256))
"""Half widths of lost motion, as shares of a channel's range, that are tried in a delay's place."""
OF_SPEED: Final = 0.3
"""Share of what a shift changes that no loop of a width of its own, whatever the speed, follows: from there on the
speeds tell a delay from lost motion. Two that are as 1 to 2 leave 0.32."""


def delays(view: View) -> list[Suspicion]:
    """Whether the load, or the joint angle, comes late or early: the likelier one of them, if any."""
    found = []
    wanted = [JOINT, *([view.channel] if view.channel and np.ptp(view.M) > 0.0 else [])]
    step = float(np.median(np.diff(view.time)))
    for name in wanted:
        late, before, after = _best_shift(view, name)
        if abs(late) < 1.5 * step or not after < LATE_GAIN * before < inf:
            continue
        of_speed = _of_speed(view, name, late)
        if of_speed > OF_SPEED or after < LATE_OR_LOST_GAIN * before:
            how = "late" if late > 0.0 else "early"
            both = (
                "" if of_speed > OF_SPEED else ", or to trail by lost motion (at one speed they look alike)"
            )
            words = (
                f"{name} seems to come {1e3 * abs(late):.3g} ms {how}{both}: the "
                f"nominal drive leaves {mrad(before)} RMS, "
                f"{mrad(after)} with it shifted"
            )
            numbers = {"late_s": late, "rms_rad": before, "left_rad": after, "of_speed": of_speed}
            found.append(Suspicion("delay", name, words, numbers))
    at_rest = view.ratio * np.ptp(view.q) < 0.1 * np.ptp(view.y)
    if at_rest and any(
        s.numbers["late_s"] > 0.0 for s in found
    ):  # an early joint is a late load, and what is late
        found = [s for s in found if s.numbers["late_s"] > 0.0]  # is the usual one
    return sorted(found, key=lambda s: s.numbers["left_rad"])[:1]


def in_doubt(view: View, fits: list[Suspicion]) -> list[Suspicion]:
    """The same, where the load follows from the motor's way and its direction with a word on what else trails so:
    lost motion, or an angle that is late, is then seen as a compliance."""
    if not (np.ptp(view.q) > 0.0 and np.ptp(view.M) > 0.0):
        return fits
    some = _some(view)
    q, M = view.q[some], view.M[some]
    later = slice(len(q) // 4, None)
    own = rms(_beyond(np.column_stack((np.ones_like(q), q, _trailing(q))), M)) / max(rms(M[later]), 1e-300)
    word = (
        "; or an angle comes late, or trails by lost motion (the load follows the motor, so they look alike)"
    )
    return [
        replace(f, text=f.text + word) if own < OF_SPEED and f.channel == view.channel else f for f in fits
    ]


def _some(view: View) -> slice:
    """The rows on which delays are looked for."""
    return slice(None, None, max(1, len(view.time) // DELAY_ROWS))


def _best_shift(view: View, name: str) -> tuple[float, float, float]:
    """(how late, s; RMS as it is; RMS shifted)."""
    most = min(MOST_LATE_S, 0.02 * float(view.time[-1] - view.time[0]))
    left: dict[float, float] = {}

    def at(shift: float) -> float:
        if shift not in left:
            left[shift] = _left_shifted(view, name, shift)
        return left[shift]

    best, width = 0.0, 0.5 * most
    while width > 0.005 * most:  # the least of three, closer and closer
        best = min((best - width, best, best + width), key=at)
        width *= 0.5
    return best, at(0.0), at(best)


def _left_shifted(view: View, name: str, shift_s: float) -> float:
    some = _some(view)
    time, y, M = view.time[some], view.y[some], view.M[some]
    if name == JOINT:
        y = np.interp(time + shift_s, view.time, view.y)
    else:
        M = np.interp(time + shift_s, view.time, view.M)
    try:
        followers = _followers(view, time, view.q[some], M)
    except CablecompError:  # such a load the nominal drive cannot bear
        return inf
    return rms(_beyond(followers, y))


def _followers(view: View, time: FloatArray, q: FloatArray, M: FloatArray) -> FloatArray:
    """What follows angle and load whatever the speed, a column each: straight lines, the nominal drive, lost
    motion of several widths."""
    columns = {"time_s": time, INPUT: q, "joint_torque_Nm": M}
    bent = Observer(bare(view.config)).run(columns)["deflection_rad"]
    lost = [_trailing(x) for x in (q, M) if np.ptp(x) > 0.0]
    return np.column_stack((np.ones_like(q), q - q.mean(), M - M.mean(), bent, *lost))


def _of_speed(view: View, name: str, shift_s: float) -> float:
    """Share of what that shift changes in a channel that nothing follows which knows no speed, 0 to 1."""
    some = _some(view)
    time, q, M = view.time[some], view.q[some], view.M[some]
    followers = _followers(view, time, q, M)
    whole = view.ratio * view.q + np.interp(view.time, time, followers[:, 3]) if name == JOINT else view.M
    ahead, behind = (np.interp(time + k * shift_s, view.time, whole) for k in (0.5, -0.5))
    changed = ahead - behind
    return rms(_beyond(followers, changed)) / max(rms(changed[len(time) // 4 :]), 1e-300)


def _beyond(A: FloatArray, y: FloatArray) -> FloatArray:
    """What no sum of A's columns makes of y, the first quarter left out: what went before it is not known."""
    A, y = A[len(y) // 4 :], y[len(y) // 4 :]
    return np.asarray(y - A @ np.linalg.lstsq(A, y, rcond=None)[0])


def _trailing(x: FloatArray) -> FloatArray:
    """x behind lost motion of several widths (play operators), one column each."""
    half = LOST * float(np.ptp(x))
    z = np.full((len(x), len(half)), x[0])
    for k in range(1, len(x)):
        z[k] = np.minimum(np.maximum(z[k - 1], x[k] - half), x[k] + half)
    return z
