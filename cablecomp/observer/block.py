"""A block of samples: canonical channels into the kernel's readings, its answers into estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError
from cablecomp.mechanics.profile import Floats
from cablecomp.observer.rows import Answer, Readings, readings


def block_of(config: JointConfig, channels: Sequence[str], columns: Mapping[str, Floats]) -> Readings:
    """The readings of these columns; `channels`: the further ones that the joint's effects read.

    Raises InputError for a channel that is missing, or does not hold one number for each time.
    """
    time = _need(columns, "time_s")
    read = readings(len(time), len(channels))
    read.time[:] = time
    read.motor[:] = _need(columns, "motor_position_rad")
    source, sensors = config.observer.load, config.sensors
    if source == "motor_torque":
        read.load[:] = -(_need(columns, "motor_torque_Nm") - config.motor_zero_Nm) / config.drive.ratio
    elif source == "none":
        read.load[:] = sensors.joint_torque_offset_Nm
    elif source == "joint_torque":
        read.load[:] = _need(columns, "joint_torque_Nm")
    if "joint_position_rad" in columns:
        read.joint[:] = _need(columns, "joint_position_rad") - sensors.joint_position_offset_rad
    if "temperature_degC" in columns:
        read.temperature[:] = _need(columns, "temperature_degC")
    for k, name in enumerate(channels):
        read.other[:, k] = _need(columns, name)
    return read


def estimates(answer: Answer, low: Floats, high: Floats, rigid: Floats) -> dict[str, Floats]:
    """The answers as columns; `low`, `high`: bounds of the output pulley's angle, `rigid`: what it would be without
    any give [rad]."""
    shift = answer.joint - answer.drive - rigid
    return {
        "deflection_rad": answer.joint - rigid,
        "deflection_low_rad": low + shift,
        "deflection_high_rad": high + shift,
        "joint_position_rad": answer.joint,
        "joint_torque_Nm": answer.load,
        "tension_h_N": answer.tension_h,
        "tension_l_N": answer.tension_l,
        "tension_h_input_N": answer.tension_h_in,
        "tension_l_input_N": answer.tension_l_in,
        "predicted_motor_torque_Nm": answer.motor_torque,
    }


def _need(columns: Mapping[str, Floats], name: str) -> Floats:
    """A channel's values, one for each time."""
    if name not in columns:
        raise InputError(f"channel `{name}` is missing; the recording has {', '.join(sorted(columns))}")
    count = np.size(columns["time_s"])
    try:
        found = np.asarray(columns[name], dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"channel `{name}` holds what is no number; numbers are accepted") from None
    if found.shape != (count,):
        raise InputError(
            f"channel `{name}` has the shape {found.shape}; one value for each time is accepted: ({count},)"
        )
    return found
