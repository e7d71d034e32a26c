"""The other end of the simulated joint's wire: what a master sends to a drive, what it reads of the sensor node."""

from __future__ import annotations

import math
import struct

from firmware_sim.firmware import Sample, SensorFlag, Setpoint, Status
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.mit import MitModel, to_uint


def encode_command(model: MitModel, target: Setpoint) -> bytes:
    """The eight bytes of a command to an MIT drive."""
    bits = to_uint(target.position_rad, -model.position, model.position, 16)
    bits = bits << 12 | to_uint(target.velocity_rad_s, -model.velocity, model.velocity, 12)
    bits = bits << 12 | to_uint(target.kp_Nm_per_rad, 0.0, model.kp, 12)
    bits = bits << 12 | to_uint(target.kd_Nms_per_rad, 0.0, model.kd, 12)
    bits = bits << 12 | to_uint(target.torque_Nm, -model.torque, model.torque, 12)
    return bits.to_bytes(8, "big")


def read_state(frame: Frame) -> Sample:
    """Inverse of `state_frame`."""
    (angle,) = struct.unpack_from("<i", frame.data)
    torque = int.from_bytes(frame.data[4:7], "little", signed=True)
    return Sample(from_raw(angle, 1e-6, 32), from_raw(torque, 1e-5, 24), frame.data[7])


def read_status(frame: Frame) -> Status:
    """Inverse of `status_frame`."""
    time_us, temperature, flags, sequence = struct.unpack("<IhBB", frame.data)
    return Status(time_us, from_raw(temperature, 0.01, 16), SensorFlag(flags), sequence)


def from_raw(raw: int, scale: float, bits: int) -> float:
    """A value out of its signed integer; the lowest one says that there is none."""
    return math.nan if raw == -(1 << (bits - 1)) else raw * scale
