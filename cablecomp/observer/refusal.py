"""Why a sample is refused: one type for the loop, replay and every other reader of the observer."""

from __future__ import annotations

import struct
from enum import IntEnum

from cablecomp.errors import InputError
from cablecomp.mechanics import status as o
from cablecomp.signals import Sample


class Refusal(IntEnum):
    """What speaks against a sample."""

    UNWOUND = o.STATUS_UNWOUND
    SLACK = o.STATUS_SLACK
    DIVERGED = o.STATUS_DIVERGED
    NOT_FINITE = o.STATUS_NAN
    BACKWARD = o.STATUS_BACKWARD
    BREAKS = o.STATUS_BREAKS
    EFFECT = o.STATUS_EFFECT
    UNREACHABLE = o.STATUS_UNREACHABLE
    UNKNOWN = o.STATUS_UNKNOWN


REASONS = {
    Refusal.UNWOUND: "a drum runs out of cable at this position; check wrap_output_rad, "
    "wrap_input_rad and the angles' unit and zero",
    Refusal.SLACK: "the load would slacken the cable of an open circuit (T0 + M/R <= "
    "0); check pretension_N and the load's sign",
    Refusal.DIVERGED: "the tensions could not be solved; check the configuration's orders of magnitude",
    Refusal.NOT_FINITE: "has no finite time, motor angle or load, or an infinite further "
    "reading; leave it out or mend the channel",
    Refusal.BACKWARD: "comes after a later one; time must not run backwards",
    Refusal.BREAKS: "loads a cable beyond its breaking force; lower the load or check breaking_force_N",
    Refusal.EFFECT: "makes an effect of the configuration give no finite answer, or move a pretension "
    "without `moves_pretension` or beyond what any cable bears; check its parameters and the channels it reads",
    Refusal.UNREACHABLE: "no load that the joint can take brings it to this joint angle; "
    "check the encoders' zeros and the pretension",
    Refusal.UNKNOWN: "comes before any other: nothing is known of the joint yet; step a first sample",
}


class SampleRefused(InputError):
    """A sample that the joint cannot take: the observer's state is what it was before, bit for bit.

    `reason` says why, `time_s` is the sample's, `index` its place in a block (None = a single sample).
    """

    def __init__(self, reason: Refusal, time_s: float, index: int | None = None, words: str = "") -> None:
        where = f"sample at {time_s:g} s" if index is None else f"sample {index}: at {time_s:g} s"
        super().__init__(f"{where} {words or REASONS[reason]}")
        self.reason, self.time_s, self.index = reason, time_s, index


def refused(
    status: int, time_s: float, last_s: float, strength: float, index: int | None = None
) -> SampleRefused:
    """The error for a kernel's status; `last_s` = time of the sample before, `strength` = share of breaking
    force used."""
    reason, words = Refusal(status), ""
    if reason is Refusal.BACKWARD:
        words = f"comes after one at {last_s:g} s; time must not run backwards"
    if reason is Refusal.BREAKS:
        words = f"puts {strength:.4g} times its breaking force on a cable; lower the load or check breaking_force_N"
    return SampleRefused(reason, time_s, index, words)


def unreadable(sample: object) -> InputError:
    """The error for what a row of readings cannot hold: what is no `Sample`, or one with what is no number."""
    if not isinstance(sample, Sample):
        return InputError(f"sample: a `cablecomp.Sample` is accepted, not {type(sample).__name__}")
    for name, value in zip(Sample._fields[:-1], sample, strict=False):
        try:
            struct.pack("d", value)
        except struct.error:
            return InputError(
                f"sample: {name} is {value!r:.40}; a number is accepted, NaN where there is none"
            )
    return InputError(
        f"sample: other is {sample.other!r:.40}; a tuple of numbers is accepted, NaN where there is none"
    )
