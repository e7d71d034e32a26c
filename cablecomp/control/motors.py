"""A motor and a link that suit a joint, where no control file says which there are."""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

from cablecomp.config import JointConfig
from cablecomp.control.gate import GateLimits
from cablecomp.control.options import CompensatorOptions, ControlConfig, HealthOptions, MotorModel
from cablecomp.control.stiffness import greatest_load, stiffness_range

_LINK_HZ = 110.0
_DRIVE_HZ = 95.0
_DAMPING = 0.8
_SHAKE = 0.1
_FASTER = 1.5  # than a target may ever move: no motor that follows one does that
_YIELDS_RAD = 0.1  # in impedance mode, under the greatest load
_STIFFEST = 3000.0  # Nm/rad: about what drives can be told


class DriveGains(NamedTuple):
    """What a drive's own loop is told, at the input pulley."""

    stiffness_Nm_per_rad: float
    damping_Nms_per_rad: float


def control_for(config: JointConfig, stated: DriveGains | None = None) -> ControlConfig:
    """A control file made up: a link that swings at 110 Hz on the cable under a twentieth of the greatest load, a
    drive whose own loop has 95 Hz, or a motor that `stated` gains move well damped.

    Good for simulation and for a first look at a design; for hardware, state the real values.
    """
    ratio, load = config.drive.ratio, greatest_load(config)
    stiffness = stiffness_range(config, samples=80)
    inertia = float(stiffness.stiffness_Nm_per_rad[1]) / (2.0 * pi * _LINK_HZ) ** 2
    limit = config.limits.motor_torque_max_Nm
    torque = 3.0 * ratio * load if limit is None else limit
    rotor, swing = _rotor(2.0 * inertia * ratio**2, torque, config.sensors.motor_position_resolution_rad)
    if stated is not None:
        swing = 2.0 * _DAMPING * stated.stiffness_Nm_per_rad / stated.damping_Nms_per_rad
        rotor = stated.stiffness_Nm_per_rad / swing**2
    motor = MotorModel(
        inertia_kgm2=rotor,
        viscous_Nms_per_rad=0.02 * rotor * swing,
        coulomb_Nm=0.005 * torque,
        stiffness_Nm_per_rad=rotor * swing**2,
        damping_Nms_per_rad=2.0 * _DAMPING * rotor * swing,
        output_inertia_kgm2=inertia,
        output_viscous_Nms_per_rad=0.005 * inertia * 2.0 * pi * _LINK_HZ,
    )
    spring = min(load / _YIELDS_RAD, 0.2 * stiffness.low_Nm_per_rad)  # softer than the cable itself
    moved = inertia + rotor / ratio**2
    compensator = CompensatorOptions(
        impedance_stiffness_Nm_per_rad=spring,
        impedance_damping_Nms_per_rad=2.0 * _DAMPING * sqrt(spring * moved),
    )
    widest = float(abs(stiffness.deflection_rad).max())
    return ControlConfig(motor=motor, compensator=compensator, health=_health(config, motor, load, widest))


def _rotor(inertia_kgm2: float, torque_Nm: float, step_rad: float | None) -> tuple[float, float]:
    """Inertia [kg m2] of the motor and how fast its drive lets it swing [rad/s]; `step_rad`: its encoder's count."""
    swing = 2.0 * pi * _DRIVE_HZ
    if step_rad:
        # one count of a coarse encoder, seen through the drive's velocity filter, must not shake the motor
        most = _SHAKE * torque_Nm / (step_rad * 2.0 * pi * MotorModel().velocity_bandwidth_Hz)
        swing = min(swing, most / (2.0 * _DAMPING * inertia_kgm2))
    return min(inertia_kgm2, _STIFFEST / swing**2), swing


def _health(config: JointConfig, motor: MotorModel, load_Nm: float, widest_rad: float) -> HealthOptions:
    """What readings of such a joint can be, under its greatest load and deflection."""
    step = config.sensors.motor_position_resolution_rad or 0.0
    return HealthOptions(
        motor_rate_rad_s=_FASTER * GateLimits.of(config.limits).position_rate_rad_s,
        torque_rate_Nm_s=1000.0 * load_Nm,
        torque_max_Nm=2.0 * load_Nm,
        joint_residual_rad=2.0 * widest_rad,
        torque_mismatch_Nm=0.5 * load_Nm,
        stuck_rad=20.0 * motor.coulomb_Nm / motor.stiffness_Nm_per_rad + 50.0 * step + 0.002,
        shake_Nm=0.15 * load_Nm,
        lead_rad=max(0.2, 20.0 * widest_rad / config.drive.ratio),
    )
