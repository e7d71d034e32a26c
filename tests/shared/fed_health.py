"""The health watch fed by hand: readings come when they are given, in periods that are a power of two."""

from __future__ import annotations

from math import nan

from cablecomp.control.options import HealthOptions
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import (
    CHANNELS,
    JOINT_POSITION,
    JOINT_TORQUE,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    TEMPERATURE,
)
from cablecomp.runtime import health as h

FURTHER = len(CHANNELS)
"""Where further channels begin."""
PLACES = (
    ("motor", MOTOR_POSITION),
    ("torque", JOINT_TORQUE),
    ("joint", JOINT_POSITION),
    ("temperature", TEMPERATURE),
    ("other_0", FURTHER),
)
T = 1.0 / 1024.0
N = 0.25


def options(**more: float | None) -> HealthOptions:
    return HealthOptions(
        **{
            "motor_rate_rad_s": 64.0,
            "joint_rate_rad_s": 64.0,
            "torque_rate_Nm_s": 4096.0,
            "torque_max_Nm": 4.0,
            "joint_residual_rad": None,
            "torque_mismatch_Nm": None,
            "lead_rad": None,
            "stuck_rad": None,
            "shake_Nm": None,
            "confirm_s": 8.0 * T,
            **more,
        }
    )


class Fed:
    """Readings by hand; what is not given does not come."""

    def __init__(
        self, chosen: HealthOptions | None = None, count: int = 0, period_s: float = T, **needs: object
    ) -> None:
        self.readings = JointReadings("joint", tuple(f"other_{k}" for k in range(count)))
        chosen = options() if chosen is None else chosen
        self.health = h.Health(chosen, N, 2.5 * period_s, period_s, **needs)
        self.period_s = period_s
        self.k = 0

    def cycle(self, predicted: float = nan, target: float = nan, **came: float) -> h.Checked:
        self.k += 1
        now, r = self.k * self.period_s, self.readings
        for name, place in PLACES:
            if name in came:
                r.values[place], r.arrived_s[place] = came[name], now
                r.updates[place] += 1
        r.values[MOTOR_TORQUE] = came.get("motor_torque", nan)
        return self.health.check(r, now, predicted, target)


ALL = {"motor": 0.0, "torque": 0.0, "joint": 0.0}
