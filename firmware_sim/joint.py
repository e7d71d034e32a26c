"""One simulated joint: plant, drive and sensor node behind their wires; time is the caller's."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from firmware_sim.errors import SimError
from firmware_sim.faults.device import DeviceFault, Node
from firmware_sim.firmware import Drive, DriveConfig, Gearbox, Request, SensorNode, SensorNodeConfig
from firmware_sim.plantlike import PlantLike, Readings, readings_of
from firmware_sim.wire.base import Answer, DriveWire
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.sensor import state_frame, status_frame


@dataclass(frozen=True)
class Timing:
    """Periods: of drive loop and plant (`step_s`), and of the sensor node (`steps_per_sample` of them)."""

    step_s: float = 5e-4
    steps_per_sample: int = 2
    catch_up_s: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0 < self.step_s <= 0.01 or self.steps_per_sample < 1:
            raise SimError(
                f"timing: step {self.step_s} s, {self.steps_per_sample} a sample; up to 0.01 s, 1 or more"
            )

    @property
    def sample_s(self) -> float:
        """Period of the sensor node."""
        return self.step_s * self.steps_per_sample


class Asked(NamedTuple):
    """An answer that a frame asked for."""

    answer: Answer
    frame: Frame


class HeardFrame(NamedTuple):
    """What came of a frame that the joint heard."""

    asked: list[Asked]
    steps: bool
    moved: bool = False


class SimulatedJoint:
    """Joint `number` (1, 2…): hears frames, advances in time, tells frames; holds no port and no clock."""

    def __init__(
        self,
        plant: PlantLike,
        wire: DriveWire,
        number: int = 1,
        drive: DriveConfig | None = None,
        sensor: SensorNodeConfig | None = None,
        timing: Timing | None = None,
        faults: Iterable[DeviceFault] = (),
        gearbox: Gearbox | None = None,
    ) -> None:
        self.number = number
        self.plant = plant
        self.wire = wire
        self.drive = Drive(DriveConfig() if drive is None else drive)
        self.node = SensorNode(SensorNodeConfig() if sensor is None else sensor)
        self.timing = Timing() if timing is None else timing
        self.gearbox = Gearbox() if gearbox is None else gearbox
        self.faults = tuple(f for f in faults if f.joint in (0, number))
        self.truth: Readings | None = None
        self.lost_s = 0.0
        self._steps = 0
        self._seen: Readings | None = None

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self._steps * self.timing.step_s + self.lost_s

    def hear(self, frame: Frame) -> HeardFrame:
        """Apply one frame to the drive; the answers are rendered by `render`, now or after a step."""
        if Node.DRIVE in self._silent():
            return HeardFrame([], False)
        heard = self.wire.hear(frame, self.drive, self.time_s)
        return HeardFrame([Asked(answer, frame) for answer in heard.answers], heard.steps, heard.moved)

    def render(self, asked: Iterable[Asked]) -> list[Frame]:
        """Frames that answer, from the drive's present report."""
        if Node.DRIVE in self._silent():
            return []
        frames = (self.wire.answer(a.answer, a.frame, self.drive) for a in asked)
        return [frame for frame in frames if frame is not None]

    def advance_to(self, now_s: float) -> list[Frame]:
        """Step until `now_s`; time that lies more than `catch_up_s` behind is skipped and counted in
        `lost_s`."""
        behind = now_s - self.time_s
        if behind > self.timing.catch_up_s:
            self.lost_s += behind - self.timing.catch_up_s
        frames: list[Frame] = []
        for _ in range(math.floor((now_s - self.time_s) / self.timing.step_s + 1e-6)):
            frames += self._step()
        return frames

    def advance_sample(self) -> list[Frame]:
        """Step through one period of the sensor node."""
        frames: list[Frame] = []
        for _ in range(self.timing.steps_per_sample):
            frames += self._step()
        return frames

    # ---- inside ----------------------------------------------------------------------------------

    def _step(self) -> list[Frame]:
        self._resets()
        command = 0.0
        if self._seen is not None:
            shaft = self.gearbox.at_shaft(self._seen)
            command = self.gearbox.at_pulley(self.drive.update(shaft, self.timing.step_s, self.time_s))
        for fault in self.faults:
            command = fault.torque(command, self.time_s)
        self.truth = readings_of(self.plant.step(self.timing.step_s, command))
        self._steps += 1
        seen = self.truth
        for fault in self.faults:
            seen = fault.sense(seen, self.time_s)
        self._seen = seen
        self.drive.observe(self.gearbox.at_shaft(seen))
        return self._publish(seen) if self._steps % self.timing.steps_per_sample == 0 else []

    def _publish(self, seen: Readings) -> list[Frame]:
        silent, frames = self._silent(), []
        sample, status = self.node.sample(seen, self.time_s)
        if Node.SENSOR not in silent:
            frames.append(state_frame(self.number, sample))
            if status is not None:
                frames.append(status_frame(self.number, status))
        if Node.DRIVE not in silent:
            frames += self.wire.cyclic(self.drive, self.time_s)
        return frames

    def _silent(self) -> Node:
        silent = Node.NONE
        for fault in self.faults:
            silent |= fault.silent(self.time_s)
        return silent

    def _resets(self) -> None:
        for fault in self.faults:
            nodes = fault.resets(self.time_s)
            if Node.DRIVE in nodes:
                self.drive.request(Request.RESET, self.time_s)
                self.wire.reset()
            if Node.SENSOR in nodes:
                self.node.reset(self.time_s)
