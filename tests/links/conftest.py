"""Links on buses of their own, closed after the test."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from link_rig import Rig


@pytest.fixture
def rigs() -> Iterator[Any]:
    made: list[Rig] = []

    def make(name: str, change: dict[str, str] | None = None) -> Rig:
        made.append(Rig(name, change))
        return made[-1]

    yield make
    for rig in made:
        rig.close()
