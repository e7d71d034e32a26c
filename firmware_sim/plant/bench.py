"""Quasi-static bench: motor angle and joint moment given over time, joint angle and tensions solved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from firmware_sim.plant.assembly import Joint, assemble_joint, joint_effects, start_build
from firmware_sim.plant.columns import (
    JOINT_NM,
    JOINT_TORQUE,
    MOTOR_ANGLE,
    MOTOR_NM,
    MOTOR_TORQUE,
    MOTOR_TRUE,
    N_INPUTS,
    N_OUTPUTS,
    OTHER,
    PATH,
    PULLEY,
    Q_IN,
    Q_OUT,
    T_H,
    T_H_IN,
    T_L,
    T_L_IN,
    TEMPERATURE,
    TIME,
    UNSEEN_TORQUE,
    V_IN,
    V_OUT,
)
from firmware_sim.plant.config import EffectSpec, PlantConfig
from firmware_sim.plant.effects import apply_effects
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.jit import njit, part
from firmware_sim.plant.late import read_late
from firmware_sim.plant.mesh import NORMAL, Resolution
from firmware_sim.plant.readout import read_out
from firmware_sim.plant.records import Drive, Floats
from firmware_sim.plant.stepping import advance

RAMP_STEP_S = 1e4  # so slow that neither inertia nor viscosity acts
ROOM_TEMPERATURE_DEGC = 20.0


@dataclass(frozen=True)
class PlantRun:
    """Noise-free channels of one recording and the truth behind them, one value per sample, SI units.

    Signs: joint torque is the external moment on the output pulley, motor torque what the motor applies to
    the input pulley, both along +q; tensions are those of the free span (h at the output and at the input
    drum). `pulley_position_rad`, `motor_true_rad` and `load_path_Nm` are what no sensor sees.
    `failures` counts the steps in which some point kept going to and fro at the edge of sliding; there end
    forces settled to 1e-3 T0 only.
    """

    time_s: Floats
    motor_position_rad: Floats
    joint_position_rad: Floats
    joint_torque_Nm: Floats
    motor_torque_Nm: Floats
    motor_velocity_rad_s: Floats
    joint_velocity_rad_s: Floats
    tension_h_N: Floats
    tension_l_N: Floats
    tension_h_in_N: Floats
    tension_l_in_N: Floats
    temperature_degC: Floats
    other_1: Floats
    pulley_position_rad: Floats
    motor_true_rad: Floats
    load_path_Nm: Floats
    ratio: float
    iterations: int
    failures: int

    @property
    def deflection_rad(self) -> Floats:
        """Joint position less the rigid drive's, from the noise-free channels."""
        return self.joint_position_rad - self.ratio * self.motor_position_rad

    def channels(self) -> dict[str, Floats]:
        """The recording's channels by their canonical names, without the truth."""
        hidden = {"pulley_position_rad", "motor_true_rad", "load_path_Nm", "tension_h_in_N", "tension_l_in_N"}
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        return {k: v for k, v in found.items() if isinstance(v, np.ndarray) and k not in hidden}


def simulate(
    config: PlantConfig,
    time_s: ArrayLike,
    motor_position_rad: ArrayLike,
    joint_torque_Nm: ArrayLike,
    *,
    effects: Sequence[EffectSpec] = (),
    temperature_degC: ArrayLike | None = None,
    other_1: ArrayLike | None = None,
    resolution: Resolution = NORMAL,
    history: int = 0,
) -> PlantRun:
    """Play a bench recording: given motor angle and external moment, solve joint angle, tensions and motor
    torque.

    The cable starts at uniform pretension at the first motor angle; the first moment is then applied
    slowly. Arrays hold one value per sample (s, rad, N·m, °C, any unit). The first `history` samples are played, but
    belong to no recording: they are left out of the run, whose first sample comes after. Raises PlantError on unequal
    lengths, values that are not finite, time that does not increase, a wrap run out, or a step without
    solution.
    """
    inputs = _inputs(time_s, motor_position_rad, joint_torque_Nm, temperature_degC, other_1)
    if not 0 <= history < len(inputs) - 1:
        raise PlantError(f"history is {history}; 0 to {len(inputs) - 2}, so that two samples are left")
    build = start_build(config, dynamic=False)
    build.surround["start_s"] = inputs[history, TIME]
    apply_effects(build, joint_effects(config, effects))
    for fill in build.schedules:
        fill(inputs)
    motor = inputs[:, MOTOR_ANGLE]
    travel = float(np.max(np.abs(motor - motor[0])))
    joint = assemble_joint(build, float(motor[0]), travel, resolution)
    joint.drive.shafts["prescribed"][0] = 1
    load_slowly(joint.drive, inputs[0], resolution.ramp_steps)
    _start_moving(joint, inputs)
    outputs = np.empty((len(inputs), N_OUTPUTS))
    arc = _winding_per_motor_rad(config)
    status = _play(
        joint.drive,
        joint.readout[0],
        joint.output,
        inputs,
        outputs,
        arc / joint.spacing_m / resolution.spacings_per_step,
    )
    _raise_if_stuck(status, inputs)
    if joint.clock_delay_s != 0.0:
        outputs[:, Q_OUT] = read_late(inputs[:, TIME], outputs[:, Q_OUT], joint.clock_delay_s)
    for read in (*build.mounts, *build.encoders, *build.stamps):
        read(inputs, outputs)
    return _collect(inputs[history:], outputs[history:], joint, config)


def _inputs(time: ArrayLike, motor: ArrayLike, load: ArrayLike, warm: Any, other: Any) -> Floats:
    columns = [np.asarray(c, dtype=float) for c in (time, motor, load)]
    n = len(columns[0])
    inputs = np.zeros((n, N_INPUTS))
    extra = [
        np.full(n, ROOM_TEMPERATURE_DEGC) if warm is None else np.asarray(warm, dtype=float),
        np.zeros(n) if other is None else np.asarray(other, dtype=float),
    ]
    names = ("time_s", "motor_position_rad", "joint_torque_Nm", "temperature_degC", "other_1")
    places = (TIME, MOTOR_ANGLE, JOINT_TORQUE, TEMPERATURE, OTHER)
    for name, column, place in zip(names, columns + extra, places, strict=True):
        if column.shape != (n,):
            raise PlantError(f"{name} has shape {column.shape}; one value per sample, ({n},), is accepted")
        if not np.all(np.isfinite(column)):
            raise PlantError(f"{name} is not finite at sample {int(np.argmin(np.isfinite(column)))}")
        inputs[:, place] = column
    if n < 2 or np.any(np.diff(inputs[:, 0]) <= 0):
        raise PlantError("time_s must hold at least two samples and increase from each to the next")
    return inputs


def _winding_per_motor_rad(config: PlantConfig) -> float:
    """Largest arc that any stage winds per motor radian, m."""
    speed, largest = 1.0, 0.0
    for stage in config.stages:
        largest = max(largest, speed * stage.input_radius_m)
        speed *= stage.input_radius_m / stage.output_radius_m
    return largest


def load_slowly(drive: Drive, target: Floats, steps: int) -> None:
    """Bring moment, weight and surroundings of a drive at rest, motor held, from nothing to their first
    values."""
    weight = drive.shafts["gravity_Nm"].copy()
    before = target.copy()
    before[[MOTOR_TORQUE, JOINT_TORQUE, OTHER, UNSEEN_TORQUE]] = 0.0
    whole = target.copy()
    for k in range(1, steps + 1):
        share = k / steps
        drive.shafts["gravity_Nm"] = weight * share
        u = before + share * (whole - before)
        if not advance(drive, u, u, RAMP_STEP_S, 1, 0.0):
            raise PlantError("the joint cannot carry its first load; lower it or raise the pretension")
    rest(drive)


def rest(drive: Drive) -> None:
    """Stop all shafts where they are and forget the step sizes."""
    shafts, surround = drive.shafts, drive.surround
    for key in ("q_1", "q_2"):
        shafts[key] = shafts["q"]
    for key in ("v", "v_1", "v_2", "a"):
        shafts[key] = 0.0
    for key in ("h_prev", "reversals", "load_direction", "iterations", "failures"):
        surround[key] = 0
    surround["load_turn"] = shafts["external_Nm"][surround["load_shaft"]]


def _start_moving(joint: Joint, inputs: Floats) -> None:
    """Give the shafts the speed with which the recording sets in, so that no start-up jerk is made."""
    h = inputs[1, TIME] - inputs[0, TIME]
    speed = (inputs[1, MOTOR_ANGLE] - inputs[0, MOTOR_ANGLE]) / h
    shafts = joint.drive.shafts
    rates = np.zeros(len(shafts))
    rates[0] = speed
    for c in joint.drive.cables[::-1]:
        rates[c["shaft_out"]] = rates[c["shaft_in"]] * c["r"] / c["R"]
    rates[joint.output :] = rates[joint.output]
    for key in ("v", "v_1"):
        shafts[key] = rates
    shafts["q_1"] = shafts["q"] - rates * h
    joint.drive.surround["h_prev"] = h


@njit
def _play(
    drive: Drive, readout: Any, output: int, inputs: Floats, outputs: Floats, steps_per_rad: float
) -> int:
    """Step through all samples; returns −1, or the sample at which the wrap ran out (k) or no solution was
    found (−2 − k).

    Inertia takes a kink in the motor's angle for a blow: with it the angle is on parabolas between samples.
    """
    heavy = False
    for k in range(len(drive.shafts)):
        heavy = heavy or drive.shafts[k].inertia > 0.0
    bend, speed = 0.0, 0.0
    for k in range(len(inputs)):
        u0, u1 = inputs[max(k - 1, 0)], inputs[k]
        if k > 0:
            h = u1[TIME] - u0[TIME]
            parts = math.ceil(abs(u1[MOTOR_ANGLE] - u0[MOTOR_ANGLE]) * steps_per_rad)
            if heavy and h > 0.0:
                now = (u1[MOTOR_ANGLE] - u0[MOTOR_ANGLE]) / h
                bend = (now - speed) * h if k > 1 else 0.0
                speed = now
            if not advance(drive, u0, u1, h, parts, bend):
                return -2 - k
        else:
            h = 1e-3
        if not look(drive, readout, output, u1, h, outputs[k]):
            return k
    return -1


@njit
def look(drive: Drive, readout: Any, output: int, u: Floats, h: float, row: Floats) -> bool:
    """Fill one row of outputs from the present state; False if too little cable is left on a drum."""
    if wrap_exhausted(drive):
        return False
    observe(drive, readout, output, u, h, row)
    return True


@part
def wrap_exhausted(drive: Drive) -> bool:
    """Whether less than 0.1 rad of cable is left on any drum."""
    for k in range(len(drive.cables)):
        c = drive.cables[k]
        on_in = c.Y + c.ext - c.A - c.free_m - c.guide_arc_m
        if c.A < 0.1 * c.R or on_in < 0.1 * c.r:
            return True
    return False


@part
def observe(drive: Drive, readout: Any, output: int, u: Floats, h: float, row: Floats) -> None:
    """Fill one row of outputs from the present state."""
    s, m = drive.shafts[output], drive.shafts[0]
    passed = 0.0
    for k in range(len(drive.couplings)):
        if drive.couplings[k].a == output:
            passed += drive.couplings[k].torque_Nm
    path = s.load_Nm + passed
    sensed = u[JOINT_TORQUE] if m.prescribed == 1 else passed
    motor = -m.cable_Nm if m.prescribed == 1 else m.external_Nm
    end = drive.shafts[drive.surround[0].load_shaft]
    read_out(readout, h, end.q, m.q, path, sensed, motor, u[TEMPERATURE], u[OTHER])
    row[Q_OUT], row[Q_IN], row[JOINT_NM], row[MOTOR_NM] = (
        readout.joint_rad,
        readout.motor_rad,
        readout.joint_Nm,
        readout.motor_Nm,
    )
    row[V_OUT], row[V_IN], row[PULLEY], row[MOTOR_TRUE], row[PATH] = end.v, m.v, s.q, m.q, path
    h_cable = drive.cables[0]
    row[T_H], row[T_H_IN], row[T_L], row[T_L_IN] = h_cable.T_out, h_cable.T_in, 0.0, 0.0
    if len(drive.cables) > 1 and drive.cables[1].side == 1:
        row[T_L], row[T_L_IN] = drive.cables[1].T_out, drive.cables[1].T_in


def _raise_if_stuck(status: int, inputs: Floats) -> None:
    if status >= 0:
        raise PlantError(
            f"at {inputs[status, TIME]:.4g} s less than 0.1 rad of cable is left on a drum; "
            "turn less, or give more wrap"
        )
    if status <= -2:
        k = -2 - status
        raise PlantError(
            f"no equilibrium found at {inputs[k, TIME]:.4g} s (sample {k}); "
            "the load may be beyond what the cable can carry"
        )


def _collect(inputs: Floats, outputs: Floats, joint: Joint, config: PlantConfig) -> PlantRun:
    def column(index: int) -> Floats:
        return np.ascontiguousarray(outputs[:, index])

    surround = joint.drive.surround
    return PlantRun(
        time_s=inputs[:, TIME].copy(),
        motor_position_rad=column(Q_IN),
        joint_position_rad=column(Q_OUT),
        joint_torque_Nm=column(JOINT_NM),
        motor_torque_Nm=column(MOTOR_NM),
        motor_velocity_rad_s=column(V_IN),
        joint_velocity_rad_s=column(V_OUT),
        tension_h_N=np.maximum(column(T_H), 0.0),
        tension_l_N=np.maximum(column(T_L), 0.0),
        tension_h_in_N=np.maximum(column(T_H_IN), 0.0),
        tension_l_in_N=np.maximum(column(T_L_IN), 0.0),
        temperature_degC=inputs[:, TEMPERATURE].copy(),
        other_1=inputs[:, OTHER].copy(),
        pulley_position_rad=column(PULLEY),
        motor_true_rad=column(MOTOR_TRUE),
        load_path_Nm=column(PATH),
        ratio=config.ratio,
        iterations=int(surround["iterations"][0]),
        failures=int(surround["failures"][0]),
    )
