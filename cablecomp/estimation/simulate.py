"""Run the observer's kernel through a recording and read every output channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.effects import catalogue, extend
from cablecomp.effects.catalogue import other_channels
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, MOTOR, Evidence, load_channel
from cablecomp.mechanics.assemble import Model, assemble
from cablecomp.mechanics.start import joint_start
from cablecomp.mechanics.status import STATUS_OK
from cablecomp.observer import stepper as st
from cablecomp.observer.refusal import REASONS, Refusal
from cablecomp.signal.smoothing import FloatArray, IntArray

_PLACES: Final[Mapping[str, int]] = {
    JOINT: st.OUT_JOINT,
    MOTOR: st.OUT_MOTOR_TORQUE,
    "tension_h_N": st.OUT_T_H,
    "tension_l_N": st.OUT_T_L,
}


@dataclass(frozen=True)
class Simulator:
    """A joint set up once, good for every recording in which it stands alike."""

    joint: JointConfig
    model: Model
    others: tuple[str, ...]
    fine: bool

    def predict(self, recording: Evidence, history: FloatArray | None = None) -> dict[str, FloatArray]:
        """Every output channel [rad, N m, N] on the recording's judged rows, encoder zeros not added.

        `history` (k x 2): motor angle [rad] and load [N m] that went before the first row. Raises InputError
        where the drive cannot follow (slack in an open circuit, a drum run out of cable).
        """
        kept = recording.rated if self.fine else recording.rows
        outs = self.run(recording, kept, history)
        if self.fine:
            outs = outs[np.searchsorted(kept, recording.rows)]
        return {name: outs[:, place] for name, place in _PLACES.items()}

    def run(self, recording: Evidence, kept: IntArray, history: FloatArray | None = None) -> FloatArray:
        """The kernel's outputs on the fine rows `kept`."""
        rows = self._rows(recording, kept)
        before = 0 if history is None else len(history)
        if history is not None:
            past = np.repeat(rows[:1], before, axis=0)
            past[:, st.IN_TIME] -= np.arange(before, 0, -1) * 0.05
            past[:, st.IN_MOTOR], past[:, st.IN_LOAD] = history[:, 0], history[:, 1]
            rows = np.concatenate([past, rows])
        model = self.model
        S, J = model.S.copy(), model.J.copy()
        joint_start(model.P, model.I, S, J, model.L, rows[0, st.IN_TIME], rows[0, st.IN_MOTOR], 0.0)
        outs = np.empty((len(rows), st.OUT_WIDTH))
        done, status = st.walk(model.P, model.I, S, J, model.L, rows, outs, True)
        if status != STATUS_OK:
            at = rows[min(done, len(rows) - 1), st.IN_TIME]
            raise InputError(f"{recording.name}: at {at:g} s {REASONS[Refusal(status)]}")
        return outs[before:]

    def _rows(self, recording: Evidence, kept: IntArray) -> FloatArray:
        columns = recording.columns
        time = columns["time_s"]
        rows = np.full((len(time), st.IN_OTHER + len(self.others)), np.nan)
        rows[:, st.IN_TIME], rows[:, st.IN_MOTOR] = time, columns["motor_position_rad"]
        rows[:, st.IN_LOAD] = load_of(self.joint, columns)
        rows[:, st.IN_JOINT] = columns[JOINT]
        if "temperature_degC" in columns:
            rows[:, st.IN_TEMPERATURE] = columns["temperature_degC"]
        for k, name in enumerate(self.others):
            if name not in columns:
                raise InputError(
                    f"{recording.name}: channel `{name}` is missing, which an effect reads; record it"
                )
            rows[:, st.IN_OTHER + k] = columns[name]
        return np.ascontiguousarray(rows[kept])


def load_of(joint: JointConfig, columns: Mapping[str, FloatArray]) -> FloatArray | float:
    """The load [N m] that the recording's inputs give."""
    source = load_channel(joint, columns)
    if source is None:
        return 0.0
    if source == MOTOR:
        ratio = float(np.prod([s.input_radius_m / s.output_radius_m for s in joint.drive.stage]))
        return -columns[MOTOR] / ratio
    return columns["joint_torque_Nm"]


def knows_rates(joint: JointConfig) -> bool:
    """Whether an effect of the joint has to be run on every sample."""
    return any(catalogue()[e.id].rates for e in joint.effect)


def simulator(joint: JointConfig, fine: bool = False) -> Simulator:
    """Set the joint up, to run on judged rows or on all fine ones; raises InputError for values that its laws
    cannot take."""
    return Simulator(joint, assemble(joint, extend(joint)), tuple(other_channels(joint)), fine)
