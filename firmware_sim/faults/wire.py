"""Faults of frames on the way: dropped, late, repeated, reordered, corrupted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from firmware_sim.errors import SimError
from firmware_sim.faults.base import Fault
from firmware_sim.wire.frame import Frame

DIRECTIONS = ("tx", "rx", "both")


class Timed(NamedTuple):
    """A frame and the time (s) at which it goes on."""

    at_s: float
    frame: Frame


@dataclass
class WireFault(Fault):
    """Acts with probability `p` on each frame: `tx` from the devices, `rx` to them; on identifiers that
    match `id` under `mask`."""

    p: float = 1.0
    direction: str = "both"
    id: int = 0
    mask: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.direction not in DIRECTIONS:
            raise SimError(f"fault: direction {self.direction!r}; one of {', '.join(DIRECTIONS)} is accepted")
        if not 0.0 <= self.p <= 1.0:
            raise SimError(f"fault: p = {self.p}; 0 to 1 is accepted")
        if self.id and not self.mask:
            self.mask = 0x1FFF_FFFF

    def concerns(self, frame: Frame, direction: str, now_s: float) -> bool:
        """Whether this frame is hit."""
        if not self.active(now_s) or self.direction not in (direction, "both"):
            return False
        return (frame.identifier & self.mask) == (self.id & self.mask) and self.chance(self.p)

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """What goes on instead of a frame that was to go on at `at_s`."""
        raise NotImplementedError  # each fault has its own


@dataclass
class Drop(WireFault):
    """The frame is lost."""

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """Nothing goes on."""
        return []


@dataclass
class Late(WireFault):
    """The frame arrives `delay` s later, ± `jitter`."""

    delay: float = 0.01
    jitter: float = 0.0

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """The same frame, later."""
        return [Timed(at_s + max(self.delay + self.rng.uniform(-self.jitter, self.jitter), 0.0), frame)]


@dataclass
class Repeat(WireFault):
    """The frame arrives `times` times more, `gap` s apart."""

    times: int = 1
    gap: float = 0.0

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """The frame and its copies."""
        return [Timed(at_s + k * self.gap, frame) for k in range(self.times + 1)]


@dataclass
class Reorder(WireFault):
    """Each frame waits up to `spread` s, so that frames overtake each other."""

    spread: float = 0.003

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """The frame after a wait by chance."""
        return [Timed(at_s + self.rng.uniform(0.0, self.spread), frame)]


@dataclass
class Corrupt(WireFault):
    """`bits` bits of the data are flipped, unseen by the bus's own check."""

    bits: int = 1

    def change(self, frame: Frame, at_s: float) -> list[Timed]:
        """The frame with flipped bits."""
        data = bytearray(frame.data)
        for _ in range(self.bits if data else 0):
            bit = self.rng.randrange(8 * len(data))
            data[bit // 8] ^= 1 << bit % 8
        return [Timed(at_s, frame._replace(data=bytes(data)))]
