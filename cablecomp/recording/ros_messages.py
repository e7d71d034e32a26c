"""Rows as ROS 2 messages, on the topics and by the interface names of ros2_control's joint_state_broadcaster.

Plain CDR, little endian (OMG DDS-XTYPES 1.3, 7.4.1): what a ROS 2 subscriber gets, and `ros2 bag play` publishes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from math import nan
from typing import Final, NamedTuple

from cablecomp.recording.channels import OTHER

_TIME: Final = "builtin_interfaces/Time stamp\nstring frame_id\n"
_BAR: Final = "=" * 80
_HEADER: Final = (
    f"{_BAR}\nMSG: std_msgs/Header\n{_TIME}{_BAR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JOINT_STATES: Final = "/joint_states"
DYNAMIC_JOINT_STATES: Final = "/dynamic_joint_states"
TYPES: Final = {
    JOINT_STATES: (
        "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
        + _HEADER,
    ),
    DYNAMIC_JOINT_STATES: (
        "control_msgs/msg/DynamicJointState",
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
        f"{_HEADER}{'=' * 80}\nMSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n",
    ),
}
"""Topic -> message type, its definition."""
_KINDS: Final = ("position", "velocity", "effort")


class Interface(NamedTuple):
    """A state interface of ros2_control: of which part, and which of its quantities (SI units)."""

    part: str
    kind: str


_INTERFACES: Final = {
    "motor_position_rad": Interface("motor", "position"),
    "motor_velocity_rad_s": Interface("motor", "velocity"),
    "motor_torque_Nm": Interface("motor", "effort"),
    "motor_current_A": Interface("motor", "current"),
    "temperature_degC": Interface("motor", "temperature"),
    "joint_position_rad": Interface("joint", "position"),
    "joint_velocity_rad_s": Interface("joint", "velocity"),
    "joint_torque_Nm": Interface("joint", "effort"),
    "tension_h_N": Interface("cable_h", "force"),
    "tension_l_N": Interface("cable_l", "force"),
}


def interface_of(channel: str) -> Interface | None:
    """The interface that carries a channel; None for the time, which is the message's stamp."""
    if channel.startswith(OTHER):
        return Interface("other", channel.removeprefix(OTHER))
    return _INTERFACES.get(channel)


class RosRows:
    """Makes the messages of rows that have these channels."""

    def __init__(self, channels: Sequence[str]) -> None:
        found = {c: i for c in channels if (i := interface_of(c)) is not None}
        self._parts: dict[str, dict[str, str]] = {}
        for channel, (part, kind) in found.items():
            self._parts.setdefault(part, {})[kind] = channel
        self._moving = [part for part in ("joint", "motor") if part in self._parts]

    def messages(self, stamp_ns: int, row: Mapping[str, float]) -> dict[str, bytes]:
        """Topic -> bytes; NaN where a part has no such channel, as joint_state_broadcaster has it."""
        plain = _Cdr(stamp_ns).texts(self._moving)
        for kind in _KINDS:
            plain.numbers([row.get(self._parts[part].get(kind, ""), nan) for part in self._moving])
        full = _Cdr(stamp_ns).texts(self._parts).count(len(self._parts))
        for kinds in self._parts.values():
            full.texts(kinds).numbers([row[channel] for channel in kinds.values()])
        return {JOINT_STATES: plain.data, DYNAMIC_JOINT_STATES: full.data}


class _Cdr:
    """Bytes of one message that begins with a header; every number lies at a multiple of its size."""

    def __init__(self, stamp_ns: int) -> None:
        self._body = bytearray(struct.pack("<iI", *divmod(stamp_ns, 10**9)))
        self._text("")

    @property
    def data(self) -> bytes:
        return b"\x00\x01\x00\x00" + bytes(self._body)

    def count(self, number: int) -> _Cdr:
        self._align(4)
        self._body += struct.pack("<I", number)
        return self

    def texts(self, words: Iterable[str]) -> _Cdr:
        listed = list(words)
        self.count(len(listed))
        for word in listed:
            self._text(word)
        return self

    def numbers(self, values: Sequence[float]) -> _Cdr:
        self.count(len(values))
        if values:
            self._align(8)
            self._body += struct.pack(f"<{len(values)}d", *values)
        return self

    def _text(self, word: str) -> None:
        data = word.encode() + b"\0"
        self.count(len(data))
        self._body += data

    def _align(self, size: int) -> None:
        self._body += bytes(-len(self._body) % size)
