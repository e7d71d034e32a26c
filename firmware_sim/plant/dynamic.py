"""The joint as hardware: motor, drive, link and sensors, stepped by torque commands in real or simulated
time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from firmware_sim.plant.assembly import Build, Joint, Tail, assemble_joint, joint_effects, start_build
from firmware_sim.plant.bench import ROOM_TEMPERATURE_DEGC, load_slowly, look, rest
from firmware_sim.plant.columns import (
    JOINT_NM,
    JOINT_TORQUE,
    MOTOR_ANGLE,
    MOTOR_NM,
    MOTOR_TORQUE,
    N_INPUTS,
    N_OUTPUTS,
    OTHER,
    PATH,
    PULLEY,
    Q_IN,
    Q_OUT,
    T_H,
    T_L,
    TEMPERATURE,
    TIME,
)
from firmware_sim.plant.config import EffectSpec, PlantConfig
from firmware_sim.plant.effects import apply_effects
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.mesh import NORMAL, Resolution
from firmware_sim.plant.sensors import SensorSpec
from firmware_sim.plant.stepping import advance

MAX_STEP_S = 1e-3
RIGID = 1e-3  # compliance of a rigid torque sensor, as a share of the free span's: nothing that a joint shows
FLANK = 1e-5  # rad/(N·m), of the flanks of a gap that has no compliance besides


@dataclass(frozen=True)
class MotorSpec:
    """Motor at the input pulley; friction is viscous plus Coulomb with presliding, torque follows by a
    first-order loop."""

    rotor_inertia_kgm2: float
    torque_max_Nm: float
    viscous_Nms_per_rad: float = 0.0
    coulomb_Nm: float = 0.0
    presliding_rad: float = 1e-4
    current_bandwidth_Hz: float = 1000.0
    torque_constant_Nm_per_A: float = 0.1

    @classmethod
    def for_joint(cls, config: PlantConfig) -> MotorSpec:
        """A motor that suits a joint: torque for three times the pretension, inertia like the link's seen
        from the motor."""
        stage = config.stages[0]
        torque = 3.0 * stage.input_radius_m * stage.pretension_N
        inertia = LinkSpec.for_joint(config).inertia_kgm2 * config.ratio**2
        return cls(
            inertia, torque, 0.5 * inertia, 0.01 * torque, torque_constant_Nm_per_A=max(torque / 10.0, 1e-3)
        )


@dataclass(frozen=True)
class LinkSpec:
    """Link behind the torque sensor: inertia, weight m g l sin(q + φ), and a wall that it meets at
    `wall_rad` from below."""

    inertia_kgm2: float
    gravity_Nm: float = 0.0
    gravity_phase_rad: float = 0.0
    viscous_Nms_per_rad: float = 0.0
    wall_rad: float | None = None
    wall_stiffness_Nm_per_rad: float = 500.0
    wall_loss_s_per_rad: float = 0.5

    @classmethod
    def for_joint(cls, config: PlantConfig) -> LinkSpec:
        """A link that swings on the drive's zero-load stiffness at about 20 Hz and weighs a fifth of R T0."""
        stage = config.stages[-1]
        stiffness = span_stiffness(config)
        weight = 0.2 * stage.output_radius_m * stage.pretension_N
        inertia = min(stiffness / (2 * math.pi * 20.0) ** 2, weight / 9.81 * 0.3)
        return cls(inertia, weight, 0.0, 0.2 * inertia)


def span_stiffness(config: PlantConfig) -> float:
    """What the free span of the last stage's cables resists the joint with, N·m/rad."""
    stage = config.stages[-1]
    cables = 2 if config.circuit == "closed" else 1
    return cables * stage.EA_N * stage.output_radius_m**2 / stage.free_length_m


@dataclass(frozen=True)
class PlantTruth:
    """What no sensor sees, at the end of a step; signs as in `PlantReadings`."""

    motor_position_rad: float
    motor_velocity_rad_s: float
    joint_position_rad: float
    joint_velocity_rad_s: float
    pulley_position_rad: float
    joint_torque_Nm: float
    load_path_Nm: float
    motor_torque_Nm: float
    contact_torque_Nm: float
    tension_h_N: float
    tension_l_N: float


@dataclass(frozen=True)
class PlantReadings:
    """Sensor readings at the end of a step.

    Angles positive together; joint torque is the external moment on the output pulley along +q_out, motor
    torque (from the measured current) what the motor applies to the input pulley along +q_in.
    """

    time_s: float
    motor_position_rad: float
    motor_velocity_rad_s: float
    joint_position_rad: float
    joint_velocity_rad_s: float
    joint_torque_Nm: float
    motor_torque_Nm: float
    motor_current_A: float
    temperature_degC: float
    truth: PlantTruth


class Plant:
    """A cable-driven joint with motor and link, advanced by `step`.

    It starts at rest at `motor_position_rad`, motor held, hanging in its weight; the motor is free from the
    first step on. `resolution.friction_step` sets cost against accuracy; `travel_rad` is how far the motor
    may turn at that accuracy. All noise comes from `seed`. Raises PlantError for what it cannot build.
    """

    def __init__(
        self,
        config: PlantConfig,
        motor: MotorSpec | None = None,
        link: LinkSpec | None = None,
        sensors: SensorSpec | None = None,
        effects: Sequence[EffectSpec] = (),
        seed: int = 0,
        *,
        resolution: Resolution = NORMAL,
        motor_position_rad: float = 0.0,
        travel_rad: float = 3.2,
    ) -> None:
        self.config = config
        self.motor = MotorSpec.for_joint(config) if motor is None else motor
        self.link = LinkSpec.for_joint(config) if link is None else link
        self.sensors = SensorSpec.from_table(config.sensors) if sensors is None else sensors
        self._resolution = resolution
        self._rng = np.random.default_rng(seed)
        build = start_build(config, dynamic=True)
        apply_effects(build, joint_effects(config, effects))
        if build.bench_only:
            names = ", ".join(e.id for e in joint_effects(config, effects))
            raise PlantError(f"one of {names} can be played on the bench only, not on a plant that runs live")
        if build.clock_delay_s < 0:
            raise PlantError(
                "clock_skew: a running plant cannot stamp the joint early; delay_s >= 0 is accepted"
            )
        self._equip(build)
        self._joint = assemble_joint(build, motor_position_rad, travel_rad, resolution)
        self._input = np.zeros(N_INPUTS)
        self._target = np.zeros(N_INPUTS)
        self._row = np.zeros(N_OUTPUTS)
        self._settle(motor_position_rad)
        self._history: deque[tuple[float, float]] = deque(maxlen=4096)
        self._velocity = np.zeros(2)
        self._last: np.ndarray[tuple[int], np.dtype[np.float64]] | None = None
        self.time_s = 0.0

    def _equip(self, build: Build) -> None:
        """Put motor and link at the ends of the drive."""
        rotor, pulley = build.shafts[0], build.shafts[build.output]
        rotor["inertia"], rotor["viscous"] = self.motor.rotor_inertia_kgm2, self.motor.viscous_Nms_per_rad
        rotor["coulomb_Nm"] += self.motor.coulomb_Nm
        rotor["presliding"] = max(self.motor.presliding_rad, rotor["presliding"])
        pulley["inertia"] += 0.02 * self.link.inertia_kgm2
        for shaft in build.shafts[1 : build.output]:
            shaft["inertia"] = (
                0.02 * self.motor.rotor_inertia_kgm2
            )  # so that slack cables leave it determined
        soft = self.sensors.joint_torque_compliance_rad_per_Nm + build.extra_compliance
        stiffness = 1.0 / max(soft, FLANK if build.gap_rad > 0.0 else RIGID / span_stiffness(self.config))
        damping = 0.04 * math.sqrt(stiffness * self.link.inertia_kgm2)
        build.tails.insert(0, Tail(self.link.inertia_kgm2, stiffness, damping, build.gap_rad))

    def _settle(self, motor_position_rad: float) -> None:
        """Hang the link in its weight with the motor held, then let go."""
        shafts = self._joint.drive.shafts
        link = shafts[self._joint.output + 1]
        link["gravity_Nm"], link["gravity_phase"] = self.link.gravity_Nm, self.link.gravity_phase_rad
        link["viscous"] = self.link.viscous_Nms_per_rad
        self.set_wall(self.link.wall_rad)
        shafts["prescribed"][0] = 1
        self._input[MOTOR_ANGLE], self._input[TEMPERATURE] = motor_position_rad, ROOM_TEMPERATURE_DEGC
        load_slowly(self._joint.drive, self._input, self._resolution.ramp_steps)
        self._torque = -float(shafts["cable_Nm"][0])
        shafts["prescribed"][0] = 0
        shafts["bristle"] = np.where(shafts["friction_kind"] == 0, shafts["q"], 0.0)
        rest(self._joint.drive)
        self._input[MOTOR_TORQUE] = self._torque

    def set_wall(self, position_rad: float | None) -> None:
        """Put the wall at a joint angle, or take it away (None); the link meets it from below."""
        end = self._joint.drive.shafts[self._joint.load_shaft]
        end["wall_at"] = math.inf if position_rad is None else position_rad
        end["wall_stiffness"] = 0.0 if position_rad is None else self.link.wall_stiffness_Nm_per_rad
        end["wall_loss"] = self.link.wall_loss_s_per_rad

    @property
    def iterations(self) -> int:
        """Solver iterations so far, for timing studies."""
        return int(self._joint.drive.surround["iterations"][0])

    def step(
        self,
        dt_s: float,
        motor_torque_command_Nm: float,
        /,
        external_torque_Nm: float = 0.0,
        temperature_degC: float = ROOM_TEMPERATURE_DEGC,
        other_1: float = 0.0,
    ) -> PlantReadings:
        """Advance by dt_s under a torque command; `external_torque_Nm` acts on the link along +q.

        Raises PlantError if the command is not finite, dt_s is not positive, a wrap has run out, or no
        solution is found.
        """
        if not (dt_s > 0 and math.isfinite(motor_torque_command_Nm) and math.isfinite(external_torque_Nm)):
            raise PlantError(
                f"step({dt_s!r}, {motor_torque_command_Nm!r}): "
                "a positive step and finite torques are accepted"
            )
        parts = max(1, math.ceil(dt_s / MAX_STEP_S - 1e-9))
        limit = self.motor.torque_max_Nm
        wanted = min(max(motor_torque_command_Nm, -limit), limit)
        lag = math.exp(-2 * math.pi * self.motor.current_bandwidth_Hz * dt_s / parts)
        drive, u0, u1 = self._joint.drive, self._input, self._target
        for _ in range(parts):
            h = dt_s / parts
            self._torque = wanted + (self._torque - wanted) * lag
            self.time_s += h
            u1[TIME], u1[MOTOR_TORQUE], u1[JOINT_TORQUE] = self.time_s, self._torque, external_torque_Nm
            u1[TEMPERATURE], u1[OTHER] = temperature_degC, other_1
            if not advance(drive, u0, u1, h, 1, 0.0):
                raise PlantError(f"no equilibrium found at {self.time_s:.4f} s")
            u0[:] = u1
        if not look(drive, self._joint.readout[0], self._joint.output, u1, dt_s, self._row):
            raise PlantError(
                f"at {self.time_s:.4f} s less than 0.1 rad of cable is left on a drum; turn less"
            )
        return self._read(dt_s, temperature_degC)

    def _read(self, dt_s: float, temperature: float) -> PlantReadings:
        s, row, shafts = self.sensors, self._row, self._joint.drive.shafts
        noise = self._rng.standard_normal(5)
        joint = self._delayed(float(row[Q_OUT]))
        angles = np.array(
            [
                _counted(row[Q_IN] + s.motor_position_noise_rad * noise[0], s.motor_position_resolution_rad),
                _counted(
                    joint + s.joint_position_offset_rad + s.joint_position_noise_rad * noise[1],
                    s.joint_position_resolution_rad,
                ),
            ]
        )
        if self._last is not None:
            share = -math.expm1(-2 * math.pi * s.velocity_bandwidth_Hz * dt_s)
            self._velocity += share * ((angles - self._last) / dt_s - self._velocity)
        self._last = angles
        torque = s.joint_torque_gain * row[JOINT_NM] + s.joint_torque_offset_Nm
        motor = row[MOTOR_NM] + s.motor_torque_noise_Nm * noise[3]
        motor = _counted(motor, s.motor_torque_resolution_Nm)
        return PlantReadings(
            time_s=self.time_s,
            motor_position_rad=float(angles[0]),
            motor_velocity_rad_s=float(self._velocity[0]),
            joint_position_rad=float(angles[1]),
            joint_velocity_rad_s=float(self._velocity[1]),
            joint_torque_Nm=_counted(
                torque + s.joint_torque_noise_Nm * noise[2], s.joint_torque_resolution_Nm
            ),
            motor_torque_Nm=motor,
            motor_current_A=motor / self.motor.torque_constant_Nm_per_A,
            temperature_degC=temperature + s.temperature_noise_K * float(noise[4]),
            truth=PlantTruth(
                motor_position_rad=float(shafts["q"][0]),
                motor_velocity_rad_s=float(shafts["v"][0]),
                joint_position_rad=float(shafts["q"][self._joint.load_shaft]),
                joint_velocity_rad_s=float(shafts["v"][self._joint.load_shaft]),
                pulley_position_rad=float(row[PULLEY]),
                joint_torque_Nm=float(row[JOINT_NM]),
                load_path_Nm=float(row[PATH]),
                motor_torque_Nm=self._torque,
                contact_torque_Nm=float(shafts["contact_Nm"][self._joint.load_shaft]),
                tension_h_N=max(float(row[T_H]), 0.0),
                tension_l_N=max(float(row[T_L]), 0.0),
            ),
        )

    def _delayed(self, joint: float) -> float:
        """The joint angle as a late clock stamps it."""
        delay = self._joint.clock_delay_s
        if delay <= 0.0:
            return joint
        self._history.append((self.time_s, joint))
        times, values = zip(*self._history, strict=True)
        return float(np.interp(self.time_s - delay, times, values))


def _counted(value: float, resolution: float) -> float:
    return float(value) if resolution <= 0 else round(float(value) / resolution) * resolution


__all__ = ["Joint", "LinkSpec", "MotorSpec", "Plant", "PlantReadings", "PlantTruth"]
