"""A joint's drive that is a Damiao: the MIT frame, its registers, and its own position and velocity loops."""

from __future__ import annotations

from math import isfinite
from struct import Struct
from typing import Final

from cablecomp.errors import InputError
from cablecomp.links import damiao_registers as registers
from cablecomp.links.device_mit import MitDrive
from cablecomp.links.devices import Outgoing
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import DriveState, Frame, Mode, MotorCommand, Request
from cablecomp.links.schema import MotorEnd
from cablecomp.links.schema_devices import MitDevice
from cablecomp.signals import Wire

OTHER_RANGES: Final = 0x100
"""Error code of ours: the drive's PMAX, VMAX or TMAX is not the link's."""
UNTOLD_RANGES: Final = 0x101
"""Error code of ours: the drive was to be enabled before it had told what they are."""
_NAMES: Final = {registers.PMAX: "PMAX", registers.VMAX: "VMAX", registers.TMAX: "TMAX"}
_POSITION: Final = Struct("<ff")
_VELOCITY: Final = Struct("<f4x")


class DamiaoDrive(MitDrive):
    """Asks the drive for its ranges before it is enabled, and does not enable one whose ranges are others, or that does
    not tell them: every number would be read and sent in a wrong scale."""

    def __init__(self, device: MitDevice, end: MotorEnd, readings: JointReadings) -> None:
        super().__init__(device, end, readings)
        p, v, t, _, _ = self._scale
        self._ranges = {registers.PMAX: p, registers.VMAX: v, registers.TMAX: t}
        self._told: dict[int, float] = {}
        self._refused = False
        self._native, self._velocity_limit = device.native, device.velocity_limit_rad_s

    def take(self, data: bytes, now_s: float) -> int:
        """Take one reply: a state, or what a register holds."""
        if len(data) == 8 and registers.is_reply(data):
            if registers.node_of(data) == self._node:
                number, value = registers.parse(data)
                if number in self._ranges:
                    self._told[number] = value
            return 0
        taken = super().take(data, now_s)
        if taken and self._wrong:
            self._readings.state, self._readings.error = DriveState.FAULT, OTHER_RANGES
        elif taken and self._refused and self._untold:
            self._readings.state, self._readings.error = DriveState.FAULT, UNTOLD_RANGES
        return taken

    @property
    def _untold(self) -> list[int]:
        return [n for n in self._ranges if n not in self._told]

    @property
    def _wrong(self) -> list[int]:
        return [n for n, x in self._told.items() if abs(x - self._ranges[n]) > 1e-3 * self._ranges[n]]

    @property
    def _own_loop(self) -> bool:
        return self._native and self._mode in (Mode.POSITION, Mode.VELOCITY)

    def command(self, command: MotorCommand) -> Outgoing:
        """See `Drive.command`; the drive's own loops take no gains and no torque with a command."""
        if not self._own_loop:
            return super().command(command)
        if not isfinite(command.position_rad + command.velocity_rad_s):
            raise InputError(
                f"joint `{self._readings.name}`: {command}; finite numbers are accepted; nothing was sent"
            )
        if self._mode is Mode.POSITION:
            gain, offset = self._to_position
            data = _POSITION.pack(gain * command.position_rad + offset, self._velocity_limit or 0.0)
            return Outgoing((Frame(0x100 + self._node, data),), 0)
        data = _VELOCITY.pack(command.velocity_rad_s * self._to_velocity)
        return Outgoing((Frame(0x200 + self._node, data),), 0)

    def wire(self) -> Wire:
        """See `Drive.wire`; the own loops take float32."""
        return Wire() if self._own_loop else super().wire()

    def ease(self, share: float) -> tuple[Frame, ...] | None:
        """See `Drive.ease`; the own loops keep their gains."""
        return None if self._own_loop else super().ease(share)

    def request(self, request: Request, mode: Mode | None) -> tuple[Frame, ...]:
        """See `Drive.request`."""
        if request == Request.REPORT:
            return (*(registers.read(self._node, n) for n in self._untold), registers.report(self._node))
        frames = super().request(request, mode)
        if request != Request.ENABLE:
            return frames
        if self._wrong:
            return ()
        self._refused = bool(self._untold)
        if self._refused:
            return self.request(Request.REPORT, mode)
        wanted = registers.MIT
        if self._own_loop:
            wanted = registers.POSITION if self._mode is Mode.POSITION else registers.VELOCITY
        return (registers.write_uint(self._node, registers.CTRL_MODE, wanted), *frames)

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        if error == UNTOLD_RANGES:
            names = ", ".join(_NAMES[n] for n in self._untold)
            return f"the drive has not told its {names} (registers); it is not enabled before it has"
        if error != OTHER_RANGES:
            return super().error_text(error)
        found = ", ".join(f"{_NAMES[n]} {self._told[n]:g} (link: {self._ranges[n]:g})" for n in self._wrong)
        return f"the drive has {found}; give them as [device.range], or set the drive's"
