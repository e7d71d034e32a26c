"""An ODrive and a sensor node written for these tests alone.

Bytes by ODrive's CANSimple manual (https://docs.odriverobotics.com/v/latest/manual/can-protocol.html): heartbeat 0x01,
estop 0x02, Set_Axis_State 0x07, Get_Encoder_Estimates 0x09, Set_Input_Pos 0x0C, Get_Torques 0x1C; the node's by the
table `cablecomp_joint.dbc`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import can
from mit_joint import RATIO, OnABus

IDLE, CLOSED_LOOP = 1, 8
TURN = 2.0 * math.pi


@dataclass
class OdriveJoint(OnABus):
    """Axis 1, which takes `delay_s` to close its loop and then follows its input; it notes what it hears.

    `beats`: whether its heartbeats are heard; `tells`: a state that it tells in place of its own; `disturb`: called
    every period.
    """

    closed: bool = False
    delay_s: float = 0.0
    beats: bool = True
    tells: int | None = None
    disturb: Callable[[OdriveJoint], None] | None = None
    wanted: float | None = None
    asked: int | None = None
    closed_at: tuple[float, float | None] | None = None
    states: list[int] = field(default_factory=list)

    def advance(self, periods: int = 1) -> None:
        """One millisecond: hear, move, say where motor and joint are."""
        for _ in range(periods):
            self.tick += 1
            self.hear()
            if self.asked is not None and not self.closed and self.tick >= self.asked + 1e3 * self.delay_s:
                self.closed, self.closed_at = True, (self.angle, self.wanted)
            if self.disturb is not None:
                self.disturb(self)
            if self.closed and self.wanted is not None:
                self.angle += max(-0.02, min(0.02, 0.3 * (self.wanted - self.angle)))
            state = self.tells if self.tells is not None else CLOSED_LOOP if self.closed else IDLE
            if self.beats:
                self.say(0x01, struct.pack("<IB3x", 0, state))
            self.say(0x09, struct.pack("<ff", self.angle / TURN, 0.0))
            self.say(0x1C, struct.pack("<ff", 0.0, 0.0))
            joint = struct.pack("<i", round(1e6 * self.angle * RATIO)) + bytes(3) + bytes([self.tick % 256])
            self.bus.send(can.Message(arbitration_id=0x680, is_extended_id=False, data=joint))

    def hear(self) -> None:
        while (message := self.bus.recv(0)) is not None:
            if message.arbitration_id >> 5 != 1:
                continue
            command, data = message.arbitration_id & 31, bytes(message.data)
            if command == 0x07:
                self.states.append(data[0])
                self.asked = self.tick if data[0] == CLOSED_LOOP else None
                self.closed = self.closed and data[0] == CLOSED_LOOP
            elif command == 0x02:
                self.closed, self.asked = False, None
            elif command == 0x0C:
                self.wanted = struct.unpack("<fhh", data)[0] * TURN

    def say(self, command: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=1 << 5 | command, is_extended_id=False, data=data))
