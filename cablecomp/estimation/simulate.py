"""Run the observer's kernel through a recording and read every output channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects import extend
from cablecomp.effects.base import Late
from cablecomp.effects.catalogue import late_channels, other_channels
from cablecomp.errors import InputError, SlackError
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, load_channel
from cablecomp.estimation.in_time import joint_as_stamped, with_felt_loads
from cablecomp.mechanics.assemble import Model, assemble
from cablecomp.mechanics.change import Change, together
from cablecomp.mechanics.start import joint_start
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import stepper as st
from cablecomp.observer.refusal import REASONS, Refusal
from cablecomp.observer.rows import Answer, Readings, answers, readings
from cablecomp.signal.smoothing import FloatArray, IntArray

_ANSWERS: Final[Mapping[str, str]] = {
    JOINT: "joint",
    MOTOR: "motor_torque",
    "tension_h_N": "tension_h",
    "tension_l_N": "tension_l",
}


HISTORY_STEP_S: Final = 0.05
"""Time from row to row of what went before a recording."""


class Unrecorded(NamedTuple):
    """Where motor [rad] and load [N m] went (`path`, k x 2) while nothing was recorded: after this fine row, as fast as
    the recording's next row lets it; before the first row of all where `after` is -1."""

    path: FloatArray
    after: int = -1


@dataclass(frozen=True)
class Simulator:
    """A joint set up once, good for every recording in which it stands alike.

    `model`: without what merely comes `late`; `lawless`: the same without laws that have no name, where it has some and
    something is late: these go by what was read, and when.
    """

    joint: JointConfig
    model: Model
    others: tuple[str, ...]
    fine: bool
    late: tuple[Late, ...] = ()
    lawless: Model | None = None

    def predict(self, recording: Evidence, unrecorded: Unrecorded | None = None) -> dict[str, FloatArray]:
        """Every output channel [rad, N m, N] on the recording's judged rows, encoder zeros not added; `unrecorded`:
        where the drive went meanwhile.

        Raises InputError where the drive cannot follow (slack in an open circuit, a drum run out of cable).
        """
        kept = recording.rated if self.fine else recording.rows
        answer = self.run(recording, kept, unrecorded)
        judged = np.searchsorted(kept, recording.rows) if self.fine else slice(None)
        return {name: getattr(answer, field)[judged] for name, field in _ANSWERS.items()}

    def run(self, recording: Evidence, kept: IntArray, unrecorded: Unrecorded | None = None) -> Answer:
        """The kernel's answers on the fine rows `kept`, their channels as late as they are stamped."""
        read = self._known_readings(recording, kept)
        late_s, channel = sum(one.load_s for one in self.late), load_channel(self.joint, recording.columns)
        own = None
        if late_s and channel is not None:
            load = np.asarray(load_of(self.joint, recording.columns))
            read, own = with_felt_loads(read, recording, channel, load, late_s)
        answer = self._step(self.model, recording, read, unrecorded)
        if any(one.joint_s or one.drift for one in self.late):
            bare = answer.joint
            if self.lawless is not None:
                bare = self._step(self.lawless, recording, read, unrecorded).joint
            seen = joint_as_stamped(bare, read.time, recording, self.late, self.joint.drive.ratio)
            answer = answer._replace(joint=seen + (answer.joint - bare))
        return answer if own is None else Answer(*(column[own] for column in answer))

    def _step(
        self, model: Model, recording: Evidence, read: Readings, unrecorded: Unrecorded | None
    ) -> Answer:
        """The kernel's answers to these readings."""
        place, more = 0, 0
        if unrecorded is not None:
            if unrecorded.after >= 0:
                place = int(
                    np.searchsorted(read.time, recording.columns["time_s"][unrecorded.after], "right")
                )
            more = len(unrecorded.path)
            read = _with_unrecorded(read, place, unrecorded.path)
        memory, heights = model.memory.copy(), model.heights.copy()
        joint_start(model.fixed, model.layout, memory, heights, model.laws, read.time[0], read.motor[0], 0.0)
        outs, answer = answers(len(read.rows))
        done, status = st.step_rows(
            model.fixed, model.layout, memory, heights, model.laws, read.rows, outs, True
        )
        if status != STATUS_OK:
            at = read.time[min(done, len(outs) - 1)]
            why = Refusal(status)
            refused = SlackError if why is Refusal.SLACK else InputError
            raise refused(f"{recording.name}: at {at:g} s {REASONS[why]}")
        if not more:
            return answer
        own = np.r_[0:place, place + more : len(outs)]
        return Answer(*(column[own] for column in answer))

    def _known_readings(self, recording: Evidence, kept: IntArray) -> Readings:
        """The same, kept with the recording (the kernel only reads them), but where the load is the motor's torque less
        a zero, which a fit moves."""
        if load_channel(self.joint, recording.columns) == MOTOR:
            return self._readings(recording, kept)
        key = kept.tobytes(), self.others
        if key not in recording.readings:
            recording.readings[key] = self._readings(recording, kept)
        return recording.readings[key]

    def _readings(self, recording: Evidence, kept: IntArray) -> Readings:
        """The recording's fine rows `kept`."""
        columns = recording.columns
        read = readings(len(kept), len(self.others))
        load = load_of(self.joint, columns)
        read.time[:], read.motor[:] = columns["time_s"][kept], columns["motor_position_rad"][kept]
        read.load[:] = load if isinstance(load, float) else load[kept]
        read.joint[:] = columns[JOINT][kept]
        read.motor_rate[:] = recording.motor_rate[kept]
        if "temperature_degC" in columns:
            read.temperature[:] = columns["temperature_degC"][kept]
        for k, name in enumerate(self.others):
            if name not in columns:
                raise InputError(
                    f"{recording.name}: channel `{name}` is missing, which an effect reads; record it"
                )
            read.other[:, k] = columns[name][kept]
        return read


def _with_unrecorded(read: Readings, place: int, path: FloatArray) -> Readings:
    """The readings with this path before the one at `place`, all else as it is read there."""
    more = len(path)
    both = readings(len(read.rows) + more, read.other.shape[1])
    both.rows[:place], both.rows[place + more :] = read.rows[:place], read.rows[place:]
    between = both.rows[place : place + more]
    between[:] = read.rows[place]
    time = both.time[place : place + more]
    if place == 0:
        time -= np.arange(more, 0, -1) * HISTORY_STEP_S
    else:
        time[:] = np.linspace(read.time[place - 1], read.time[place], more + 2)[1:-1]
    both.motor[place : place + more], both.load[place : place + more] = path[:, 0], path[:, 1]
    return both


def load_of(joint: JointConfig, columns: Mapping[str, FloatArray]) -> FloatArray | float:
    """The load [N m] that the recording's inputs give."""
    source = load_channel(joint, columns)
    if source is None:
        return 0.0
    if source == MOTOR:
        return -(columns[MOTOR] - joint.motor_zero_Nm) / joint.drive.ratio
    return columns["joint_torque_Nm"]


def simulator(joint: JointConfig, fine: bool = False, beside: Change | None = None) -> Simulator:
    """Set the joint up, to run on judged rows or on all fine ones, with a change beside its own effects; raises
    InputError for values that its laws cannot take."""
    in_time, late = late_channels(joint)
    model = _assembled(in_time, beside)
    laws = late and joint.empirical
    lawless = _assembled(in_time.model_copy(update={"empirical": ()}), beside) if laws else None
    return Simulator(joint, model, tuple(other_channels(joint)), fine, late, lawless)


def _assembled(joint: JointConfig, beside: Change | None) -> Model:
    change = extend(joint)
    if beside is not None:
        change = beside if change is None else together([change, beside])
    return assemble(joint, change)
