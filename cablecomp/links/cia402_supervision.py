"""What is known of a CiA 402 drive's health, and the way up its power state machine."""

from __future__ import annotations

from math import nan
from typing import Final

from cablecomp.links import canopen, cia402
from cablecomp.links.canopen_setup import SetUpDialogue
from cablecomp.links.cia402 import FOLLOWS, Control, Power
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import DriveState

_MISSED_HEARTBEATS: Final = 3
RESTARTED, LEFT, SILENT, STRAYS, OTHER_MODE, REFUSED = range(0x1_0000, 0x1_0006)
"""Error codes of ours, beyond the 16 bits of the profile's."""
_WORDS: Final = {
    RESTARTED: "the drive started afresh",
    LEFT: "the drive left the NMT state operational",
    SILENT: f"{_MISSED_HEARTBEATS} of its heartbeats stayed out",
    STRAYS: "the drive does not follow its target any more",
    OTHER_MODE: "the drive works in another mode than it was asked for",
}


class Supervision:
    """Tells state and error of one drive, and the controlword that leads on.

    A drive that starts afresh, leaves operational, falls silent, reports an emergency, does not follow any more or
    works in another mode is in FAULT. The power state machine is climbed once asked to enable, and never again by
    itself.
    """

    def __init__(
        self, readings: JointReadings, dialogue: SetUpDialogue, mode: int, heartbeat_s: float
    ) -> None:
        self._readings, self._dialogue, self._mode = readings, dialogue, mode
        self._patience_s = _MISSED_HEARTBEATS * heartbeat_s
        self._power = Power.NOT_READY
        self._statusword = self._code = self._emergency = self._trouble = 0
        self._mode_told = mode
        self._heard_s = nan
        self._operational = False
        self.disable()
        self._clear = False

    # ---- what comes ------------------------------------------------------------------------------

    def status(self, statusword: int, now_s: float) -> None:
        """Take a statusword."""
        self._statusword, self._power = statusword, cia402.power_of(statusword)
        if self._power is Power.ENABLED:
            self._reached = True
        elif self._reached:
            self.disable()
        if self._heard_s != self._heard_s:
            self._heard_s = now_s
        elif now_s - self._heard_s > self._patience_s:
            self._trouble = SILENT
        self._judge()

    def more(self, code: int, mode: int) -> None:
        """Take error code and mode display."""
        self._code, self._mode_told = code, mode
        self._judge()

    def emergency(self, code: int) -> None:
        """Take an emergency; codes 0x00xx say that all is well again."""
        self._emergency = code if code >> 8 else 0
        self._judge()

    def heartbeat(self, state: int, now_s: float) -> None:
        """Take a heartbeat; a device that boots, or is not operational any more, has to be set up again."""
        self._heard_s = now_s
        if state == canopen.OPERATIONAL:
            self._operational = True
        elif state == canopen.BOOT_UP or self._operational:
            if self._dialogue.done:
                self._trouble = RESTARTED if state == canopen.BOOT_UP else LEFT
            self._dialogue.begin()
            self._operational = False
            self.disable()
        self._judge()

    def _judge(self) -> None:
        """State and error, from all that is known."""
        power, error = self._power, self._trouble or self._emergency
        state = cia402.state_of(power)
        if state is DriveState.FAULT:
            error = error or self._code
        elif state is DriveState.ENABLED and self._mode_told != self._mode:
            error = error or OTHER_MODE
        elif state is DriveState.ENABLED and self._statusword & FOLLOWS:
            self._followed = True
        elif state is DriveState.ENABLED:
            state = DriveState.CALIBRATING
            error = error or (STRAYS if self._followed else 0)
        if self._dialogue.refused:
            error = REFUSED
        self._readings.state, self._readings.error = (DriveState.FAULT if error else state), error

    # ---- what goes -------------------------------------------------------------------------------

    def enable(self) -> None:
        """Climb from now on."""
        self._wanted, self._reached, self._followed = True, False, False

    def disable(self) -> None:
        """Climb no more."""
        self._wanted = self._reached = self._followed = False

    def clear(self) -> None:
        """Forget what has been, and let the next controlword reset a fault."""
        self._clear, self._emergency, self._trouble = True, 0, 0

    def set_up(self) -> None:
        """The drive was told to start: what was amiss before is no more, and it is to be heard anew."""
        self._trouble, self._heard_s, self._operational = 0, nan, False

    def controlword(self) -> Control:
        """What leads on from the present state."""
        if self._clear and self._power is Power.FAULT:
            self._clear = False
            return Control.FAULT_RESET
        return cia402.upwards(self._power) if self._wanted else Control.DISABLE_VOLTAGE

    def error_text(self, error: int) -> str:
        """See `Drive.error_text`."""
        if error == REFUSED:
            return self._dialogue.refused
        return _WORDS.get(error) or (cia402.error_words(error) if error else "")
