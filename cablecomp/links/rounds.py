"""Drives that share frames: what is common to them goes out once a cycle, when the last of them was commanded."""

from __future__ import annotations

from typing import Generic, TypeVar

Part = TypeVar("Part")


class Round(Generic[Part]):
    """Learns which drives are commanded in a cycle, since a run may leave some of a bus's joints alone.

    A drive that comes up again begins a new cycle; its drives are those of the cycle before. In the first one
    everybody is taken for the last.
    """

    __slots__ = ("_before", "_parts")

    def __init__(self) -> None:
        self._before: set[int] = set()
        self._parts: dict[int, Part] = {}

    def gather(self, node: int, part: Part) -> dict[int, Part] | None:
        """Note what `node` has to say in this cycle; everybody's part if nobody else is to come, else None."""
        if node in self._parts:
            self._before, self._parts = set(self._parts), {}
        self._parts[node] = part
        return self._parts if self._parts.keys() >= self._before else None
