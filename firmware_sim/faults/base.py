"""What all faults have in common: when they act, and their own seeded chance."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from random import Random

from firmware_sim.errors import SimError


@dataclass
class Fault:
    """Acts from `start` until before `stop` (s, simulated time); `seed` fixes its chance."""

    start: float = 0.0
    stop: float = math.inf
    seed: int = 0
    rng: Random = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.start < self.stop:
            raise SimError(
                f"fault {type(self).__name__}: start {self.start} must lie before stop {self.stop}"
            )
        self.rng = Random(f"{type(self).__name__}:{self.seed}")

    def active(self, now_s: float) -> bool:
        """Whether it acts now."""
        return self.start <= now_s < self.stop

    def chance(self, probability: float) -> bool:
        """One throw."""
        return self.rng.random() < probability
