"""Several joints on one port: frames in, frames out, time from the caller or one step for each command."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Literal

from firmware_sim.errors import SimError
from firmware_sim.joint import Asked, HeardFrame, SimulatedJoint
from firmware_sim.ports.base import Port
from firmware_sim.wire.frame import FD, LAST_BYTE, Frame
from firmware_sim.wire.tables import SYNC_ID

Stepping = Literal["command", "sync"]


class Bench:
    """Joints behind a port. `tick` follows the caller's time; `pump` advances by one sample for each
    stepping frame.

    Stepped by "command", a joint takes one sample period for each command to it; by "sync", all joints take
    one for each
    Sync frame. A step tells, in this order: sensor samples, cyclic frames, then the answers to what stepped
    it.
    """

    def __init__(self, port: Port, joints: Sequence[SimulatedJoint], stepping: Stepping = "command") -> None:
        self.port = port
        self.joints = tuple(joints)
        self.stepping = stepping
        self.steps = 0
        self._route: dict[int, tuple[SimulatedJoint, ...]] = {}
        self._connect()
        for identifier, heard_by in self._route.items():
            if len(heard_by) > 1 and any(identifier not in j.wire.broadcasts() for j in heard_by):
                names = " and ".join(str(j.number) for j in heard_by)
                raise SimError(f"joints {names} share 0x{identifier & 0x1FFF_FFFF:X}")

    def _connect(self) -> None:
        route: dict[int, list[SimulatedJoint]] = {}
        for joint in self.joints:
            for identifier in {*joint.wire.identifiers(), *joint.wire.broadcasts()}:
                route.setdefault(identifier, []).append(joint)
        self._route = {identifier: tuple(heard_by) for identifier, heard_by in route.items()}

    def _listeners(self, frame: Frame) -> tuple[SimulatedJoint, ...]:
        found = self._route.get(frame.key)
        if found is None and frame.extended:
            found = self._route.get(LAST_BYTE | frame.key & FD | frame.identifier & 0xFF)
        return found or ()

    def _hear(self, joint: SimulatedJoint, frame: Frame) -> HeardFrame:
        heard = joint.hear(frame)
        if heard.moved:
            self._connect()
        return heard

    @property
    def time_s(self) -> float:
        """Simulated time of the joint that is furthest."""
        return max(joint.time_s for joint in self.joints)

    def tick(self, now_s: float) -> None:
        """Follow the caller's time: hear what arrived, answer it, advance every joint to `now_s`."""
        out: list[Frame] = []
        for frame in self.port.poll(now_s):
            for joint in self._listeners(frame):
                out += joint.render(self._hear(joint, frame).asked)
        for joint in self.joints:
            out += joint.advance_to(now_s)
        if out:
            self.port.send(out, now_s)

    def pump(self, late: dict[int, list[Asked]] | None = None) -> int:
        """Stepped time: hear what arrived; returns the number of steps taken. `late` takes what is to be answered once
        the caller has stepped the joint, by its number; without it that is answered at once.
        """
        before = self.steps
        for frame in self.port.poll(self.time_s):
            if frame.identifier == SYNC_ID and self.stepping == "sync":
                self._step(self.joints, {})
                continue
            for joint in self._listeners(frame):
                heard = self._hear(joint, frame)
                if heard.steps and self.stepping == "command":
                    self._step((joint,), {joint.number: heard.asked})
                elif late is not None:
                    late.setdefault(joint.number, []).extend(heard.asked)
                else:
                    self.port.send(joint.render(heard.asked), self.time_s)
        return self.steps - before

    def _step(self, joints: Sequence[SimulatedJoint], asked: dict[int, list[Asked]]) -> None:
        self.steps += 1
        out: list[Frame] = []
        for joint in joints:
            out += joint.advance_sample()
            out += joint.render(asked.get(joint.number, ()))
        self.port.send(out, self.time_s)

    def close(self) -> None:
        """Close the port."""
        self.port.close()

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
