"""A neighbour's load in other forms: late, let go of again, bent, beyond a slack, by the pose of this joint, through
friction, up to a stop, and as friction alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import MOTOR_ANGLE, OTHER, TIME, UNSEEN_TORQUE
from firmware_sim.plant.effects.base import EffectKind, Parameter, form
from firmware_sim.plant.forms.courses import low_passed
from firmware_sim.plant.records import Floats

_GAIN = Parameter("load_coefficient", "k, N·m per unit of channel other_1", neutral=0.0)


def _loading(build: Build, moment: Callable[[Floats], Floats]) -> None:
    def fill(inputs: Floats) -> None:
        inputs[:, UNSEEN_TORQUE] += moment(inputs)

    build.schedules.append(fill)


def _lagged(build: Build, p: Mapping[str, float]) -> None:
    _loading(
        build,
        lambda inputs: p["load_coefficient"] * low_passed(inputs[:, OTHER], inputs[:, TIME], p["lag_s"]),
    )


LAGGED = form(
    "crosstalk",
    "lagged",
    "The neighbour's load arrives late, through something soft and damped: M + k y, t_l ẏ = other_1 − y.",
    (_GAIN, Parameter("lag_s", "t_l", 0.2, 0.0)),
    ("other:1",),
    _lagged,
)


def _let_go(build: Build, p: Mapping[str, float]) -> None:
    def moment(inputs: Floats) -> Floats:
        other = inputs[:, OTHER]
        gone = p["share"] * low_passed(other, inputs[:, TIME], p["lag_s"])
        return np.asarray(p["load_coefficient"] * (other - gone))

    _loading(build, moment)


LET_GO = form(
    "crosstalk",
    "let_go",
    "The neighbour's load arrives through grease, which lets go of a share of it: M + k (other_1 − s y), "
    "t_l ẏ = other_1 − y.",
    (_GAIN, Parameter("lag_s", "t_l", 0.5, 0.0), Parameter("share", "s", 0.8, 0.0, 1.0)),
    ("other:1",),
    _let_go,
)


def _quadratic(build: Build, p: Mapping[str, float]) -> None:
    def moment(inputs: Floats) -> Floats:
        other = inputs[:, OTHER]
        return np.asarray(p["load_coefficient"] * other * (1.0 + p["bend_per_unit"] * other))

    _loading(build, moment)


QUADRATIC = form(
    "crosstalk",
    "quadratic",
    "The neighbour's load counts more one way than the other: M + k other_1 (1 + b other_1).",
    (_GAIN, Parameter("bend_per_unit", "b", 0.0)),
    ("other:1",),
    _quadratic,
)


def _touching(build: Build, p: Mapping[str, float]) -> None:
    def moment(inputs: Floats) -> Floats:
        other, slack = inputs[:, OTHER], p["slack_units"]
        return np.asarray(p["load_coefficient"] * (other - np.clip(other, -slack, slack)))

    _loading(build, moment)


TOUCHING = form(
    "crosstalk",
    "touching",
    "The neighbour's cable touches this joint's beyond a slack alone: M + k (other_1 − clip(other_1, −d, d)).",
    (_GAIN, Parameter("slack_units", "d", 0.0, 0.0)),
    ("other:1",),
    _touching,
)


def _posed(build: Build, p: Mapping[str, float]) -> None:
    ratio = build.config.ratio

    def moment(inputs: Floats) -> Floats:
        pose = ratio * inputs[:, MOTOR_ANGLE] + p["phase_rad"]
        return np.asarray(p["load_coefficient"] * inputs[:, OTHER] * np.cos(pose))

    _loading(build, moment)


POSED = form(
    "crosstalk",
    "posed",
    "How much of the neighbour's load arrives depends on where this joint stands: M + k other_1 cos(q + φ).",
    (_GAIN, Parameter("phase_rad", "φ", 0.0)),
    ("other:1", "joint_angle"),
    _posed,
)


def dragged_along(other: Floats, friction: float) -> Floats:
    """What follows a reading through friction: it stays where it is until the reading is `friction` away."""
    place, result = float(other[0]), np.empty_like(other)
    for k, value in enumerate(other.tolist()):
        place = min(max(place, value - friction), value + friction)
        result[k] = place
    return result


def _dragged(build: Build, p: Mapping[str, float]) -> None:
    _loading(
        build,
        lambda inputs: p["load_coefficient"] * dragged_along(inputs[:, OTHER], p["friction_units"]),
    )


DRAGGED = form(
    "crosstalk",
    "dragged",
    "The neighbour's load arrives through friction of its own: M + k y, y stays while |other_1 − y| < r, and is drawn "
    "along then.",
    (_GAIN, Parameter("friction_units", "r", 0.0, 0.0)),
    ("other:1",),
    _dragged,
)


def _stopped(build: Build, p: Mapping[str, float]) -> None:
    def moment(inputs: Floats) -> Floats:
        most = p["stop_units"]
        return np.asarray(p["load_coefficient"] * most * np.tanh(inputs[:, OTHER] / most))

    _loading(build, moment)


STOPPED = form(
    "crosstalk",
    "stopped",
    "What is soft between the neighbour and this joint runs against a stop, which bears the rest: "
    "M + k s tanh(other_1/s).",
    (_GAIN, Parameter("stop_units", "s", 1.0, 1e-9)),
    ("other:1",),
    _stopped,
)


def _rubbing(build: Build, p: Mapping[str, float]) -> None:
    def moment(inputs: Floats) -> Floats:
        other, reach = inputs[:, OTHER], p["reach_units"]
        return np.asarray(p["torque_Nm"] * (other - dragged_along(other, reach)) / reach)

    _loading(build, moment)


RUBBING = form(
    "crosstalk",
    "rubbing",
    "The neighbour's cable crosses this joint's and rubs on it as it runs: M + τ_r (other_1 − y)/r, y stays while "
    "|other_1 − y| < r, and is drawn along then.",
    (
        Parameter("torque_Nm", "τ_r, by the direction in which the neighbour goes", neutral=0.0),
        Parameter("reach_units", "r, within which the friction builds up", 0.05, 1e-9),
    ),
    ("other:1",),
    _rubbing,
)

KINDS: tuple[EffectKind, ...] = (LAGGED, LET_GO, QUADRATIC, TOUCHING, POSED, DRAGGED, STOPPED, RUBBING)
