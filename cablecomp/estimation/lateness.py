"""Whether a channel of a recording comes late: by a time, as a delay does, or by an angle, as lost motion does.

The nominal drive, which knows its own hysteresis, is run with each channel shifted. Lost motion trails by an angle,
whatever the speed; a delay by a time. So both may explain what is left: a delay is said only for what it takes beyond
lost motion of any width, and both are where all moves at one speed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import inf
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects.catalogue import other_channels
from cablecomp.errors import CablecompError
from cablecomp.estimation.evidence import INPUT, JOINT, MOTOR
from cablecomp.estimation.view import Suspicion, View, bare, mrad, rms
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

LATE_GAIN: Final = 0.75
"""A delay is believed where it takes what nothing else follows down to this share."""
NOTHING: Final = 1e-9
"""Share of the joint's range that is rounding: what the drive leaves of a recording that it made itself."""
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
        late, before, after = _least(partial(_left_shifted, view, name), _most(view))
        believed = after < LATE_GAIN * before < inf and before > NOTHING * np.ptp(view.y)
        if abs(late) < 1.5 * step or not believed:
            continue
        if not after < LATE_GAIN * _left_shifted(view, name, 0.0, step):
            continue  # it is noise, which any shift averages between two readings
        found.append(_delay(view, name, late, before, after))
    at_rest = view.ratio * np.ptp(view.q) < 0.1 * np.ptp(view.y)
    if at_rest and any(
        s.numbers["late_s"] > 0.0 for s in found
    ):  # an early joint is a late load, and what is late
        found = [s for s in found if s.numbers["late_s"] > 0.0]  # is the usual one
    return sorted(found, key=lambda s: s.numbers["left_rad"])[:1]


def rather_late(
    view: View, fits: Sequence[Suspicion], told: Callable[[View], Sequence[Suspicion]]
) -> list[Suspicion]:
    """What is to be said of `fits` (signs, ratio, scale) where the joint may be late instead: at one speed a late
    angle is as a straight line a compliance, of either sign, and a ratio.

    The drive as it stands, the joint in time, is held against the drive with the load as `fits` have it. `told`: what
    is said of other rows of this kind, which has to be nothing once the joint is in time.
    """
    if not (np.ptp(view.q) > 0.0 and np.ptp(view.M) > 0.0):
        return list(fits)
    late, before, after = _in_time(view, _bent(view, 1.0))
    _, otherwise, _ = _in_time(view, _bent(view, _factor(view, fits)))
    if not after < min(LATE_GAIN * before, otherwise / LATE_GAIN):
        return list(fits)
    said = _delay(view, JOINT, late, before, after)
    if told(view.shifted(said)):
        return list(fits)
    if after < LATE_GAIN * otherwise:
        return [said]
    kinds = " or ".join(f"the {f.kind} of {f.channel}" for f in fits)
    return [replace(said, text=f"{said.text}; or {kinds} is off: these data do not tell them apart")]


def accounted_for(config: JointConfig, columns: Mapping[str, FloatArray], said: Suspicion) -> bool:
    """Whether the joint with the effects that its configuration has leaves as little of the recording as it is: what
    trails there is theirs."""
    read = {"time_s", INPUT, JOINT, MOTOR, "joint_torque_Nm", "temperature_degC", *other_channels(config)}
    finite = np.all([np.isfinite(columns[name]) for name in read & set(columns)], axis=0)
    rows = {name: columns[name][finite] for name in read & set(columns)}
    time = rows["time_s"]
    moved = np.interp(time + said.numbers["late_s"], time, rows[said.channel])

    def left(rows: Mapping[str, FloatArray]) -> float:
        predicted = Observer(config).run(rows)[JOINT]
        line = np.column_stack((np.ones_like(time), rows[INPUT]))
        return rms(_beyond(line, rows[JOINT] - predicted))

    try:
        return left(rows) * LATE_GAIN < left({**rows, said.channel: moved})
    except CablecompError:  # what the joint cannot bear accounts for nothing
        return False


def borne_out(view: View, said: Suspicion) -> bool:
    """Whether the nominal drive, which knows its own hysteresis, follows the joint better with the load as a suspicion
    of its sign or scale has it: to a straight line small loads within the hysteresis look stiff, or turned. So it is
    where it bears neither load."""
    some = _some(view)
    line = np.column_stack((np.ones_like(view.q[some]), view.q[some]))

    def left(factor: float) -> float:
        bent = _bent(view, factor)
        return inf if bent is None else rms(_beyond(line, view.y[some] - bent))

    as_it_is, otherwise = left(1.0), left(_factor(view, [said]))
    return otherwise < as_it_is or as_it_is == inf


def _delay(view: View, name: str, late: float, before: float, after: float) -> Suspicion:
    """The words for a channel that is so late [s], and what is left at best [rad] as it is and shifted."""
    of_speed = _of_speed(view, name, late)
    how, trails = "late", ", or to trail by"
    if late < 0.0:  # what leads trails nothing
        how = f"early, or {INPUT if name == JOINT else 'the angles'} as late"
        trails = " or trailing it by"
    both = "" if of_speed > OF_SPEED else f"{trails} lost motion (at one speed they look alike)"
    rubs = ", or the motor's own friction stands in it" if name == MOTOR else ""
    words = (
        f"{name} seems to come {1e3 * abs(late):.3g} ms {how}{both}{rubs}: at best the drive leaves {mrad(before)} "
        f"RMS, {mrad(after)} with it shifted"
    )
    numbers = {"late_s": late, "rms_rad": before, "left_rad": after, "of_speed": of_speed}
    return Suspicion("delay", name, words, numbers)


def _factor(view: View, fits: Sequence[Suspicion]) -> float:
    """By what the load is to be multiplied, as signs and scale have it."""
    of_load = {f.kind: f.numbers["compliance_over_nominal"] for f in fits if f.channel == view.channel}
    turned = -1.0 if "sign" in of_load else 1.0
    return of_load.get("scale", turned)


def _bent(view: View, factor: float) -> FloatArray | None:
    """What the nominal drive gives under so many times the load [rad]; None where it cannot bear that."""
    some = _some(view)
    columns = {"time_s": view.time[some], INPUT: view.q[some], "joint_torque_Nm": factor * view.M[some]}
    try:
        return Observer(bare(view.config)).run(columns)["deflection_rad"]
    except CablecompError:
        return None


def _in_time(view: View, bent: FloatArray | None) -> tuple[float, float, float]:
    """(how late the joint is, s; RMS of what ratio and this deflection leave of it; RMS shifted)."""
    if bent is None:
        return 0.0, inf, inf
    some = _some(view)
    line = np.column_stack((np.ones_like(bent), view.q[some]))

    def left(shift_s: float) -> float:
        return rms(_beyond(line, np.interp(view.time[some] + shift_s, view.time, view.y) - bent))

    return _least(left, _most(view), 1e-5)


def _some(view: View) -> slice:
    """The rows on which delays are looked for."""
    return slice(None, None, max(1, len(view.time) // DELAY_ROWS))


def _most(view: View) -> float:
    """Greatest delay that is looked for in so long a recording [s]."""
    return min(MOST_LATE_S, 0.02 * float(view.time[-1] - view.time[0]))


def _least(left: Callable[[float], float], most: float, close: float = 0.005) -> tuple[float, float, float]:
    """(shift within `most` that leaves least, what is left without one, what with it), to this share of `most`."""
    at = cache(left)
    best, width = 0.0, 0.5 * most
    while width > close * most:  # the least of three, closer and closer
        best = min((best - width, best, best + width), key=at)
        width *= 0.5
    return best, at(0.0), at(best)


def _left_shifted(view: View, name: str, shift_s: float, apart_s: float = 0.0) -> float:
    """What is left with a channel shifted: the mean of two readings of it so far apart."""
    some = _some(view)
    time, y, M = view.time[some], view.y[some], view.M[some]
    whole = view.y if name == JOINT else view.M
    before, after = (np.interp(time + shift_s + part * apart_s, view.time, whole) for part in (-0.5, 0.5))
    if name == JOINT:
        y = 0.5 * (before + after)
    else:
        M = 0.5 * (before + after)
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
