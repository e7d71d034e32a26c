"""Setting a CANopen device up by SDO, one transfer at a time, driven by being asked what to send next."""

from __future__ import annotations

from typing import Final

from cablecomp.links import canopen
from cablecomp.links.canopen import ABORTS, LACKING, SdoReply, Step
from cablecomp.links.records import Frame

_ASK_AGAIN: Final = 100
"""After so many questions what to send next, a request that nobody answered is sent again."""


class SetUpDialogue:
    """Goes through steps: pre-operational, each transfer after the answer to the one before, operational.

    `done`: the device was told to start. `refused`: words for a transfer that it refused, or a value that it does
    not hold, which ends the dialogue.
    """

    def __init__(self, node: int, steps: tuple[Step, ...]) -> None:
        self._node, self._steps = node, steps
        self.begin()

    def begin(self) -> None:
        """From the start, with the next question."""
        self._at = self._waiting = 0
        self.done = False
        self.refused = ""

    def next(self) -> tuple[Frame, ...]:
        """What to send now: nothing while an answer is awaited, or after the end."""
        if self.done or self.refused:
            return ()
        if self._at == len(self._steps):
            self.done = True
            return (canopen.nmt(canopen.START, self._node),)
        self._waiting += 1
        if self._waiting % _ASK_AGAIN != 1:
            return ()
        request = canopen.sdo(self._node, self._steps[self._at])
        if self._at == 0:
            return (canopen.nmt(canopen.PRE_OPERATIONAL, self._node), request)
        return (request,)

    def take(self, reply: SdoReply) -> None:
        """Take an answer; one to something else is none."""
        if self.done or self.refused or not self._waiting or self._at == len(self._steps):
            return
        step = self._steps[self._at]
        if (reply.number, reply.sub) != (step.entry.number, step.entry.sub):
            return
        name = f"object 0x{reply.number:04X}:{reply.sub:02X}"
        if reply.abort and not (step.may_lack and reply.abort in LACKING):
            why = ABORTS.get(reply.abort, "no reason known")
            self.refused = f"it refuses {name} ({why}, 0x{reply.abort:08X})"
        elif step.check and not reply.abort and abs(reply.value - step.value) > max(1, step.value // 1000):
            self.refused = (
                f"its {name} is {reply.value}, not {step.value}; one of drive and link file is wrong"
            )
        else:
            self._at += 1
            self._waiting = 0
