"""The sensor node's two messages (layout: `configs/links/cablecomp_joint.dbc`, Intel byte order).

JointN_State  0x680 + 2 (N-1): int32 angle in 1e-6 rad, int24 torque in 1e-5 Nm, uint8 sequence.
JointN_Status 0x681 + 2 (N-1): uint32 device time in us, int16 temperature in 0.01 degC, uint8 flags,
uint8 sequence.
The lowest value of a signed field means "no value".
"""

from __future__ import annotations

import struct

from firmware_sim.firmware import Sample, Status
from firmware_sim.wire.frame import Frame, to_raw
from firmware_sim.wire.tables import SENSOR_BASE, SENSOR_STRIDE


def state_frame(joint: int, sample: Sample) -> Frame:
    """JointN_State of joint 1, 2…"""
    torque = to_raw(sample.joint_torque_Nm, 1e-5, 24) & 0xFFFFFF
    data = struct.pack("<i", to_raw(sample.joint_position_rad, 1e-6, 32)) + torque.to_bytes(3, "little")
    return Frame(SENSOR_BASE + SENSOR_STRIDE * (joint - 1), data + bytes((sample.sequence,)))


def status_frame(joint: int, status: Status) -> Frame:
    """JointN_Status of joint 1, 2…"""
    temperature = to_raw(status.temperature_degC, 0.01, 16)
    data = struct.pack("<IhBB", status.device_time_us, temperature, status.error_flags, status.sequence)
    return Frame(SENSOR_BASE + 1 + SENSOR_STRIDE * (joint - 1), data)
