"""A drive and a sensor node written for these tests alone, and a listener that reads commands off the wire.

Nothing here comes from the code under test: bytes are packed and unpacked by the makers' manual (CubeMars AK
series V1.0.8, p. 49-52; AK80-9: +-12.5 rad, +-50 rad/s, +-18 Nm, kp 0…500, kd 0…5), the node's by the table
`cablecomp_joint.dbc`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import can

RATIO = 1.0 / 3.0  # the wrist's
POSITION_STEP, TORQUE_STEP = 25.0 / 65535, 36.0 / 4095
ENTER, LEAVE = b"\xff" * 7 + b"\xfc", b"\xff" * 7 + b"\xfd"


class Heard(NamedTuple):
    """One command as it stood on the wire; `word` "" = a command, else "enter", "leave", "zero"."""

    word: str
    position: float = math.nan
    velocity: float = math.nan
    kp: float = math.nan
    kd: float = math.nan
    torque: float = math.nan


AT_REST = Heard("", 0.0, 0.0, 0.0, 0.0, 0.0)


def decoded(data: bytes) -> Heard:
    """What eight bytes to the drive say."""
    if data[:7] == b"\xff" * 7 and data[7] >= 0xFC:
        return Heard({0xFC: "enter", 0xFD: "leave", 0xFE: "zero"}[data[7]])
    p = data[0] << 8 | data[1]
    v = data[2] << 4 | data[3] >> 4
    kp = (data[3] & 15) << 8 | data[4]
    kd = data[5] << 4 | data[6] >> 4
    t = (data[6] & 15) << 8 | data[7]
    return Heard(
        "",
        p * 25.0 / 65535 - 12.5,
        v * 100.0 / 4095 - 50.0,
        kp * 500.0 / 4095,
        kd * 5.0 / 4095,
        t * 36.0 / 4095 - 18.0,
    )


def reply(node: int, position: float, velocity: float = 0.0, torque: float = 0.0, error: int = 0) -> bytes:
    """Eight bytes of an answer at 30 degC."""
    p = round((min(max(position, -12.5), 12.5) + 12.5) * 65535 / 25.0)
    v = round((min(max(velocity, -50.0), 50.0) + 50.0) * 4095 / 100.0)
    t = round((min(max(torque, -18.0), 18.0) + 18.0) * 4095 / 36.0)
    return bytes([node, p >> 8, p & 255, v >> 4, (v & 15) << 4 | t >> 8, t & 255, 30, error])


class Truth(NamedTuple):
    joint_position_rad: float
    joint_torque_Nm: float = 0.0


@dataclass
class OnABus:
    """A joint on a bus that nothing loads; `tick`: periods that have gone by."""

    bus: can.BusABC
    angle: float = 0.0
    tick: int = 0
    terminal = None

    def set_load(self, number: int, torque_Nm: float) -> None:
        """No load."""

    def set_wall(self, number: int, position_rad: float | None) -> None:
        """No wall."""

    def truth(self, number: int) -> Truth:
        return Truth(self.angle * RATIO)


@dataclass
class MitJoint(OnABus):
    """Rotor (kg m2) behind an AK80-9 with number 1 that answers on identifier 0, and sensor node 1; it notes
    every frame it hears. `mute`: hears, says nothing; `tell`: what it makes of its own angle before saying it.
    """

    enabled: bool = False
    mute: bool = False
    inertia: float = 2e-3
    speed: float = 0.0
    torque: float = 0.0
    greatest_torque: float = 0.0
    last: Heard = AT_REST
    heard: list[Heard] = field(default_factory=list)
    ticks: list[int] = field(default_factory=list)
    tell: Callable[[float], float] = lambda angle: angle
    disturb: Callable[[MitJoint], None] | None = None
    period_s: float = 1e-3
    sequence: int = 0

    def advance(self, periods: int = 1) -> None:
        """One period: hear, answer, move, say where the joint is."""
        for _ in range(periods):
            self.tick += 1
            self.hear()
            self.move()
            self.say(0x680, struct.pack("<i", round(1e6 * self.angle * RATIO)) + bytes(3) + self.count())
            if self.disturb is not None:
                self.disturb(self)

    def count(self) -> bytes:
        self.sequence = (self.sequence + 1) % 256
        return bytes([self.sequence])

    def hear(self) -> None:
        while (message := self.bus.recv(0)) is not None:
            if message.arbitration_id != 1 or message.is_extended_id or len(message.data) != 8:
                continue
            heard = decoded(bytes(message.data))
            self.heard.append(heard)
            self.ticks.append(self.tick)
            if heard.word == "enter":
                self.enabled = True
            elif heard.word == "leave":
                self.enabled = False
            else:
                self.last = heard
            self.say(0, reply(1, self.tell(self.angle), self.speed, self.torque))

    def move(self) -> None:
        steps = round(self.period_s / 1e-4)
        for _ in range(steps):
            h = self.last
            self.torque = 0.0
            if self.enabled:
                pull = h.kp * (h.position - self.angle) + h.kd * (h.velocity - self.speed) + h.torque
                self.torque = min(max(pull, -18.0), 18.0)
            self.greatest_torque = max(self.greatest_torque, abs(self.torque))
            self.speed += 1e-4 * (self.torque - 1e-3 * self.speed) / self.inertia
            self.angle += 1e-4 * self.speed

    def say(self, identifier: int, data: bytes, **kind: bool) -> None:
        if not self.mute:
            self.bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data, **kind))

    def close(self) -> None:
        self.bus.shutdown()

    # ---- what the listener knows -----------------------------------------------------------------

    @property
    def commands(self) -> list[Heard]:
        """Commands alone, in order."""
        return [h for h in self.heard if not h.word]

    def words_before_first_command(self) -> list[str]:
        """Special frames until the first command."""
        first = next((k for k, h in enumerate(self.heard) if not h.word), len(self.heard))
        return [h.word for h in self.heard[:first]]
