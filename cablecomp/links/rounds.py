"""Drives that share frames: what is common to all of them goes out once a cycle, when the last of them has been
commanded."""

from __future__ import annotations


class Round:
    """Learns which drives are commanded in a cycle, since a run may leave some of a bus's joints alone.

    A drive that comes up again begins a new cycle; its drives are those of the cycle before. In the first one
    everybody is taken for the last.
    """

    __slots__ = ("_before", "_seen")

    def __init__(self) -> None:
        self._before: set[int] = set()
        self._seen: set[int] = set()

    def closes(self, node: int) -> bool:
        """Note that `node` has been commanded; True = nobody else is to come in this cycle."""
        if node in self._seen:
            self._before, self._seen = self._seen, {node}
        else:
            self._seen.add(node)
        return self._seen >= self._before
