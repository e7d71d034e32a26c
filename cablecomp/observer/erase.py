"""The shortest excitation that erases a joint's history: a load swing, or a turn of the motor there and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import Limits
from cablecomp.effects.base import cable_strain
from cablecomp.errors import InputError
from cablecomp.observer.observer import Observer
from cablecomp.observer.refusal import SampleRefused
from cablecomp.signals import Sample

LEG = 60  # samples of each leg of an excitation; quasi-static, so their number only has to show the extremes
AGREE = 1e-9  # of the excitation's deflection, or of the strain under T0: two histories count as one
Columns = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class ErasePlan:
    """What erases the present history.

    `load_swing_Nm`: smallest amplitude A of a swing of the joint torque from its present value to `first` A, to
    -A and back; `motor_turn_rad`: smallest travel of the motor to either side and back at the present load; each
    is infinite if none within the limits does it. `load_limit_Nm`, `turn_limit_rad`: how far the search could go.
    """

    load_swing_Nm: float
    first: int
    motor_turn_rad: float
    load_limit_Nm: float
    turn_limit_rad: float

    @property
    def possible(self) -> bool:
        """True if a swing or a turn within the limits erases the history."""
        return self.load_swing_Nm < inf or self.motor_turn_rad < inf


def plan_erase(
    observer: Observer,
    time_s: float,
    motor_position_rad: float,
    joint_torque_Nm: float,
    limits: Limits | None = None,
) -> ErasePlan:
    """Plan how to erase the history that `observer` holds at this time (s), motor angle (rad) and joint torque (N m).

    Erased means: an observer that started from uniform tension and goes through the same excitation predicts
    the same from then on. Found by bisection on copies; the observer itself stays as it is. Limits: those
    given, else the configuration's; a load limit must be stated in one of them. Raises InputError without one, and
    SampleRefused where the joint cannot be there.
    """
    limits = observer.config.limits if limits is None else limits
    most = limits.joint_torque_max_Nm
    if most is None:
        raise InputError(
            f"{observer.config.name}: `limits.joint_torque_max_Nm` is missing; state how far the load may swing"
        )
    at = (time_s, motor_position_rad, joint_torque_Nm)
    known = _told_its_load(observer)
    known.peek(Sample(*at, temperature_degC=20.0, other=(0.0,) * len(known.channels)))
    swings = {first: _smallest(known, at, most, first, turn=False) for first in (1, -1)}
    first = min(swings, key=lambda sign: swings[sign])
    low, high = limits.motor_position_min_rad, limits.motor_position_max_rad
    # a turn goes as far to either side
    below = inf if low is None else max(motor_position_rad - low, 0.0)
    above = inf if high is None else max(high - motor_position_rad, 0.0)
    room = min(below, above)
    room = 2.0 * pi if room == inf else room
    turns = [_smallest(known, at, room, sign, turn=True) for sign in (1, -1)]
    return ErasePlan(swings[first], first, min(turns), most, room)


def _told_its_load(observer: Observer) -> Observer:
    """A copy that is told its load, whatever the observer itself finds that from."""
    options = observer.config.observer.model_copy(update={"load": "joint_torque"})
    known = Observer(observer.config.model_copy(update={"observer": options}))
    known.set_vector(observer.vector())
    return known


def excitation(at: tuple[float, float, float], size: float, first: int, turn: bool) -> Columns:
    """Samples of one there-and-back excitation from (time, motor angle, load)."""
    time, motor, load = at
    legs = (0.0, first * size, -first * size, 0.0)
    if not turn:
        legs = (load, first * size, -first * size, load)
    way = np.concatenate([np.linspace(a, b, LEG + 1)[1:] for a, b in pairwise(legs)])
    steady = np.ones(len(way))
    return {
        "time_s": time + 0.01 * np.arange(1, len(way) + 1, dtype=np.float64),
        "motor_position_rad": motor + (way if turn else 0.0 * way),
        "joint_torque_Nm": load * steady if turn else way,
        "temperature_degC": 20.0 * steady,
    }


def _smallest(
    observer: Observer, at: tuple[float, float, float], most: float, first: int, turn: bool
) -> float:
    """Smallest size within `most` that erases, by bisection; infinite if none does that the joint can take."""
    high = most
    if _erases(observer, at, most, first, turn) is None:  # a cable would be slack, or a drum unwound
        high = _bisected(most, lambda size: _erases(observer, at, size, first, turn) is None)[0]
    if not _erases(observer, at, high, first, turn):
        return inf
    return _bisected(high, lambda size: bool(_erases(observer, at, size, first, turn)))[1]


def _bisected(most: float, beyond: Callable[[float], bool]) -> tuple[float, float]:
    """The sizes next to each other, up to a millionth of `most`, between which `beyond` comes true."""
    low, high = 0.0, most
    while high - low > 1e-6 * most:
        middle = 0.5 * (low + high)
        if beyond(middle):
            high = middle
        else:
            low = middle
    return low, high


def _erases(
    observer: Observer, at: tuple[float, float, float], size: float, first: int, turn: bool
) -> bool | None:
    """Whether after the excitation the history no longer shows, neither in the tensions nor along the wraps; None if
    the joint cannot take this much."""
    known, fresh = observer.copy(), Observer(observer.config)
    columns = excitation(at, size, first, turn) | {name: np.zeros(3 * LEG) for name in observer.channels}
    begin = {key: value[:1].copy() for key, value in columns.items()}
    begin["time_s"][0], begin["motor_position_rad"][0], begin["joint_torque_Nm"][0] = at
    try:
        fresh.run(begin)
        a, b = known.run(columns), fresh.run(columns)
    except SampleRefused:
        return None
    unit = max(float(np.max(np.abs(b["deflection_rad"]))), cable_strain(observer.config))
    if abs(a["deflection_rad"][-1] - b["deflection_rad"][-1]) > AGREE * unit:
        return False
    for mine, other in zip(known.profiles(), fresh.profiles(), strict=True):
        tension = np.interp(mine.angle_rad, other.angle_rad, other.tension_N)
        if np.max(np.abs(tension - mine.tension_N)) > 1e-6 * float(np.max(other.tension_N)):
            return False
    return True
