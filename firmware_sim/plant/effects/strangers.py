"""Physics near the catalogue and not in it, which only a recording played on the bench can show: play before the
input pulley, heat of its own making, a hub that slips, sensors that lag or drift, a neighbour that tightens."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.columns import (
    JOINT_NM,
    JOINT_TORQUE,
    MOTOR_ANGLE,
    OTHER,
    PRETENSION_H,
    PRETENSION_L,
    Q_IN,
    Q_OUT,
    TEMPERATURE,
    TIME,
)
from firmware_sim.plant.effects.base import EffectKind, Parameter
from firmware_sim.plant.forms.courses import low_passed
from firmware_sim.plant.records import Floats


def held_in_play(angle: Floats, load: Floats, gap: float, drag: float) -> Floats:
    """What a shaft behind a clearance turns, rad: by the load on one flank or the other; while |load| is less than the
    shaft's own friction it stays where it is until a flank takes it along."""
    half, x = 0.5 * gap, 0.5 * gap * float(np.sign(load[0]))
    result = np.empty_like(angle)
    turns = np.concatenate([[0.0], np.diff(angle)])
    for k, (m, turn) in enumerate(zip(load.tolist(), turns.tolist(), strict=True)):
        x = min(max(x - turn, -half), half) if abs(m) < drag else (half if m > 0.0 else -half)
        result[k] = x
    return np.asarray(angle + result)


def _input_play(build: Build, p: Mapping[str, float]) -> None:
    shown: list[Floats] = []

    def fill(inputs: Floats) -> None:
        shown.append(inputs[:, MOTOR_ANGLE].copy())
        inputs[:, MOTOR_ANGLE] = held_in_play(
            inputs[:, MOTOR_ANGLE], inputs[:, JOINT_TORQUE], p["gap_rad"], p["drag_Nm"]
        )

    def read(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_IN] = shown[0]

    build.schedules.append(fill)
    build.encoders.append(read)


INPUT_PLAY = EffectKind(
    "input_play",
    "The input pulley has clearance b on the motor's shaft: the load lays it on one flank or the other; below the load "
    "M_d it stays where it is until the motor takes it along.",
    (
        Parameter("gap_rad", "b, of the motor's angle", low=0.0, high=0.5, neutral=0.0),
        Parameter("drag_Nm", "M_d, at the joint", 0.0, 0.0),
    ),
    ("load", "motor_angle", "reversal"),
    _input_play,
    listed=False,
    nearest=("termination_backlash", "routing_friction"),
)


def _tightened(course: Floats, inputs: Floats) -> None:
    inputs[:, PRETENSION_H] += course
    inputs[:, PRETENSION_L] += course


def _self_heating(build: Build, p: Mapping[str, float]) -> None:
    def fill(inputs: Floats) -> None:
        time, load = inputs[:, TIME], inputs[:, JOINT_TORQUE]
        # from the clock's zero on; what heat an earlier recording left is what this one's course would leave
        heat = low_passed(np.square(load) / max(float(np.mean(np.square(load))), 1e-12), time, p["lag_s"])
        grown = -np.expm1(-np.maximum(time, 0.0) / p["lag_s"])
        _tightened(-p["fraction"] * heat * grown, inputs)

    build.schedules.append(fill)


SELF_HEATING = EffectKind(
    "self_heating",
    "The drive warms by what it does, where no sensor sits: T0 (1 − a H), H the square of the load over its mean, "
    "smoothed over t_h and growing from the clock's zero as 1 − e^(−t/t_h).",
    (
        Parameter("fraction", "a", low=-0.5, high=0.5, neutral=0.0),
        Parameter("lag_s", "t_h", 25.0, 0.1),
    ),
    ("time", "load"),
    _self_heating,
    listed=False,
    nearest=("pretension_relaxation", "thermal_pretension", "strand_break"),
)


def _neighbour_tightens(build: Build, p: Mapping[str, float]) -> None:
    build.schedules.append(lambda inputs: _tightened(p["coefficient_per_unit"] * inputs[:, OTHER], inputs))


NEIGHBOUR_TIGHTENS = EffectKind(
    "neighbour_tightens",
    "A neighbouring joint lengthens the cables' path: T0 (1 + k · other_1).",
    (Parameter("coefficient_per_unit", "k", neutral=0.0),),
    ("other:1",),
    _neighbour_tightens,
    listed=False,
    nearest=("crosstalk",),
)


def _hub_slip(build: Build, p: Mapping[str, float]) -> None:
    def read(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += p["slip_rad"] * (inputs[:, TIME] >= p["time_s"])

    build.encoders.append(read)


HUB_SLIP = EffectKind(
    "encoder_hub_slip",
    "The joint encoder's hub slips on its shaft once: its zero moves, and nothing else.",
    (Parameter("slip_rad", "by how much", neutral=0.0), Parameter("time_s", "when")),
    ("time",),
    _hub_slip,
    listed=False,
    nearest=("clamp_slip",),
)


def _torque_lag(build: Build, p: Mapping[str, float]) -> None:
    def read(inputs: Floats, outputs: Floats) -> None:
        outputs[:, JOINT_NM] = low_passed(outputs[:, JOINT_NM], inputs[:, TIME], p["lag_s"])

    build.encoders.append(read)


TORQUE_SENSOR_LAG = EffectKind(
    "torque_sensor_lag",
    "The torque sensor's amplifier smooths: t_l Ṁ_shown = M − M_shown.",
    (Parameter("lag_s", "t_l", low=0.0, high=10.0, neutral=0.0),),
    ("load_rate",),
    _torque_lag,
    listed=False,
    nearest=("clock_skew", "viscous_slip"),
)


def _warm_zero(build: Build, p: Mapping[str, float]) -> None:
    def read(inputs: Floats, outputs: Floats) -> None:
        outputs[:, Q_OUT] += p["coefficient_rad_per_K"] * (inputs[:, TEMPERATURE] - p["reference_degC"])

    build.encoders.append(read)


WARM_ZERO = EffectKind(
    "joint_encoder_drift",
    "The joint encoder's bracket grows with the temperature: + k (ϑ − ϑ_ref).",
    (
        Parameter("coefficient_rad_per_K", "k", neutral=0.0),
        Parameter("reference_degC", "ϑ_ref", 20.0),
    ),
    ("temperature",),
    _warm_zero,
    listed=False,
    nearest=("thermal_pretension",),
)

KINDS = (INPUT_PLAY, SELF_HEATING, NEIGHBOUR_TIGHTENS, HUB_SLIP, TORQUE_SENSOR_LAG, WARM_ZERO)
