"""What a run needs of a simulated joint on the other side of its link; who makes one is the caller's
business.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from cablecomp.control.options import ControlConfig
from cablecomp.links.schema import LinkConfig


class TruthLike(Protocol):
    """What the simulated joint really does."""

    @property
    def joint_position_rad(self) -> float:
        """Joint angle."""

    @property
    def joint_torque_Nm(self) -> float:
        """External moment on the output pulley."""


class Simulation(Protocol):
    """Simulated joints 1…n behind the bus that a link names."""

    @property
    def terminal(self) -> str | None:
        """The pseudo-terminal that stands for the link's serial line or slcan adapter; None on other buses."""

    def set_load(self, number: int, torque_Nm: float) -> None:
        """External torque on the link of a joint, along +q_out, from now on."""

    def set_wall(self, number: int, position_rad: float | None) -> None:
        """Put a wall at a joint angle, met from below, or take it away."""

    def advance(self, periods: int = 1) -> None:
        """Take that many periods, the first one for the commands that were sent."""

    def truth(self, number: int) -> TruthLike:
        """What a joint really does, at the end of its last step."""

    def close(self) -> None:
        """End it."""


class SimulationWish(NamedTuple):
    """What is to be simulated: the link it sits behind, how many joints, motor and output link, whether
    the true parameters lie off the nominal ones (drawn from `seed` within their tolerance), faults as
    text.
    """

    link: LinkConfig
    control: ControlConfig
    joints: int = 1
    off_nominal: bool = True
    seed: int = 0
    faults: tuple[str, ...] = ()


SimulationFactory = Callable[[SimulationWish], Simulation]
