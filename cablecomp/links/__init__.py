"""Joints on CAN buses and serial lines: frames without I/O, ports that read cheaply, devices, the link that joins them.

Imports configuration, signals and errors. Start reading at `link.py`; a protocol is a pair such as `mit.py` (bytes)
and `device_mit.py` (what the loop asks of it).
"""

from cablecomp.links.link import BusLink, Link, LinkStatus
from cablecomp.links.load import load_link, parse_link
from cablecomp.links.readings import Age, JointReadings, MessageStats
from cablecomp.links.records import (
    CHANNELS,
    BusState,
    DriveState,
    Mode,
    MotorCommand,
    Request,
    clip_names,
)
from cablecomp.links.schema import LinkConfig, Timeouts

__all__ = [
    "CHANNELS",
    "Age",
    "BusLink",
    "BusState",
    "DriveState",
    "JointReadings",
    "Link",
    "LinkConfig",
    "LinkStatus",
    "MessageStats",
    "Mode",
    "MotorCommand",
    "Request",
    "Timeouts",
    "clip_names",
    "load_link",
    "parse_link",
]
