"""Parameters of the simulated ODrive that RxSdo (0x04) reads and writes, by their endpoint numbers.

Numbers, names and types are those of firmware 0.6.10's endpoint list (`flat_endpoints.json`), of which only what
the simulation knows is here; the list differs from version to version, so clients check Get_Version first.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import NamedTuple

from firmware_sim.firmware import Drive

TURN = 2.0 * math.pi


class Endpoint(NamedTuple):
    """One parameter: name, struct format, how to read it and, unless it is read-only, how to write it."""

    name: str
    format: str
    read: Callable[[Drive], float]
    write: Callable[[Drive, float], None] | None = None


def _shaping(name: str, field: str, scale: float) -> Endpoint:
    return Endpoint(
        f"axis0.{name}",
        "f",
        lambda drive: getattr(drive.shaper.config, field) / scale,
        lambda drive, value: setattr(drive.shaper.config, field, value * scale),
    )


def _velocity_limit(drive: Drive, value: float) -> None:
    drive.set_limits(velocity_rad_s=value * TURN)


ENDPOINTS: dict[int, Endpoint] = {
    182: Endpoint("axis0.pos_estimate", "f", lambda d: d.position_rad / TURN),
    183: Endpoint("axis0.vel_estimate", "f", lambda d: d.velocity_rad_s / TURN),
    200: Endpoint("axis0.config.watchdog_timeout", "f", lambda d: d.config.command_timeout_s),
    201: Endpoint("axis0.config.enable_watchdog", "?", lambda d: d.config.command_timeout_s > 0.0),
    367: Endpoint("axis0.controller.input_pos", "f", lambda d: d.setpoint.position_rad / TURN),
    368: Endpoint("axis0.controller.input_vel", "f", lambda d: d.setpoint.velocity_rad_s / TURN),
    369: Endpoint("axis0.controller.input_torque", "f", lambda d: d.setpoint.torque_Nm),
    374: Endpoint("axis0.controller.trajectory_done", "?", lambda d: d.shaper.trajectory_done),
    383: Endpoint("axis0.controller.config.input_mode", "B", lambda d: d.shaper.mode),
    384: Endpoint(
        "axis0.controller.config.pos_gain",
        "f",
        lambda d: d.config.position_gain_per_s,
        lambda d, v: d.set_gains(position=v),
    ),
    385: Endpoint(
        "axis0.controller.config.vel_gain",
        "f",
        lambda d: d.config.velocity_gain_Nms_per_rad * TURN,
        lambda d, v: d.set_gains(velocity=v / TURN),
    ),
    386: Endpoint(
        "axis0.controller.config.vel_integrator_gain",
        "f",
        lambda d: d.config.velocity_integrator_Nm_per_rad * TURN,
        lambda d, v: d.set_gains(integrator=v / TURN),
    ),
    388: Endpoint(
        "axis0.controller.config.vel_limit",
        "f",
        lambda d: d.config.velocity_limit_rad_s / TURN,
        _velocity_limit,
    ),
    390: _shaping("controller.config.vel_ramp_rate", "velocity_ramp_rad_s2", TURN),
    391: _shaping("controller.config.torque_ramp_rate", "torque_ramp_Nm_s", 1.0),
    400: _shaping("controller.config.inertia", "inertia_Nms2_per_rad", 1.0 / TURN),
    401: _shaping("controller.config.input_filter_bandwidth", "filter_bandwidth_per_s", 1.0),
    416: _shaping("trap_traj.config.vel_limit", "trajectory_velocity_rad_s", TURN),
    417: _shaping("trap_traj.config.accel_limit", "trajectory_acceleration_rad_s2", TURN),
    418: _shaping("trap_traj.config.decel_limit", "trajectory_deceleration_rad_s2", TURN),
    618: Endpoint("spi_encoder0.raw", "f", lambda d: d.report().second_position_rad / TURN % 1.0),
    442: Endpoint("axis0.pos_vel_mapper.pos_rel", "f", lambda d: d.position_rad / TURN),
    444: Endpoint("axis0.pos_vel_mapper.vel", "f", lambda d: d.velocity_rad_s / TURN),
}
READ, WRITE = 0, 1
_HEAD = struct.Struct("<BHB")


def serve(data: bytes, drive: Drive) -> bytes | None:
    """Do what an RxSdo frame asks: the payload of the TxSdo that answers a read, None for a write (firmware
    before 0.6.11 confirms none) and for what this drive does not have."""
    opcode, number, _ = _HEAD.unpack_from(data)
    endpoint = ENDPOINTS.get(number)
    if endpoint is None:
        return None
    if opcode == READ:
        raw = endpoint.read(drive)
        value = raw if endpoint.format == "f" else int(raw)
        return (_HEAD.pack(0, number, 0) + struct.pack("<" + endpoint.format, value)).ljust(8, b"\x00")
    size = struct.calcsize("<" + endpoint.format)
    if opcode == WRITE and endpoint.write is not None and len(data) >= 4 + size:
        (value,) = struct.unpack_from("<" + endpoint.format, data, 4)
        if math.isfinite(value):
            endpoint.write(drive, value)
    return None
