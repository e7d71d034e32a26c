"""A drive seen from both ends: joint angle and motor torque out of motor angle and joint torque.

The joint encoder shows what a drive's stretch does, the motor's torque what friction on the way does. A
model that must account for both cannot pay for friction at the joint with friction on the path: the torques
of the two ends differ by what the path takes, and the joint starts to move when all of the path slides.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.effects import extend, with_effects
from cablecomp.errors import InputError
from cablecomp.identification.parameters import with_values
from cablecomp.mechanics import layout as o
from cablecomp.mechanics.assemble import Model, assemble
from cablecomp.mechanics.cable import stacks
from cablecomp.mechanics.jit import njit
from cablecomp.mechanics.start import joint_start
from cablecomp.observer import stepper as st
from cablecomp.observer.refusal import REASONS, Refusal
from cablecomp.signal.smoothing import FloatArray, IntArray, group_means

FRICTION = "motor_friction_Nm"
"""Coulomb torque between the motor's torque sensor and the cable [N m]."""
PRESLIDING = "motor_presliding_rad"
"""Turn of the motor in which it builds up [rad]."""
BEND = "friction_per_bend"
"""Growth of the path's `routing_friction.mu_angle` with its bend [1/rad]: a coefficient of friction."""
SHARE = "guided_share"
"""Share of a cable's length between the drums that lies on guides or in the sheath [-]; the length stays."""
ZERO_EA = "EA_at_zero_N"
"""Cable's axial stiffness at no tension [N]; with `STIFFENING`, EA(T) = EA_0 + b_T T whatever the
pretension is."""
STIFFENING = "EA_per_tension"
"""b_T, axial stiffness gained per tension [-]."""

BoolArray: TypeAlias = NDArray[np.bool_]

_PATH = (FRICTION, PRESLIDING, BEND, SHARE, ZERO_EA, STIFFENING)
_LEAST_FRICTION = 2e-5
_MOST_STIFFENING = 0.95


@dataclass(frozen=True)
class PathRecording:
    """One recording of a path: canonical channels, which rows count, the session whose encoder zeros it
    shares.

    `columns`: `time_s`, `motor_position_rad`, `joint_position_rad`, and `joint_torque_Nm` (absent = no
    load) and `motor_torque_Nm` where measured. `counted`: rows judged; those before them only bring the
    model into its state. `bend_rad`: bend of the path in this recording, >= 0. `own`: parameters that are
    this recording's alone, by the name that is fitted (`rest[k]`) -> the name that the model knows
    (`effect.ID.PARAMETER`).
    """

    name: str
    session: str
    columns: Mapping[str, FloatArray]
    counted: BoolArray
    bend_rad: float = 0.0
    own: Mapping[str, str] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Rows that are judged."""
        return int(np.count_nonzero(self.counted))

    @property
    def weight(self) -> FloatArray:
        """Root of the time that each counted row stands for, over its mean: thinned rows weigh as what they
        replace."""
        time = self.columns["time_s"]
        share = np.gradient(time)[self.counted]
        return np.asarray(np.sqrt(share / share.mean()), dtype=np.float64)


@dataclass(frozen=True)
class PathPrediction:
    """What both ends should show: joint angle [rad] (zero of the encoder not yet removed), motor torque [N
    m], and the input-side tensions of cables h and l [N]."""

    joint_position_rad: FloatArray
    motor_torque_Nm: FloatArray
    tension_in_N: FloatArray


def path_config(config: JointConfig, values: Mapping[str, float], recording: PathRecording) -> JointConfig:
    """The joint with these parameter values, as it stood in this recording.

    `routing_friction.mu_angle` grows by `friction_per_bend` times the recording's bend; where the cable's
    law EA(T) is given, EA and `nonlinear_cable.stiffening` at the pretension follow from it.
    """
    named = _named(values, recording)
    plain = {name: v for name, v in named.items() if name not in _PATH}
    if STIFFENING in named:
        gained = named[STIFFENING] * named.get("pretension_N", config.drive.stage[-1].pretension_N)
        plain["EA_N"] = named[ZERO_EA] + gained
        plain["effect.nonlinear_cable.stiffening"] = min(gained / plain["EA_N"], _MOST_STIFFENING)
    if SHARE in named:
        whole = config.drive.stage[-1].free_length_m
        plain["effect.routing_friction.arc_length_m"] = named[SHARE] * whole
        plain["free_length_m"] = (1.0 - named[SHARE]) * whole
    if BEND in named:
        key = "effect.routing_friction.mu_angle"
        straight = plain.get(key, _given(config, "routing_friction", "mu_angle"))
        plain[key] = max(straight + named[BEND] * recording.bend_rad, _LEAST_FRICTION)
    try:
        return with_values(config, plain)
    except StopIteration:
        known = ", ".join(entry.id for entry in config.effect) or "none"
        raise InputError(
            f"{config.name}: a parameter of an effect that the configuration does not have ({known}); add it"
        ) from None


def predict_path(
    config: JointConfig, values: Mapping[str, float], recording: PathRecording
) -> PathPrediction:
    """Run the observer through the recording and read both ends of the cables.

    tau_motor = -r (T_h - T_l at the input drum) + tau_f z, z the elasto-plastic direction of the motor.
    Raises InputError where the drive cannot follow (slack in an open circuit, cable run out).
    """
    return path_model(config, values, recording).predict(recording)


@dataclass(frozen=True)
class PathModel:
    """The joint with one set of parameter values, set up: good for every recording it stands alike in."""

    joint: JointConfig
    model: Model
    friction_Nm: float
    presliding_rad: float

    def predict(self, recording: PathRecording) -> PathPrediction:
        """As `predict_path`."""
        model, columns = self.model, recording.columns
        rows = np.full((len(columns["time_s"]), st.IN_OTHER), np.nan)
        rows[:, st.IN_TIME], rows[:, st.IN_MOTOR] = columns["time_s"], columns["motor_position_rad"]
        rows[:, st.IN_LOAD] = columns.get("joint_torque_Nm", 0.0)
        S, J = model.S.copy(), model.J.copy()
        tables = cast(FloatArray, model.L)  # None is the plain law: compiled apart, never read
        joint_start(model.P, model.I, S, J, tables, rows[0, st.IN_TIME], rows[0, st.IN_MOTOR], 0.0)
        outs, tension = np.empty((len(rows), st.OUT_WIDTH)), np.empty((len(rows), 2))
        done, status = _run(model.P, model.I, S, J, tables, rows, outs, tension)
        if status != o.STATUS_OK:
            raise InputError(f"{recording.name}: at {rows[done, st.IN_TIME]:g} s {REASONS[Refusal(status)]}")
        torque = -self.joint.drive.stage[0].input_radius_m * (tension[:, 0] - tension[:, 1])
        if self.friction_Nm > 0.0:
            z = direction(columns["motor_position_rad"], self.presliding_rad)
            torque = torque + self.friction_Nm * z
        return PathPrediction(outs[:, st.OUT_JOINT], torque, tension)


def path_model(config: JointConfig, values: Mapping[str, float], recording: PathRecording) -> PathModel:
    """The joint with these parameter values, set up as it stood in this recording (its bend, what is its
    own)."""
    joint = path_config(config, values, recording)
    named = _named(values, recording)
    friction, presliding = named.get(FRICTION, 0.0), named.get(PRESLIDING, math.radians(0.15))
    model = assemble(joint, extend(joint))
    model.P[model.I[o.P_SENSOR] + o.CUTOFF] = 0.0  # the loop's filter would lag
    return PathModel(joint, model, friction, presliding)


def _named(values: Mapping[str, float], recording: PathRecording) -> dict[str, float]:
    """The values that hold in this recording, by the names that the model knows."""
    own = recording.own
    return {own.get(name, name): v for name, v in values.items() if "[" not in name or name in own}


@njit
def direction(angle: FloatArray, reach: float) -> FloatArray:
    """Direction of motion z in -1..1 that changes over `reach` [rad]: dz = dq/reach within its limits, from
    0."""
    z = np.zeros(len(angle))
    for k in range(1, len(angle)):
        z[k] = min(max(z[k - 1] + (angle[k] - angle[k - 1]) / reach, -1.0), 1.0)
    return z


@njit
def _run(
    P: FloatArray,
    I: IntArray,
    S: FloatArray,
    J: IntArray,
    L: FloatArray,
    rows: FloatArray,
    outs: FloatArray,
    tension: FloatArray,
) -> tuple[int, int]:
    """`run_block` of the observer, which also keeps the input-side tensions of the first circuit's two
    cables."""
    G = stacks(I, S)
    for k in range(rows.shape[0]):
        status = st.take(P, I, S, J, L, G, rows[k], outs[k])
        if status != o.STATUS_OK:
            return k, status
        for c in range(2):
            tension[k, c] = S[I[o.S_CABLE] + o.CABLE_STATE * c + o.Q_TENSION_IN]
    return rows.shape[0], o.STATUS_OK


def by_travel(
    columns: Mapping[str, FloatArray], group: int, travel_rad: float, swings: int | None = None
) -> dict[str, FloatArray]:
    """Means of `group` samples, of which one is kept per `travel_rad` of the motor; of the first `swings`
    swings only.

    A law without rates needs no more; what it costs in resolution at a reversal is at most `travel_rad`.
    Swings are counted from reversal to reversal, at a third of the motor's range.
    """
    means = {name: group_means(np.asarray(v, dtype=np.float64), group) for name, v in columns.items()}
    motor = means["motor_position_rad"]
    third = float(np.ptp(motor)) / 3.0
    kept = _kept(motor, travel_rad, third, len(motor) if swings is None else swings)
    return {name: np.ascontiguousarray(v[kept]) for name, v in means.items()}


@njit
def _kept(motor: FloatArray, travel: float, reversal: float, swings: int) -> IntArray:
    """Indices kept by `by_travel`: every so much travel, and where the motor turned round in between."""
    kept = np.zeros(2 * len(motor), dtype=np.int64)
    count, done, sign, extreme, top, bottom = 1, 0, 0.0, 0, 0, 0
    for k in range(1, len(motor)):
        if sign * (motor[k] - motor[extreme]) > 0.0 or sign == 0.0:
            if abs(motor[k] - motor[extreme]) >= reversal or sign != 0.0:
                sign = 1.0 if motor[k] > motor[extreme] else -1.0
                extreme = k
        elif sign * (motor[extreme] - motor[k]) >= reversal:
            sign, extreme, done = -sign, k, done + 1
            if done >= swings:
                break
        top = k if motor[k] > motor[top] else top
        bottom = k if motor[k] < motor[bottom] else bottom
        moved = motor[k] - motor[kept[count - 1]]
        if abs(moved) >= travel:
            turn = bottom if moved > 0.0 else top  # how far it went the other way before
            if turn > kept[count - 1]:
                kept[count] = turn
                count += 1
            kept[count] = k
            count += 1
            top = bottom = k
    return kept[:count]


def after_first_reversal(columns: Mapping[str, FloatArray]) -> BoolArray:
    """Rows from the motor's first reversal on (a return by 2 % of its range after nine tenths of it).

    What lies before depends on a history that nobody recorded.
    """
    away = np.abs(columns["motor_position_rad"] - columns["motor_position_rad"][0])
    farthest, span = np.maximum.accumulate(away), float(away.max())
    return np.asarray(np.logical_or.accumulate((farthest >= 0.9 * span) & (farthest - away >= 0.02 * span)))


def with_path_effects(config: JointConfig, names: Mapping[str, Mapping[str, float]]) -> JointConfig:
    """The joint with exactly these effects, {id: {parameter: value}}."""
    return with_effects(config, tuple(names.items()))


def _given(config: JointConfig, effect: str, parameter: str) -> float:
    for entry in config.effect:
        if entry.id == effect:
            return float(entry.parameters[parameter])
    raise InputError(f"{config.name}: `friction_per_bend` needs the effect `{effect}`; add it")
