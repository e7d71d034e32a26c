"""What several of these files compare with."""

from __future__ import annotations

import pytest
from plant_effect_course import play

from firmware_sim.plant import PlantRun


@pytest.fixture(scope="session")
def plain() -> PlantRun:
    """The plant's course without any effect."""
    return play(None)
