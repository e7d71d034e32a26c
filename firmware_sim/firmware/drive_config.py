"""What a drive was built and set up for."""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_sim.errors import SimError
from firmware_sim.firmware.records import Mode


@dataclass(frozen=True)
class DriveConfig:
    """Parameters of the drive; angles and torques at the input pulley.

    `index_position_rad` is where the index of an incremental encoder lies (one a turn); None = absolute
    encoder, at home from the start. `timeout_faults`: a drive that hears nothing for `command_timeout_s` ends
    in a fault; False = it makes no torque until it hears again, as MIT firmware does. `calibrate_on_enable`:
    asked to enable before the index was found, the drive searches it first, then enables.
    `fault_damping_Nms_per_rad` brakes the motor in a fault (shorted windings); 0 lets it coast.
    `brake_Nm_per_rad` > 0: a holding brake of that stiffness, closed while the drive is neither enabled nor
    calibrating (damped by the same), as one-sided loads need it.
    """

    torque_limit_Nm: float = 18.0
    velocity_limit_rad_s: float = 50.0
    position_min_rad: float = -math.inf
    position_max_rad: float = math.inf
    command_timeout_s: float = 0.1
    timeout_faults: bool = True
    temperature_limit_degC: float = 90.0
    index_position_rad: float | None = None
    search_velocity_rad_s: float = 1.0
    search_range_rad: float = 2.0 * math.pi
    calibrate_on_enable: bool = True
    fault_damping_Nms_per_rad: float = 0.0
    brake_Nm_per_rad: float = 0.0
    position_gain_per_s: float = 20.0
    velocity_gain_Nms_per_rad: float = 0.05
    velocity_integrator_Nm_per_rad: float = 0.0
    mode: Mode = Mode.IMPEDANCE

    def __post_init__(self) -> None:
        for name in ("torque_limit_Nm", "velocity_limit_rad_s", "search_velocity_rad_s", "search_range_rad"):
            if not getattr(self, name) > 0.0:
                raise SimError(f"drive: {name} is {getattr(self, name)!r}; a number above 0 is accepted")
        if not self.position_min_rad < self.position_max_rad:
            raise SimError("drive: position_min_rad must lie below position_max_rad; exchange them")
