"""From a drive about which nothing is known to one that holds its place: knowledge first, then force, little by
little.

Until a plausible, fresh reading of the very drive has lasted, nothing goes out but requests that take force
away. The first command is the measured position, without stiffness and torque; while the drive cannot pull,
the target follows the motor; once it is enabled the target stays, and stiffness grows to its own value.
"""

from __future__ import annotations

from math import isnan, nan
from typing import Final, NamedTuple

from cablecomp.control.command import Command
from cablecomp.control.gate import GateLimits, SafeCommand, first_command
from cablecomp.errors import InputError
from cablecomp.links.link import Link
from cablecomp.links.protocols import tells
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import (
    CHANNELS,
    CLIP_POSITION,
    JOINT_POSITION,
    JOINT_TORQUE,
    DriveState,
    Mode,
    Request,
)
from cablecomp.runtime.health import MOTOR_JUMP, Checked, health_names

TORQUE_S: Final = 0.02
"""How long the torque that balances an open circuit's pretension grows, before the drive is enabled."""
EASE_S: Final = 0.03
"""How long stiffness grows once the drive is enabled: short, since a brake has let go by then."""
ASK_AGAIN_S: Final = 0.05
_RECORDED: Final = (JOINT_POSITION, JOINT_TORQUE)
"""What a recording holds if it has come by the time that it begins."""


class _Shares(NamedTuple):
    torque: float
    stiffness: float


class TakingUp:
    """Takes one drive up. `why` says what kept it from being known last, `held` that it holds its place."""

    def __init__(
        self, link: Link, place: int, limits: GateLimits, fresh_s: float, preload_Nm: float, period_s: float
    ) -> None:
        self.why = "nothing has come yet"
        self._link, self._place, self._limits = link, place, limits
        ends = link.config.joint[place]
        self._told = tuple(p for p in _RECORDED if tells(link.config, ends, CHANNELS[p]))
        self._fresh_s = fresh_s
        self._preload_Nm = preload_Nm
        self._period_s = period_s
        self._asked_s = nan
        self._can_disable = True
        self._known_s = nan
        self._enable_s = nan
        self._shares = _Shares(1.0 if preload_Nm == 0.0 else 0.0, 0.0)
        self._eases = True

    @property
    def held(self) -> bool:
        """Whether the drive is enabled, with all of its stiffness."""
        return self._shares.stiffness >= 1.0

    @property
    def pulls(self) -> bool:
        """Whether the drive may be making force by now."""
        return self._enable_s == self._enable_s

    def enabling_s(self, now_s: float) -> float:
        """Time since the drive was asked to enable (NaN = it was not)."""
        return now_s - self._enable_s

    def known_s(self, now_s: float) -> float:
        """For how long the drive has been known (NaN = it is not)."""
        return now_s - self._known_s

    def unheard(self, readings: JointReadings) -> tuple[str, ...]:
        """Channels that the link tells and that have not come yet, where a message has not either (one that has may say
        that its sensor is absent): a recording that begins now is without them."""
        if all(message.received for message in readings.messages):
            return ()
        return tuple(CHANNELS[p] for p in self._told if isnan(readings.values[p]))

    def listen(self, readings: JointReadings, checked: Checked, now_s: float) -> None:
        """One cycle of listening: a drive left enabled is let go, one that says nothing by itself is asked."""
        link, place = self._link, self._place
        again = self._can_disable and readings.state is DriveState.ENABLED
        if self._asked_s != self._asked_s or (again and now_s - self._asked_s >= ASK_AGAIN_S):
            taken = link.request(place, Request.DISABLE)
            self._can_disable = taken is not None
            if taken is not False:  # what the bus did not take is asked again at once
                self._asked_s = now_s
        if checked.motor_age_s > 0.0:
            link.request(place, Request.REPORT)
        unknown = self._unknown(readings, checked)
        if unknown:
            self.why, self._known_s = unknown, nan
        elif self._known_s != self._known_s:
            self._known_s = now_s

    def _unknown(self, readings: JointReadings, checked: Checked) -> str:
        if not checked.ready:
            return "a channel that is needed has not come"
        if checked.flags & MOTOR_JUMP or max(checked.motor_age_s, checked.load_age_s) > self._fresh_s:
            return ", ".join(health_names(checked.flags)) or "data are old"
        if readings.saturated & CLIP_POSITION:
            return "motor position stands at the end of what its reply can carry; check its zero and range"
        if self._asked_s != self._asked_s:
            return "the bus did not take that the drive be let go"
        if self._can_disable and readings.state is DriveState.ENABLED:
            return "the drive stays enabled though it was asked to let go"
        try:
            first_command(checked.sample.motor_position_rad, self._limits)
        except InputError as error:
            return str(error)
        return ""

    def first(self, motor_position_rad: float) -> SafeCommand:
        """The first command, for a drive that has no stiffness now; raises InputError as `first_command`."""
        self._eases = self._link.ease(self._place, 0.0)
        return first_command(motor_position_rad, self._limits)

    def step(
        self, sent: SafeCommand, motor_position_rad: float, enabled: bool, mode: Mode, now_s: float
    ) -> Command:
        """One cycle of enabling: what to ask for now, before the gate. `sent`: the command before."""
        torque, stiffness = self._shares
        if torque < 1.0:
            torque = min(torque + self._period_s / TORQUE_S, 1.0)
        elif not self.pulls:
            self._link.request(self._place, Request.CLEAR_FAULTS, mode)
            if self._link.request(self._place, Request.ENABLE, mode) is not False:  # else it is asked again
                self._enable_s = now_s
        elif enabled and stiffness < 1.0:
            stiffness = min(stiffness + self._period_s / EASE_S, 1.0) if self._eases else 1.0
            if self._eases:
                self._link.ease(self._place, stiffness)
        self._shares = _Shares(torque, stiffness)
        free = stiffness == 0.0 if self._eases else not enabled
        target = motor_position_rad if free else sent.motor_position_rad
        return Command(target, 0.0, -self._preload_Nm * torque)
