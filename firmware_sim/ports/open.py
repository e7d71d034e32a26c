"""A port from its name: `virtual[:CHANNEL]`, `udp_multicast[:GROUP[:PORT]]`, `slcan`, `serial`, `dynamixel`,
`INTERFACE:CHANNEL`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from firmware_sim.errors import SimError
from firmware_sim.ports.base import Port
from firmware_sim.ports.pty_port import DynamixelPort, SerialPort, SlcanPort

BUSES = (
    "virtual[:CHANNEL], udp_multicast[:GROUP[:PORT]], slcan, serial, dynamixel, "
    "or INTERFACE:CHANNEL of python-can"
)
GROUP, UDP_PORT = "239.74.163.2", 43113


def open_port(bus: str, link: Path | None = None, bitrate: int | None = None, *, fd: bool = False) -> Port:
    """Open a port; `link` names a pseudo-terminal, `bitrate` is for real interfaces, `fd` lets them carry FD
    frames. Raises SimError."""
    interface, _, rest = bus.partition(":")
    if interface == "slcan" and not rest:
        return SlcanPort(link)
    if interface == "serial" and not rest:
        return SerialPort(link)
    if interface == "dynamixel" and not rest:
        return DynamixelPort(link)
    return open_can(interface, rest, bitrate, fd=fd)


def open_can(interface: str, rest: str, bitrate: int | None = None, *, fd: bool = False) -> Port:
    """A python-can bus as a port."""
    import can  # slow to import, and pseudo-terminals do without

    from firmware_sim.ports.can_port import CanPort

    options: dict[str, Any] = {"interface": interface, "channel": rest}
    if interface == "virtual":
        options["channel"] = rest or "cablecomp"
    elif interface == "udp_multicast":
        group, _, port = rest.partition(":")
        # Hop limit 0: the frames never leave this computer.
        options |= {"channel": group or GROUP, "port": _udp_port(port), "hop_limit": 0, "fd": fd}
    elif not rest:
        raise SimError(f"bus {interface!r}: {BUSES} is accepted")
    else:
        options |= {"fd": True} if fd else {}
        options |= {"bitrate": bitrate} if bitrate is not None else {}
    try:
        bus = can.Bus(**options)
    except (can.CanError, OSError, ValueError, ImportError) as error:
        text = " ".join(str(error).split())
        raise SimError(f"bus {interface}:{options['channel']} cannot be opened: {text}") from None
    return CanPort(bus, options)


def _udp_port(text: str) -> int:
    if not text:
        return UDP_PORT
    if not text.isdigit() or not 1024 <= int(text) <= 65535:
        raise SimError(f"udp_multicast: port {text!r}; 1024 to 65535 is accepted")
    return int(text)
