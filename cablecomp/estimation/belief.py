"""A check before belief: do signs, ratio, units, timing of a recording agree with what the drive allows?

Straight lines, joint angle on motor angle and load; for delays alone the nominal drive, so that its hysteresis
does not pass for one. What is said is a suspicion with its numbers; nothing is changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, log, pi
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.control.stiffness import plain, stiffness_range
from cablecomp.errors import CablecompError
from cablecomp.estimation.evidence import JOINT, MOTOR
from cablecomp.estimation.evidence import load_channel as channel_of_load
from cablecomp.observer import Observer
from cablecomp.signal.smoothing import FloatArray

INPUT: Final = "motor_position_rad"
ROWS: Final = 20_000
"""Rows that are looked at; of more, every n-th."""
SURE: Final = 0.5
"""Least partial correlation from which on a slope means something."""
RATIO_OFF: Final = 0.05
"""Relative departure from the rigid ratio that no compliance or slip makes."""
SCALE_OFF: Final = 4.0
"""Factor between the compliance seen and the nominal one that friction, stiffening and tolerances do not make."""
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
GAP: Final = 10.0
"""Usual steps that make a gap."""
MOVED: Final = 0.05
"""Share of its range that a channel has to have moved across a gap for the gap to matter."""

_ANGLES: Final = {
    180.0 / pi: "joint_position_rad seems to be in degrees",
    pi / 180.0: "motor_position_rad seems to be in degrees",
    2.0 * pi: "motor_position_rad seems to be in turns",
    0.5 / pi: "joint_position_rad seems to be in turns",
    1000.0: "joint_position_rad seems to be in milliradians",
    0.001: "motor_position_rad seems to be in milliradians",
}
"""What a slope so many times the drive's ratio comes of."""
_TORQUES: Final = {
    1e-3: "mNm",
    1e-2: "Ncm",
    0.112985: "inlbf",
    0.0980665: "kgfcm",
    1.35582: "ftlbf",
    1e3: "kNm",
}
"""Units of torque by how many N m one is."""


@dataclass(frozen=True)
class Suspicion:
    """`kind`: sign, ratio, unit, scale, delay or gap; `channel`: which one is meant first; `text`: one line
    with the numbers; `numbers`: those."""

    kind: str
    channel: str
    text: str
    numbers: Mapping[str, float]


def suspicions(config: JointConfig, columns: Mapping[str, FloatArray]) -> tuple[Suspicion, ...]:
    """What in a recording (canonical channels) hardly fits the drive; empty where all agrees or nothing can be said."""
    found = list(_gaps(columns))
    if INPUT not in columns or JOINT not in columns:
        return tuple(found)
    load = channel_of_load(config, columns)
    rows = _rows(columns, (INPUT, JOINT, *((load,) if load else ())))
    if len(rows["time_s"]) < 40:
        return tuple(found)
    view = _View(config, rows, load)
    fits = view.angles()
    if any(f.kind == "unit" for f in fits):  # all else would be told in that unit
        return (*found, *fits)
    fits += view.torques()
    if found:
        return (*found, *fits)
    late = view.delays()
    in_time = view.shifted(late[0]) if fits and late else view
    found += late if not fits or not (in_time.angles() or in_time.torques()) else view.in_doubt(fits)
    if MOTOR in columns and "joint_torque_Nm" in columns and load != MOTOR:
        found += _motor_torque(config, _rows(columns, (INPUT, MOTOR, "joint_torque_Nm")))
    return tuple(found)


class _View:
    """One recording's rows beside what the nominal drive makes of them."""

    def __init__(self, config: JointConfig, rows: Mapping[str, FloatArray], load: str | None) -> None:
        self.config, self.rows, self.channel = config, rows, load
        self.ratio = config.drive.ratio
        self.time, self.q, self.y = rows["time_s"], rows[INPUT], rows[JOINT]
        self.M = np.zeros(len(self.q)) if load is None else rows[load]
        if load == MOTOR:
            self.M = -self.M / self.ratio
        self.compliance = _compliance(config)
        self.slope, self.sure = _partial(self.y, self.q, self.M)

    def left(self, turn: float = 1.0, ratio: float | None = None, scale: float = 1.0) -> float:
        """RMS that the linear nominal drive leaves of the joint angle, zero taken off."""
        r = self.ratio if ratio is None else ratio
        return _rms(self.y - r * self.q - turn * scale * self.compliance * self.M)

    def angles(self) -> list[Suspicion]:
        """Signs, units and ratio of the two angles."""
        factor = self.slope / self.ratio
        moves = np.std(self.ratio * self.q) > 0.2 * np.std(self.y)
        if not moves and abs(self.slope) * np.std(self.q) < 0.5 * np.std(self.y):
            return list(self._reach())
        if abs(self.sure) < SURE:
            return []
        found = []
        if factor < 0.0:
            words = (
                f"motor_position_rad and joint_position_rad seem to turn against "
                f"each other: RMS {_mrad(self.left())} as "
                f"they are, {_mrad(self.left(ratio=-self.ratio))} with one of them turned"
            )
            found.append(Suspicion("sign", JOINT, words, {"slope_over_ratio": factor}))
        off = abs(factor)
        if abs(log(off)) > RATIO_OFF and not _loose(self.config, "radius"):
            unit = next((words for f, words in _ANGLES.items() if abs(log(off / f)) < 0.1), None)
            words = unit or "a gear between encoder and pulley, or a radius that is off?"
            kind = "unit" if unit else "ratio"
            left = _rms(self.y - self.slope * self.q)
            said = (
                f"{words}: the joint moves {off:.4g} times as far as the drive's "
                f"ratio allows; RMS {_mrad(self.left())} as "
                f"it is, {_mrad(left)} with the ratio seen"
            )
            found.append(Suspicion(kind, JOINT, said, {"slope_over_ratio": factor}))
        return found or list(self._reach())

    def _reach(self) -> Iterator[Suspicion]:
        """Angles in degrees both: far beyond what is wound on the pulleys."""
        last = self.config.drive.stage[-1]
        reach, most = float(np.ptp(self.y)), 2.0 * last.wrap_output_rad
        if reach > 4.0 * most:
            words = (
                f"both angles seem to be in degrees: the joint moves over {reach:.4g} rad, what is wound on its pulley "
                f"allows {most:.3g}"
            )
            yield Suspicion("unit", JOINT, words, {"reach_rad": reach, "allowed_rad": most})

    def torques(self) -> list[Suspicion]:
        """Sign and unit of the load."""
        if self.channel is None or not np.ptp(self.M) > 0.0:
            return []
        seen, sure = _partial(self.y, self.M, self.q)
        if abs(sure) < SURE:
            return []
        factor = seen / self.compliance
        ratio = self.slope if abs(self.sure) > SURE else self.ratio
        found = []
        if factor < 0.0:
            line = _rms(self.y - ratio * self.q - seen * self.M)
            words = (
                f"{self.channel} seems to have the opposite sign: RMS {_mrad(self.left(ratio=ratio))}, "
                f"{_mrad(self.left(-1.0, ratio))} with it turned; a straight line leaves {_mrad(line)}"
            )
            found.append(Suspicion("sign", self.channel, words, {"compliance_over_nominal": factor}))
        off = abs(factor)
        most = SCALE_OFF * (8.0 if _loose(self.config, "EA_N") else 1.0)
        if not 1.0 / most < off < most:
            unit = min(_TORQUES, key=lambda f: abs(log(off / f)))
            near = f" (in {_TORQUES[unit]}?)" if abs(log(off / unit)) < 0.5 else ""
            words = (
                f"{self.channel} moves the joint {off:.3g} times as far as the drive allows{near}: RMS "
                f"{_mrad(self.left(ratio=ratio))} as it is, {_mrad(self.left(np.sign(factor), ratio, off))} scaled so"
            )
            found.append(Suspicion("scale", self.channel, words, {"compliance_over_nominal": factor}))
        return found

    def delays(self) -> list[Suspicion]:
        """Whether the load, or the joint angle, comes late or early: the nominal drive, which knows its own
        hysteresis, is run with each of them shifted.

        Lost motion trails by an angle, whatever the speed; a delay by a time. So both may explain what is left: a
        delay is said only for what it takes beyond lost motion of any width, and both are where all moves at one speed.
        """
        found = []
        wanted = [JOINT, *([self.channel] if self.channel and np.ptp(self.M) > 0.0 else [])]
        step = float(np.median(np.diff(self.time)))
        for name in wanted:
            late, before, after = self._best_shift(name)
            if abs(late) < 1.5 * step or not after < LATE_GAIN * before < inf:
                continue
            of_speed = self._of_speed(name, late)
            if of_speed > OF_SPEED or after < LATE_OR_LOST_GAIN * before:
                how = "late" if late > 0.0 else "early"
                both = (
                    ""
                    if of_speed > OF_SPEED
                    else ", or to trail by lost motion (at one speed they look alike)"
                )
                words = (
                    f"{name} seems to come {1e3 * abs(late):.3g} ms {how}{both}: the "
                    f"nominal drive leaves {_mrad(before)} RMS, "
                    f"{_mrad(after)} with it shifted"
                )
                numbers = {"late_s": late, "rms_rad": before, "left_rad": after, "of_speed": of_speed}
                found.append(Suspicion("delay", name, words, numbers))
        at_rest = self.ratio * np.ptp(self.q) < 0.1 * np.ptp(self.y)
        if at_rest and any(
            s.numbers["late_s"] > 0.0 for s in found
        ):  # an early joint is a late load, and what is late
            found = [s for s in found if s.numbers["late_s"] > 0.0]  # is the usual one
        return sorted(found, key=lambda s: s.numbers["left_rad"])[:1]

    def in_doubt(self, fits: list[Suspicion]) -> list[Suspicion]:
        """The same, where the load follows from the motor's way and its direction with a word on what else trails so:
        lost motion, or an angle that is late, is then seen as a compliance."""
        if not (np.ptp(self.q) > 0.0 and np.ptp(self.M) > 0.0):
            return fits
        every = max(1, len(self.time) // DELAY_ROWS)
        q, M = self.q[::every], self.M[::every]
        later = slice(len(q) // 4, None)
        own = _rms(_beyond(np.column_stack((np.ones_like(q), q, _trailing(q))), M)) / max(
            _rms(M[later]), 1e-300
        )
        word = "; or an angle comes late, or trails by lost motion (the load follows the motor, so they look alike)"
        return [
            replace(f, text=f.text + word) if own < OF_SPEED and f.channel == self.channel else f
            for f in fits
        ]

    def shifted(self, delay: Suspicion) -> _View:
        """The rows with that channel brought in time."""
        moved = np.interp(self.time + delay.numbers["late_s"], self.time, self.rows[delay.channel])
        return _View(self.config, {**self.rows, delay.channel: moved}, self.channel)

    def _best_shift(self, name: str) -> tuple[float, float, float]:
        """(how late, s; RMS as it is; RMS shifted)."""
        most = min(MOST_LATE_S, 0.02 * float(self.time[-1] - self.time[0]))
        left: dict[float, float] = {}

        def at(shift: float) -> float:
            if shift not in left:
                left[shift] = self._left_shifted(name, shift)
            return left[shift]

        best, width = 0.0, 0.5 * most
        while width > 0.005 * most:  # the least of three, closer and closer
            best = min((best - width, best, best + width), key=at)
            width *= 0.5
        return best, at(0.0), at(best)

    def _left_shifted(self, name: str, shift_s: float) -> float:
        every = max(1, len(self.time) // DELAY_ROWS)
        time, y, M = self.time[::every], self.y[::every], self.M[::every]
        if name == JOINT:
            y = np.interp(time + shift_s, self.time, self.y)
        else:
            M = np.interp(time + shift_s, self.time, self.M)
        try:
            followers = self._followers(time, self.q[::every], M)
        except CablecompError:  # such a load the nominal drive cannot bear
            return inf
        return _rms(_beyond(followers, y))

    def _followers(self, time: FloatArray, q: FloatArray, M: FloatArray) -> FloatArray:
        """What follows angle and load whatever the speed, a column each: straight lines, the nominal drive, lost
        motion of several widths."""
        columns = {"time_s": time, INPUT: q, "joint_torque_Nm": M}
        bent = Observer(_bare(self.config)).run(columns)["deflection_rad"]
        lost = [_trailing(x) for x in (q, M) if np.ptp(x) > 0.0]
        return np.column_stack((np.ones_like(q), q - q.mean(), M - M.mean(), bent, *lost))

    def _of_speed(self, name: str, shift_s: float) -> float:
        """Share of what that shift changes in a channel that nothing follows which knows no speed, 0 to 1."""
        every = max(1, len(self.time) // DELAY_ROWS)
        time, q, M = self.time[::every], self.q[::every], self.M[::every]
        followers = self._followers(time, q, M)
        whole = self.ratio * self.q + np.interp(self.time, time, followers[:, 3]) if name == JOINT else self.M
        ahead, behind = (np.interp(time + k * shift_s, self.time, whole) for k in (0.5, -0.5))
        changed = ahead - behind
        return _rms(_beyond(followers, changed)) / max(_rms(changed[len(time) // 4 :]), 1e-300)


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


def _motor_torque(config: JointConfig, rows: Mapping[str, FloatArray]) -> list[Suspicion]:
    """The motor holds against the load: tau = -(r/R) M at rest."""
    wanted = -config.drive.ratio * rows["joint_torque_Nm"]
    torque = rows[MOTOR]
    slope, sure = _partial(torque, wanted, np.gradient(rows[INPUT]))
    if sure > -0.7:
        return []
    words = (
        f"motor_torque_Nm seems to have the opposite sign: it would help the load instead of holding it (correlation "
        f"{sure:.2f}); RMS {_rms(torque - wanted):.3g} Nm as it is, {_rms(torque + wanted):.3g} Nm with it turned"
    )
    return [Suspicion("sign", MOTOR, words, {"slope": slope, "correlation": sure})]


def _gaps(columns: Mapping[str, FloatArray]) -> Iterator[Suspicion]:
    time = columns["time_s"]
    steps = np.diff(time)
    if not len(steps) or not np.any(steps > 0.0):
        return
    usual = float(np.median(steps[steps > 0.0]))
    for name in (INPUT, "joint_torque_Nm"):
        values = columns.get(name)
        if values is None or not np.any(np.isfinite(values)):
            continue
        moved = np.abs(np.diff(values)) / max(float(np.nanmax(values) - np.nanmin(values)), 1e-300)
        at = np.flatnonzero((steps > GAP * usual) & (moved > MOVED))
        if len(at):
            k = int(at[np.argmax(moved[at])])
            more = f" ({len(at) - 1} more such gaps)" if len(at) > 1 else ""
            words = (
                f"gap of {steps[k]:.3g} s after {time[k]:.6g} s, over which {name} "
                f"moved by {100 * moved[k]:.0f} % of its "
                f"range{more}: the way between is not known, the drive is taken as having gone straight"
            )
            yield Suspicion("gap", name, words, {"at_s": float(time[k]), "gap_s": float(steps[k])})
            return


def _rows(columns: Mapping[str, FloatArray], names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Rows with a finite value in all of these channels, at most `ROWS`, their time rising."""
    good = np.isfinite(columns["time_s"])
    for name in names:
        good &= np.isfinite(columns[name])
    place = np.flatnonzero(good)
    place = place[:: max(1, len(place) // ROWS)]
    place = place[np.concatenate(([True], np.diff(columns["time_s"][place]) > 0.0))] if len(place) else place
    return {n: np.asarray(columns[n], dtype=np.float64)[place] for n in ("time_s", *names)}


def _compliance(config: JointConfig) -> float:
    """Deflection per load of the nominal drive at its greatest load [rad/Nm]."""
    try:
        return 1.0 / stiffness_range(_bare(config)).secant_Nm_per_rad
    except CablecompError:  # effects that the walk cannot take: the cable alone
        last = config.drive.stage[-1]
        wrapped = last.free_length_m / (last.EA_N * last.output_radius_m**2)
        return wrapped * (0.5 if config.drive.circuit == "closed" else 1.0)


def _partial(y: FloatArray, x: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Slope of y on x, `other` held, and their partial correlation; zero where x does not move."""
    A = np.column_stack((np.ones_like(x), other - other.mean()))
    left = [v - A @ np.linalg.lstsq(A, v, rcond=None)[0] for v in (y, x)]
    yy, xx, xy = float(left[0] @ left[0]), float(left[1] @ left[1]), float(left[0] @ left[1])
    if xx <= 1e-12 * float(x @ x) or yy <= 0.0:
        return 0.0, 0.0
    return xy / xx, xy / float(np.sqrt(xx * yy))


def _bare(config: JointConfig) -> JointConfig:
    """The drive alone, loaded by a known torque."""
    return plain(config).model_copy(update={"effect": (), "empirical": ()})


def _loose(config: JointConfig, key: str) -> bool:
    """Whether a value is known by order of magnitude only."""
    return any(key in name and value >= 1.0 for name, value in config.tolerance.items())


def _rms(values: FloatArray) -> float:
    return float(np.std(values))


def _mrad(value: float) -> str:
    return f"{1e3 * value:.3g} mrad"
