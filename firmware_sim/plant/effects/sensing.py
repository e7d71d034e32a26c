"""Effects between the output pulley and the channels: compliances, clearance, clocks, and sensors with
errors of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_sim.plant.assembly import Build
from firmware_sim.plant.effects.base import EffectKind, Parameter


def _readout(**fields: str) -> Callable[[Build, Mapping[str, float]], None]:
    """Copy parameters into fields of the readout record."""

    def apply(build: Build, p: Mapping[str, float]) -> None:
        for name, parameter in fields.items():
            build.readout[name] = p[parameter]

    return apply


def _compliance(build: Build, p: Mapping[str, float]) -> None:
    if build.dynamic:
        build.extra_compliance += p["compliance_rad_per_Nm"]
    else:
        build.readout["compliance"] += p["compliance_rad_per_Nm"]


SERIES_COMPLIANCE = EffectKind(
    "series_compliance",
    "Torque sensor, coupling or mount yields between output pulley and joint encoder: + c_s M.",
    (Parameter("compliance_rad_per_Nm", "c_s", low=0.0),),
    ("load",),
    _compliance,
)


def _backlash(build: Build, p: Mapping[str, float]) -> None:
    if build.dynamic:
        build.gap_rad += p["gap_rad"]
    else:
        build.readout["gap"] += p["gap_rad"]


TERMINATION_BACKLASH = EffectKind(
    "termination_backlash",
    "A key or crimp has clearance b: the joint lies at +b/2 or −b/2 by the sign of the moment in the load "
    "path, and stays where it lay while there is none.",
    (Parameter("gap_rad", "b, total clearance", low=0.0, high=0.5),),
    ("load",),
    _backlash,
)


def _clock(build: Build, p: Mapping[str, float]) -> None:
    build.clock_delay_s = p["delay_s"]


CLOCK_SKEW = EffectKind(
    "clock_skew",
    "The joint encoder is stamped late: joint(t) = joint_true(t − Δ).",
    (Parameter("delay_s", "Δ, positive or negative", low=-1.0, high=1.0),),
    ("velocity",),
    _clock,
)

CREEPING_MOUNT = EffectKind(
    "creeping_mount",
    "A plastic mount creeps under load (Kelvin–Voigt): x + t_c ẋ = c M is added to the joint angle.",
    (
        Parameter("compliance_rad_per_Nm", "c", low=0.0),
        Parameter("time_constant_s", "t_c", 1.0, 1e-6),
    ),
    ("dwell", "load_rate"),
    _readout(mount_compliance="compliance_rad_per_Nm", mount_time_s="time_constant_s"),
    listed=False,
    nearest=("viscous_slip", "series_compliance"),
)

STIFFENING_MOUNT = EffectKind(
    "stiffening_mount",
    "A mount yields until it is bottomed out: c M_s tanh(M/M_s) is added to the joint angle.",
    (
        Parameter("compliance_rad_per_Nm", "c", low=0.0),
        Parameter("saturation_Nm", "M_s", low=1e-9),
    ),
    ("load",),
    _readout(bend_compliance="compliance_rad_per_Nm", mount_yield_Nm="saturation_Nm"),
    listed=False,
    nearest=("series_compliance", "nonlinear_cable"),
)

FRAME_FLEX = EffectKind(
    "frame_flex",
    "A neighbouring joint bends the frame that carries the joint encoder: + c · other_1.",
    (Parameter("compliance_rad_per_unit", "c, rad per unit of channel other_1"),),
    ("other:1",),
    _readout(flex_compliance="compliance_rad_per_unit"),
    listed=False,
    nearest=("crosstalk",),
)

JOINT_ENCODER_RIPPLE = EffectKind(
    "joint_encoder_ripple",
    "The joint encoder's own division error: + a sin(n q + φ), second harmonic by default (disc out of "
    "flat).",
    (
        Parameter("amplitude_rad", "a", low=0.0, high=0.5),
        Parameter("order", "n", 2.0, 0.1, 1e5),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("joint_angle", "motor_angle"),
    _readout(joint_ripple="amplitude_rad", joint_ripple_order="order", joint_ripple_phase="phase_rad"),
    listed=False,
    nearest=("pulley_runout",),
)

MOTOR_ENCODER_RIPPLE = EffectKind(
    "motor_encoder_ripple",
    "The motor encoder's interpolation error: + a sin(n q_in + φ).",
    (
        Parameter("amplitude_rad", "a", low=0.0, high=0.5),
        Parameter("order", "n, periods per revolution", 7.0, 0.1, 1e5),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("motor_angle",),
    _readout(motor_ripple="amplitude_rad", motor_ripple_order="order", motor_ripple_phase="phase_rad"),
    listed=False,
    nearest=("pulley_runout",),
)

TORQUE_SENSOR_QUADRATIC = EffectKind(
    "torque_sensor_quadratic",
    "The torque sensor is not linear: it shows M + k M².",
    (Parameter("coefficient_per_Nm", "k"),),
    ("load",),
    _readout(torque_square="coefficient_per_Nm"),
    listed=False,
    nearest=("series_compliance", "nonlinear_cable"),
)

TORQUE_SENSOR_HYSTERESIS = EffectKind(
    "torque_sensor_hysteresis",
    "The torque sensor's adhesive holds back: a share of its signal follows the load through a play.",
    (
        Parameter("fraction", "share", low=0.0, high=1.0),
        Parameter("width_Nm", "radius of the play", low=0.0),
    ),
    ("load_direction", "reversal"),
    _readout(torque_play_share="fraction", torque_play_Nm="width_Nm"),
    listed=False,
    nearest=("strand_friction", "bearing_friction"),
)

TORQUE_SENSOR_DRIFT = EffectKind(
    "torque_sensor_drift",
    "The torque sensor's zero follows the temperature: + k (ϑ − ϑ_ref).",
    (
        Parameter("coefficient_Nm_per_K", "k"),
        Parameter("reference_degC", "ϑ_ref", 20.0),
    ),
    ("temperature",),
    _readout(torque_per_K="coefficient_Nm_per_K", torque_ref="reference_degC"),
    listed=False,
    nearest=("thermal_pretension",),
)

MOTOR_TORQUE_COGGING = EffectKind(
    "motor_torque_cogging",
    "The motor cogs: its torque channel carries + a sin(n q_in + φ).",
    (
        Parameter("amplitude_Nm", "a", low=0.0),
        Parameter("order", "n", 14.0, 0.1, 1e4),
        Parameter("phase_rad", "φ", 0.0),
    ),
    ("motor_angle",),
    _readout(cog_Nm="amplitude_Nm", cog_order="order", cog_phase="phase_rad"),
    listed=False,
    nearest=("motor_friction",),
)

KINDS = (
    SERIES_COMPLIANCE,
    TERMINATION_BACKLASH,
    CLOCK_SKEW,
    CREEPING_MOUNT,
    STIFFENING_MOUNT,
    FRAME_FLEX,
    JOINT_ENCODER_RIPPLE,
    MOTOR_ENCODER_RIPPLE,
    TORQUE_SENSOR_QUADRATIC,
    TORQUE_SENSOR_HYSTERESIS,
    TORQUE_SENSOR_DRIFT,
    MOTOR_TORQUE_COGGING,
)
