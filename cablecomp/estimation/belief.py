"""A check before belief: do signs, ratio, units, timing of a recording agree with what the drive allows?

Straight lines, joint angle on motor angle and load; for delays the nominal drive (`lateness.py`). What is said is a
suspicion with its numbers; nothing is changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import log, pi
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.estimation.evidence import FEWEST, INPUT, JOINT, MOTOR, OVERFLOWN
from cablecomp.estimation.evidence import load_channel as channel_of_load
from cablecomp.estimation.lateness import accounted_for, borne_out, delays, rather_late
from cablecomp.estimation.parallel import algebra_in_one_thread
from cablecomp.estimation.sensors import odd_sensors
from cablecomp.estimation.view import Suspicion, View, mrad, partial, rms
from cablecomp.recording.suggest import LOST, lost_share
from cablecomp.signal.smoothing import FloatArray

ROWS: Final = 20_000
"""Rows that are looked at; of more, every n-th."""
SURE: Final = 0.5
"""Least partial correlation from which on a slope means something."""
RATIO_OFF: Final = 0.05
"""Relative departure from the rigid ratio that no compliance or slip makes."""
MAGNITUDES_OFF: Final = 20.0
"""Times the nominal ratio that no radius known by order of magnitude makes, and degrees (57) do; what is lost on the
way makes a ratio as small as it likes."""
BEYOND: Final = 4.0
"""Times what is wound on a pulley that an angle in radians does not move by."""
SCALE_OFF: Final = 4.0
"""Factor between the compliance seen and the nominal one that friction, stiffening and tolerances do not make."""
TORQUE_OFF: Final = 20.0
"""Times what holds the load and winds the pretension together that no motor's torque is: mNm are 1000, Ncm 100; of 57
recordings of a surgical tool, most of whose torque is friction, up to 1.06."""
GAP: Final = 10.0
"""Usual steps that make a gap."""
MOVED: Final = 0.05
"""Share of its range that a channel has to have moved across a gap for the gap to matter."""
LEAST_STEPS: Final = 2.0
"""Times what it moves by from row to row (95 % less) that it has to have moved across it as well."""

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


@algebra_in_one_thread
def suspicions(config: JointConfig, columns: Mapping[str, FloatArray]) -> tuple[Suspicion, ...]:
    """What in a recording (canonical channels) hardly fits the drive; empty where all agrees or nothing can be said."""
    found = list(_gaps(columns))
    if INPUT not in columns or JOINT not in columns:
        return tuple(found)
    load = channel_of_load(config, columns)
    rows = _rows(columns, (INPUT, JOINT, *((load,) if load else ())))
    if len(rows["time_s"]) < FEWEST:
        return tuple(found)
    view = View(config, rows, load)
    far = {name for name, (reach, most) in _moves(view).items() if reach > BEYOND * most}
    # of an angle in degrees steps by 6.28 are no turns
    odd = tuple(s for s in odd_sensors(view, columns) if not (s.kind == "wrapped" and s.channel in far))
    if any(s.kind in ("stuck", "wrapped") for s in odd):  # it would spoil all that follows
        return (*found, *odd)
    fits = [f for f in _angles(view) if f.kind != "unit" or _explains_more(view, f)]
    fits += _slack(view)
    if any(f.kind == "unit" or "pretension_bears_Nm" in f.numbers for f in fits):  # and so would these
        return (*found, *odd, *fits)
    fits += _torques(view)
    found += fits if found else _delays(view, fits, columns)  # over a gap no delay can be told
    found = [f for f in found if _explains_more(view, f)]
    turned = any((s.kind, s.channel) == ("sign", "joint_torque_Nm") for s in found)
    if MOTOR in columns and "joint_torque_Nm" in columns and load != MOTOR and not turned:
        rows = _rows(columns, (INPUT, JOINT, MOTOR, "joint_torque_Nm"))
        said = _motor_torque(config, rows) if len(rows["time_s"]) >= FEWEST else []
        # what trails then is friction turned round
        if any(s.kind == "sign" and s.channel != MOTOR for s in said):
            found = [s for s in found if s.kind != "delay"]
        found += said
    return (*odd, *found)


def _explains_more(view: View, said: Suspicion) -> bool:
    """Whether the ratio that is seen, where that is what is said, leaves less than the one configured: where a spring's
    load follows the motor, the slope of a straight line holds what the drive yields."""
    of_ratio = said.kind in ("ratio", "unit") and "slope_over_ratio" in said.numbers
    return not of_ratio or view.left(ratio=view.slope) < view.left()


def still_doubted(
    said: Sequence[Suspicion], config: JointConfig, columns: Mapping[str, FloatArray]
) -> tuple[Suspicion, ...]:
    """What of that stands beside a joint with effects: what trails by them is not late."""
    known = config.effect
    return tuple(s for s in said if s.kind != "delay" or not known or not accounted_for(config, columns, s))


def _delays(view: View, fits: Sequence[Suspicion], columns: Mapping[str, FloatArray]) -> list[Suspicion]:
    """What comes late, and what straight lines tell (`fits`) unless that is of it."""
    late = delays(view)
    found = (
        late
        if not fits or (late and not _linear(view.shifted(late[0])))
        else rather_late(view, fits, _linear)
    )
    return list(still_doubted(found, view.config, columns))


def _linear(view: View) -> list[Suspicion]:
    """What straight lines tell."""
    return _angles(view) + _torques(view)


def _angles(view: View) -> list[Suspicion]:
    """Signs, units and ratio of the two angles."""
    factor = view.slope / view.ratio
    moves = np.std(view.ratio * view.q) > 0.2 * np.std(view.y)
    if not moves and abs(view.slope) * np.std(view.q) < 0.5 * np.std(view.y):
        return list(_reach(view))
    if abs(view.sure) < SURE:
        return []
    found = []
    if factor < 0.0:
        words = (
            f"motor_position_rad and joint_position_rad seem to turn against "
            f"each other: RMS {mrad(view.left())} as "
            f"they are, {mrad(view.left(ratio=-view.ratio))} with one of them turned"
        )
        found.append(Suspicion("sign", JOINT, words, {"slope_over_ratio": factor}))
    off = abs(factor)
    loose = _loose(view.config, "radius")
    if off > MAGNITUDES_OFF if loose else abs(log(off)) > RATIO_OFF:
        nearest = min(_ANGLES, key=lambda f: abs(log(off / f)))
        unit = _ANGLES[nearest] if loose or abs(log(off / nearest)) < 0.1 else None
        words = unit or "a gear between encoder and pulley, or a radius that is off"
        kind = "unit" if unit else "ratio"
        said = (
            f"{words}: the joint moves {off:.4g} times as far as the drive's "
            f"ratio allows; RMS {mrad(view.left())} as "
            f"it is, {mrad(view.left(ratio=view.slope))} with the ratio seen"
        )
        found.append(Suspicion(kind, JOINT, said, {"slope_over_ratio": factor}))
    return found or list(_reach(view))


def _moves(view: View) -> dict[str, tuple[float, float]]:
    """By how much each angle moves, and how much what is wound on its pulley allows [rad]."""
    first, last = view.config.drive.stage[0], view.config.drive.stage[-1]
    return {
        JOINT: (float(np.ptp(view.y)), 2.0 * last.wrap_output_rad),
        INPUT: (float(np.ptp(view.q)), 2.0 * first.wrap_input_rad),
    }


def _reach(view: View) -> Iterator[Suspicion]:
    """Angles in degrees, by how far they move: one alone where the other stays within what is wound on its pulley."""
    moves = _moves(view)
    alone = any(reach < most for reach, most in moves.values())
    for name, (reach, most) in moves.items():
        if reach > BEYOND * most:
            which = f"{name} seems" if alone else "both angles seem"
            words = (
                f"{which} to be in degrees: {name} moves over {reach:.4g} rad, what is wound on its pulley "
                f"allows {most:.3g}"
            )
            yield Suspicion("unit", name, words, {"reach_rad": reach, "allowed_rad": most})
            return


def _slack(view: View) -> Iterator[Suspicion]:
    """An open circuit whose cable the load lets go slack, and would pull were all signs the other way."""
    last = view.config.drive.stage[-1]
    if view.channel is None or view.config.drive.circuit != "open":
        return
    holds = last.output_radius_m * last.pretension_N
    least, most = (float(v) for v in np.percentile(view.M, (1.0, 99.0)))
    if least < -holds < -most:
        words = (
            f"{view.channel} lets the one cable of this open circuit go slack (a load of {least:.3g} N m, its "
            f"pretension bears {-holds:.3g}); a load that pulls the cable is positive: turn the signs of both angles "
            "and of all torques"
        )
        yield Suspicion("sign", view.channel, words, {"load_Nm": least, "pretension_bears_Nm": -holds})


def _torques(view: View) -> list[Suspicion]:
    """Sign and unit of the load, where another one would leave less: of a joint held by a spring the load follows the
    angle, and the line says nothing of the drive."""
    if view.channel is None or not np.ptp(view.M) > 0.0:
        return []
    seen, sure = partial(view.y, view.M, view.q)
    if abs(sure) < SURE:
        return []
    factor = seen / view.compliance
    ratio = view.slope if abs(view.sure) > SURE else view.ratio
    found = []
    turned = view.left(-1.0, ratio)
    if factor < 0.0 and turned < view.left(ratio=ratio):
        line = rms(view.y - ratio * view.q - seen * view.M)
        which = (
            f" if {INPUT} is what is turned, and is right if {JOINT} is" if ratio * view.ratio < 0.0 else ""
        )
        words = (
            f"{view.channel} seems to have the opposite sign{which}: RMS {mrad(view.left(ratio=ratio))}, "
            f"{mrad(turned)} with it turned; a straight line leaves {mrad(line)}"
        )
        found.append(Suspicion("sign", view.channel, words, {"compliance_over_nominal": factor}))
    off = abs(factor)
    most = SCALE_OFF * (8.0 if _loose(view.config, "EA_N") else 1.0)
    scaled = view.left(np.sign(factor), ratio, off)
    if not 1.0 / most < off < most and scaled < view.left(ratio=ratio):
        unit = min(_TORQUES, key=lambda f: abs(log(off / f)))
        near = f" (in {_TORQUES[unit]}?)" if abs(log(off / unit)) < 0.5 else ""
        words = (
            f"{view.channel} moves the joint {off:.3g} times as far as the drive allows{near}: RMS "
            f"{mrad(view.left(ratio=ratio))} as it is, {mrad(scaled)} scaled so"
        )
        found.append(Suspicion("scale", view.channel, words, {"compliance_over_nominal": factor}))
    return [f for f in found if borne_out(view, f)]


def _motor_torque(config: JointConfig, rows: Mapping[str, FloatArray]) -> list[Suspicion]:
    """The motor holds against the load: tau = -(r/R) M at rest. Where it is far more than that and r T0, it is in
    another unit; where it seems to help, that torque is turned with which the right one's work at both ends would be
    taken out of friction."""
    wanted = -config.drive.ratio * rows["joint_torque_Nm"]
    torque = rows[MOTOR]
    first = config.drive.stage[0]
    reach, usual = (float(np.sqrt(np.mean(v**2))) for v in (torque, wanted))
    usual += first.input_radius_m * first.pretension_N
    if reach > TORQUE_OFF * usual:
        off = reach / usual
        words = (
            f"{MOTOR} is {off:.3g} times what load and pretension come to at the motor (RMS {reach:.3g} and "
            f"{usual:.3g} Nm): it seems to be in another unit (mNm, Ncm?), or of a motor before a gear"
        )
        return [Suspicion("scale", MOTOR, words, {"times_usual": off})]
    slope, sure = partial(torque, wanted, np.gradient(rows[INPUT]))
    if sure > -0.7:
        return list(_given_back(rows, sure))
    lost = lost_share(torque, rows[INPUT], rows["joint_torque_Nm"], rows[JOINT])
    turned = MOTOR if lost > -LOST else "joint_torque_Nm"
    either = " (or joint_torque_Nm: the work of both does not tell which)" if abs(lost) < LOST else ""
    words = (
        f"{turned} seems to have the opposite sign{either}: the motor's torque would help the load instead of holding "
        f"it (correlation {sure:.2f}); they differ by {rms(torque - wanted):.3g} Nm RMS at the motor as they are, by "
        f"{rms(torque + wanted):.3g} Nm with one of them turned"
    )
    return [Suspicion("sign", turned, words, {"slope": slope, "correlation": sure})]


def _given_back(rows: Mapping[str, FloatArray], sure: float) -> Iterator[Suspicion]:
    """Friction takes work. Where both ends together are given more than a stroke can have stored, all is the other way
    round; `sure`: how well the motor's torque holds against the load."""
    ends = ((MOTOR, INPUT), ("joint_torque_Nm", JOINT))
    work = [np.diff(rows[angle]) * 0.5 * (rows[torque][1:] + rows[torque][:-1]) for torque, angle in ends]
    motor_J, load_J = (float(np.sum(w)) for w in work)
    moved = sum(float(np.sum(np.abs(w))) for w in work)
    strokes = min(_strokes(rows[angle]) for _, angle in ends)
    if -(motor_J + load_J) > (LOST + 1.0 / strokes) * moved:
        one = "" if sure > SURE else ", or one of the two torques"
        words = (
            f"time seems to run backwards, or both angles or both torques to have the opposite sign{one}: the motor "
            f"does {motor_J:.3g} J and the load {load_J:.3g} J of work on the drive, whose friction would give what it "
            "can only take"
        )
        yield Suspicion("sign", "time_s", words, {"motor_J": motor_J, "load_J": load_J})


def _strokes(angle: FloatArray) -> int:
    """How often it goes from one quarter of its range to the opposite one; 1 at least."""
    low, high = float(np.min(angle)), float(np.max(angle))
    end = np.sign(np.round(2.0 * (angle - 0.5 * (low + high)) / max(high - low, 1e-300)))
    return max(1, int(np.count_nonzero(np.diff(end[end != 0.0]))))


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
        noise = LEAST_STEPS * np.nanpercentile(moved, 95.0)  # a channel at rest moves by its noise alone
        at = np.flatnonzero((steps > GAP * usual) & (moved > MOVED) & (moved > noise))
        if len(at):
            k = int(at[np.argmax(moved[at])])
            more = f" ({len(at) - 1} more such gaps)" if len(at) > 1 else ""
            words = (
                f"gap of {steps[k]:.3g} s after {time[k]:.6g} s, over which {name} "
                f"moved by {100 * moved[k]:.0f} % of its "
                f"range{more}: the way between is not known, and straight on is assumed at first"
            )
            yield Suspicion("gap", name, words, {"at_s": float(time[k]), "gap_s": float(steps[k])})
            return


def _rows(columns: Mapping[str, FloatArray], names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Rows with a reading in all of these channels, at most `ROWS`, their time rising."""
    good = np.isfinite(columns["time_s"])
    for name in names:
        good &= np.abs(columns[name]) < OVERFLOWN
    place = np.flatnonzero(good)
    place = place[:: max(1, len(place) // ROWS)]
    place = place[np.concatenate(([True], np.diff(columns["time_s"][place]) > 0.0))] if len(place) else place
    return {n: np.asarray(columns[n], dtype=np.float64)[place] for n in ("time_s", *names)}


def _loose(config: JointConfig, key: str) -> bool:
    """Whether a value is known by order of magnitude only."""
    return any(key in name and value >= 1.0 for name, value in config.tolerance.items())
