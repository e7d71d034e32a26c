"""A link and, in the devices' place, a stock python-can client."""

from __future__ import annotations

import math
import struct
import tomllib
import uuid
from pathlib import Path

import can

from cablecomp.links import BusLink, parse_link
from cablecomp.links.records import EXTENDED

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
TURN = 2 * math.pi


class Rig:
    """A link and, on the same bus, a stock python-can client in the devices' place."""

    def __init__(self, name: str, change: dict[str, str] | None = None) -> None:
        text = (CONFIGS / name).read_text(encoding="utf-8")
        channel = uuid.uuid4().hex
        text = text.replace('interface = "socketcan" ', 'interface = "virtual" ')
        text = text.replace('channel = "can0"', 'channel = "cablecomp"')
        for old, new in {'channel = "cablecomp"': f'channel = "{channel}"', **(change or {})}.items():
            assert old in text
            text = text.replace(old, new, 1)
        self.link = BusLink(parse_link(tomllib.loads(text), name, CONFIGS))
        self.link.open()
        self.client = can.Bus(interface="virtual", channel=channel, ignore_config=True)

    def tell(self, identifier: int, data: bytes | str) -> None:
        payload = bytes.fromhex(data) if isinstance(data, str) else data
        number, extended = identifier & ~EXTENDED, bool(identifier & EXTENDED)
        self.client.send(can.Message(arbitration_id=number, is_extended_id=extended, data=payload))

    def heard(self) -> list[tuple[int, bytes]]:
        out = []
        while (message := self.client.recv(0)) is not None:
            extended = EXTENDED if message.is_extended_id else 0
            out.append((message.arbitration_id | extended, bytes(message.data)))
        return out

    def close(self) -> None:
        self.link.close()
        self.client.shutdown()


def joint_state(position_urad: int, torque_10uNm: int, sequence: int) -> bytes:
    return struct.pack("<i", position_urad) + struct.pack("<i", torque_10uNm)[:3] + bytes([sequence])


def joint_status(time_us: int, centi_degC: int, flags: int, sequence: int) -> bytes:
    return struct.pack("<IhBB", time_us, centi_degC, flags, sequence)
