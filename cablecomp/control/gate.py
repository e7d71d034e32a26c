"""The last gate before hardware: pure, without bypass. Nothing else makes a `SafeCommand`, and links are
given nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Final, NamedTuple

from cablecomp.config import Limits
from cablecomp.control.command import Command
from cablecomp.errors import InputError

NOT_FINITE: Final = 1
POSITION_LIMITED: Final = 2
VELOCITY_LIMITED: Final = 4
TORQUE_LIMITED: Final = 8
RATE_LIMITED: Final = 16
STALE: Final = 32
FAR_FROM_MOTOR: Final = 64
MUST_STOP: Final = NOT_FINITE | STALE

_NAMES: Final = (
    "not finite",
    "position limit",
    "velocity limit",
    "torque limit",
    "rate limit",
    "stale",
    "far from the motor",
)


def gate_names(flags: int) -> tuple[str, ...]:
    """Words for the flags of a gated command."""
    return tuple(name for bit, name in enumerate(_NAMES) if flags >> bit & 1)


@dataclass(frozen=True)
class GateLimits:
    """What may pass: magnitudes, rates of change between two commands, greatest distance of target from
    motor, greatest age.

    Position target rate in rad/s, torque feed-forward rate in Nm/s; `age_s` is that of the motor position.
    """

    position_min_rad: float = -inf
    position_max_rad: float = inf
    velocity_max_rad_s: float = 40.0
    torque_max_Nm: float = inf
    position_rate_rad_s: float = 40.0
    torque_rate_Nm_s: float = inf
    lead_max_rad: float = 0.5
    age_s: float = 0.1

    def __post_init__(self) -> None:
        for name in ("velocity_max_rad_s", "torque_max_Nm", "position_rate_rad_s", "torque_rate_Nm_s"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"gate: {name} is {getattr(self, name)}; a number above 0 is accepted")
        if not (self.lead_max_rad > 0.0 and self.age_s > 0.0):
            raise InputError("gate: lead_max_rad and age_s must be above 0")
        if not self.position_min_rad < self.position_max_rad:
            raise InputError("gate: position_min_rad must lie below position_max_rad; exchange them")

    @classmethod
    def of(cls, limits: Limits, **more: float) -> GateLimits:
        """The joint's own limits, narrowed or completed by `more`."""
        found: dict[str, float] = {}
        if limits.motor_position_min_rad is not None:
            found["position_min_rad"] = limits.motor_position_min_rad
        if limits.motor_position_max_rad is not None:
            found["position_max_rad"] = limits.motor_position_max_rad
        if limits.motor_torque_max_Nm is not None:
            found["torque_max_Nm"] = limits.motor_torque_max_Nm
        if limits.motor_velocity_max_rad_s is not None:
            found["velocity_max_rad_s"] = limits.motor_velocity_max_rad_s
            found["position_rate_rad_s"] = limits.motor_velocity_max_rad_s
        return cls(**{**found, **more})


class SafeCommand(NamedTuple):
    """A motor command that has passed the gate, and what the gate had to do to it (0 = nothing)."""

    motor_position_rad: float
    motor_velocity_rad_s: float
    motor_torque_Nm: float
    flags: int


def gate(
    command: Command,
    before: SafeCommand,
    motor_position_rad: float,
    age_s: float,
    period_s: float,
    limits: GateLimits,
) -> SafeCommand:
    """Pass a command within the limits, cut to them where it is not.

    Not finite or stale: the command before is repeated with no velocity and no torque, and the flags
    hold a bit of `MUST_STOP`. Otherwise position is cut by rate, by distance from where the motor is
    (which may overrule the rate: it only takes force away), and last by magnitude; velocity and torque
    by magnitude, torque by rate. `age_s` is the age of `motor_position_rad`.
    """
    q, v, tau = command.motor_position_rad, command.motor_velocity_rad_s, command.motor_torque_Nm
    if not isfinite(q + v + tau + motor_position_rad):
        return SafeCommand(before.motor_position_rad, 0.0, 0.0, NOT_FINITE)
    if not age_s <= limits.age_s:
        return SafeCommand(before.motor_position_rad, 0.0, 0.0, STALE)
    flags = 0
    last = before.motor_position_rad
    even = _within(q, last, limits.position_rate_rad_s * period_s)
    if even != q:
        flags |= RATE_LIMITED
    near = _within(even, motor_position_rad, limits.lead_max_rad)
    if near != even:
        flags |= FAR_FROM_MOTOR
    q = near
    if q < limits.position_min_rad:
        q = limits.position_min_rad
    elif q > limits.position_max_rad:
        q = limits.position_max_rad
    if q != near:
        flags |= POSITION_LIMITED
    slow = _within(v, 0.0, limits.velocity_max_rad_s)
    if slow != v:
        flags |= VELOCITY_LIMITED
    weak = _within(tau, 0.0, limits.torque_max_Nm)
    if weak != tau:
        flags |= TORQUE_LIMITED
    gradual = _within(weak, before.motor_torque_Nm, limits.torque_rate_Nm_s * period_s)
    if gradual != weak:
        flags |= RATE_LIMITED
    return SafeCommand(q, slow, gradual, flags)


def _within(value: float, middle: float, reach: float) -> float:
    """The value, cut to middle +- reach."""
    if value > middle + reach:
        return middle + reach
    if value < middle - reach:
        return middle - reach
    return value
