"""What every drive protocol offers to the simulated joint."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple, Protocol

from firmware_sim.firmware import Drive
from firmware_sim.wire.frame import Frame


class Answer(Enum):
    """Which message a frame asks for; rendered after the step where time is stepped, at once in real time."""

    STATE = "state"
    STATUS = "status"
    ASKED = "asked"


class Heard(NamedTuple):
    """What came of a frame: the answers that it asks for, whether it is a command that steps stepped time, and
    whether the drive listens to other identifiers from now on."""

    answers: tuple[Answer, ...] = ()
    steps: bool = False
    moved: bool = False


class DriveWire(Protocol):
    """A drive protocol, device side: turns frames into what the drive is told, and the drive's report into
    frames."""

    def identifiers(self) -> Iterable[int]:
        """Identifiers of the frames that are meant for this drive, 29-bit ones marked `EXTENDED`, or
        `LAST_BYTE | n` for all that end in n."""
        ...

    def broadcasts(self) -> Iterable[int]:
        """Identifiers of the frames that are meant for every drive of this protocol."""
        ...

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Apply one frame to the drive."""
        ...

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """The frame that answers `frame`, from the drive's present report."""
        ...

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """Frames that are due by themselves at this sample."""
        ...

    def reset(self) -> None:
        """Power cycle."""
        ...
