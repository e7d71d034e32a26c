"""The last gate before hardware: pure, without bypass. Nothing else makes a `SafeCommand`, and links are
given nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, inf, isfinite
from typing import Any, Final, NamedTuple

from cablecomp.config import Limits
from cablecomp.control.command import Command
from cablecomp.errors import InputError
from cablecomp.signals import ANY_WIRE, Grid, Wire

NOT_FINITE: Final = 1
POSITION_LIMITED: Final = 2
VELOCITY_LIMITED: Final = 4
TORQUE_LIMITED: Final = 8
RATE_LIMITED: Final = 16
STALE: Final = 32
FAR_FROM_MOTOR: Final = 64
MUST_STOP: Final = NOT_FINITE | STALE
BRAKE_S: Final = 0.05
"""Within which a motor whose drive is not told a position has to come to rest before a limit of it."""

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
    `wire`: what the message can carry, so that the limits hold for what is read off the wire.
    `tells_position`: the drive is told a position; else its limits hold by where the motor is. `balance_Nm`: the torque
    under which the motor stays where it is, an open circuit's pretension held.
    """

    position_min_rad: float = -inf
    position_max_rad: float = inf
    velocity_max_rad_s: float = 40.0
    torque_max_Nm: float = inf
    position_rate_rad_s: float = 40.0
    torque_rate_Nm_s: float = inf
    lead_max_rad: float = 0.5
    age_s: float = 0.1
    wire: Wire = ANY_WIRE
    tells_position: bool = True
    balance_Nm: float = 0.0

    def __post_init__(self) -> None:
        for name in ("velocity_max_rad_s", "torque_max_Nm", "position_rate_rad_s", "torque_rate_Nm_s"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"gate: {name} is {getattr(self, name)}; a number above 0 is accepted")
        if not (self.lead_max_rad > 0.0 and self.age_s > 0.0):
            raise InputError("gate: lead_max_rad and age_s must be above 0")
        if not self.position_min_rad < self.position_max_rad:
            raise InputError("gate: position_min_rad must lie below position_max_rad; exchange them")
        if not _carries(self.wire.velocity, self.velocity_max_rad_s):
            raise InputError(
                "gate: the message carries no velocity within the limits; wire.velocity is wrong"
            )
        if not _carries(self.wire.torque, self.torque_max_Nm):
            raise InputError(
                f"gate: the message carries no torque within +-{self.torque_max_Nm:g} Nm; "
                "raise motor_torque_max_Nm, or give the drive a finer range"
            )

    @classmethod
    def of(
        cls, limits: Limits, wire: Wire = ANY_WIRE, *, tells_position: bool = True, **more: float
    ) -> GateLimits:
        """The joint's own limits and what the wire can carry, narrowed or completed by `more`."""
        own = {
            "position_min_rad": limits.motor_position_min_rad,
            "position_max_rad": limits.motor_position_max_rad,
            "torque_max_Nm": limits.motor_torque_max_Nm,
            "velocity_max_rad_s": limits.motor_velocity_max_rad_s,
            "position_rate_rad_s": limits.motor_velocity_max_rad_s,
        }
        known: dict[str, Any] = {k: v for k, v in own.items() if v is not None}
        made = cls(**{**known, **more})
        return replace(
            made,
            wire=wire,
            tells_position=tells_position,
            position_min_rad=max(made.position_min_rad, wire.position.low),
            position_max_rad=min(made.position_max_rad, wire.position.high),
            velocity_max_rad_s=min(made.velocity_max_rad_s, -wire.velocity.low, wire.velocity.high),
            torque_max_Nm=min(made.torque_max_Nm, -wire.torque.low, wire.torque.high),
        )


class SafeCommand(NamedTuple):
    """A motor command that has passed the gate, as the wire carries it, and what the gate had to do to it
    (0 = nothing).

    `spare_rad`, `spare_Nm`: on a wire whose step is coarser than one cycle's reach, the reach saved up
    since the last step.
    """

    motor_position_rad: float
    motor_velocity_rad_s: float
    motor_torque_Nm: float
    flags: int
    spare_rad: float = 0.0
    spare_Nm: float = 0.0


def first_command(motor_position_rad: float, limits: GateLimits) -> SafeCommand:
    """Where the motor is, without velocity and torque: what a drive is told before anything else.

    Raises InputError if the motor stands where no command may send it.
    """
    at = motor_position_rad
    low, high = limits.position_min_rad, limits.position_max_rad
    carried = _carried(at, low, high, limits.wire.position) if low <= at <= high else None
    if carried is None:
        raise InputError(
            f"the motor stands at {at:.4g} rad, outside of {low:.4g} … {high:.4g} rad; "
            "move it there by hand, or mend its zero or its limits"
        )
    velocity, torque = (_carried(0.0, -inf, inf, grid) or 0.0 for grid in limits.wire[1:])
    return SafeCommand(carried, velocity, torque, 0)


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
    hold a bit of `MUST_STOP`. Otherwise position is cut by distance from where the motor is, by magnitude,
    and last, so that nothing overrules it, by rate: `|q - q_before| <= rate period`, whatever the motor is
    said to be at; velocity and torque by magnitude, torque by rate. At a limit of position no velocity leads
    on: a drive follows it beyond, by its damping over its stiffness. A drive that is told no position gets
    no more velocity than brings it to the limit within `BRAKE_S`, and at it no torque that leads on, beyond
    what holds an open circuit's pretension. What
    comes out is what the wire carries, so all of it holds there. `before`: the last command that was sent;
    `age_s`: age of `motor_position_rad`.
    """
    q, v, tau = command.motor_position_rad, command.motor_velocity_rad_s, command.motor_torque_Nm
    if not isfinite(q + v + tau + motor_position_rad + before[0] + before[2]):
        return before._replace(motor_velocity_rad_s=0.0, motor_torque_Nm=0.0, flags=NOT_FINITE)
    if not age_s <= limits.age_s:
        return before._replace(motor_velocity_rad_s=0.0, motor_torque_Nm=0.0, flags=STALE)
    flags = 0
    near = _within(q, motor_position_rad, limits.lead_max_rad)
    if near != q:
        flags |= FAR_FROM_MOTOR
    low, high = limits.position_min_rad, limits.position_max_rad
    inside = low if near < low else high if near > high else near
    if inside != near:
        flags |= POSITION_LIMITED
    wire = limits.wire
    position, spare_rad, cut = _follow(
        inside, before[0], limits.position_rate_rad_s * period_s, before.spare_rad, low, high, wire.position
    )
    if cut:
        flags |= RATE_LIMITED
    fast, most = limits.velocity_max_rad_s, limits.torque_max_Nm
    slow, weak, up, down = _within(v, 0.0, fast), _within(tau, 0.0, most), fast, -fast
    if limits.tells_position:
        edge = wire[0][1]
        if position >= high - edge or motor_position_rad >= high:
            up = 0.0
        if position <= low + edge or motor_position_rad <= low:
            down = 0.0
    else:
        above, below = high - motor_position_rad, motor_position_rad - low
        up, down = min(max(above, 0.0) / BRAKE_S, fast), -min(max(below, 0.0) / BRAKE_S, fast)
        even = _within(limits.balance_Nm, 0.0, most)
        if (above <= 0.0 and weak > even) or (below <= 0.0 and weak < even):
            weak, flags = even, flags | POSITION_LIMITED
    if not down <= slow <= up:
        slow, flags = up if slow > up else down, flags | POSITION_LIMITED
    if slow != v:
        flags |= VELOCITY_LIMITED
    if weak != tau:
        flags |= TORQUE_LIMITED
    torque, spare_Nm, cut = _follow(
        weak, before[2], limits.torque_rate_Nm_s * period_s, before.spare_Nm, -most, most, wire.torque
    )
    if cut:
        flags |= RATE_LIMITED
    slow = _carried(slow, down, up, wire.velocity) or 0.0
    return SafeCommand(position, slow, torque, flags, spare_rad, spare_Nm)


def _follow(
    wanted: float, before: float, reach: float, spare: float, low: float, high: float, grid: Grid
) -> tuple[float, float, bool]:
    """The value nearest to `wanted` that lies within `reach` of the one before, and on the wire; what is left of the
    reach; whether it was cut."""
    step = grid.step
    coarse = step > reach
    reach += spare
    even = _within(wanted, before, reach)
    least, most = before - reach, before + reach
    carried = _carried(even, low if low > least else least, high if high < most else most, grid)
    value = before if carried is None else carried
    spare = min(reach - abs(value - before), step) if coarse else 0.0
    return value, spare, even != wanted


def _carries(grid: Grid, most: float) -> bool:
    """Whether the wire carries any value within +-most."""
    return _carried(0.0, -most, most, grid) is not None


def _carried(value: float, low: float, high: float, grid: Grid) -> float | None:
    """The value nearest to `value` that the wire carries within low…high; None if there is none."""
    origin, step, least, most = grid  # written out, as builtin functions take longer than the rest together
    low, high = least if least > low else low, most if most < high else high
    value = low if value < low else value
    value = high if value > high else value
    if step == 0.0:
        return value if low <= high else None
    edge = 1e-6 * step
    # ties go down, as on the wires themselves
    found = origin + step * ceil((value - origin) / step - 0.5 - 1e-9)
    if found > high + edge:
        found -= step
    elif found < low - edge:
        found += step
    return found if low - edge <= found <= high + edge else None


def _within(value: float, middle: float, reach: float) -> float:
    """The value, cut to middle +- reach."""
    if value > middle + reach:
        return middle + reach
    if value < middle - reach:
        return middle - reach
    return value
