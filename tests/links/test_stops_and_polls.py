"""What a link makes of a bus that takes only some of its frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cablecomp.links import BusLink, BusState, MotorCommand
from cablecomp.links.load import load_link
from cablecomp.links.ports import PortBase, Sink
from cablecomp.links.records import NOT_TAKEN, REMOTE
from cablecomp.runtime.setup import same_joint

LINKS = Path(__file__).parents[2] / "configs/links"


class Tight(PortBase):
    """Takes what `takes` allows, and notes it."""

    def __init__(self, takes: Callable[[int, bytes], bool]) -> None:
        super().__init__()
        self.state = BusState.ACTIVE
        self.takes = takes
        self.taken: list[tuple[int, bytes]] = []

    def open(self) -> None:
        """Nothing to open."""

    def drain(self, sink: Sink, limit: int) -> int:
        return 0

    def send(self, identifier: int, data: bytes) -> bool:
        if not self.takes(identifier, data):
            return False
        self.taken.append((identifier, data))
        return True

    def dropped(self) -> int:
        return 0

    def close(self) -> None:
        """Nothing to close."""


@pytest.mark.parametrize("room", [1, 2, 3])
def test_a_bus_that_takes_few_frames_gets_the_stop_of_every_joint_in_turn(room: int) -> None:
    left = [0]

    def takes(identifier: int, data: bytes) -> bool:
        left[0] -= 1
        return left[0] >= 0

    port = Tight(takes)
    names = ("one", "two", "three")
    link = BusLink(same_joint(load_link(LINKS / "mit-virtual.toml"), names), port)
    told = []
    for _ in range(6):
        left[0] = room
        told.append(link.stop())
    assert {identifier for identifier, _ in port.taken} == {1, 2, 3}
    assert told == [room * (k + 1) >= 3 for k in range(6)]


def test_a_drive_that_is_commanded_again_has_to_be_told_again() -> None:
    open_to = [True]
    link = BusLink(load_link(LINKS / "mit-virtual.toml"), Tight(lambda identifier, data: open_to[0]))
    assert link.stop()
    link.send(0, MotorCommand(0.1))
    open_to[0] = False
    assert not link.stop()
    open_to[0] = True
    assert link.stop()


def test_a_command_is_taken_though_what_is_asked_along_with_it_is_not() -> None:
    config = load_link(LINKS / "odrive-v3-socketcan.toml")
    link = BusLink(config, Tight(lambda identifier, data: not identifier & REMOTE))
    assert not link.send(0, MotorCommand(0.1)) & NOT_TAKEN
    shut = BusLink(config, Tight(lambda identifier, data: bool(identifier & REMOTE)))
    assert shut.send(0, MotorCommand(0.1)) & NOT_TAKEN
