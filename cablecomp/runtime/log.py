"""What a run leaves behind: the recording that `replay` accepts, the predictions, the cycles, the events."""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from cablecomp.errors import DeviceError
from cablecomp.recording.recorder import Recorder
from cablecomp.recording.table import FloatArray
from cablecomp.recording.writer import CsvWriter
from cablecomp.signals import Estimate, Sample

PREDICTION: Final = (
    "time_s",
    "deflection_rad",
    "deflection_low_rad",
    "deflection_high_rad",
    "joint_position_rad",
    "residual_rad",
    "tension_h_N",
    "tension_l_N",
)
"""Columns of `prediction.csv`, as `replay` writes them."""

CYCLE: Final = (
    "time_s",
    "controlled",
    "phase",
    "weight",
    "health",
    "gate",
    "reference_position_rad",
    "reference_torque_Nm",
    "command_position_rad",
    "command_velocity_rad_s",
    "command_torque_Nm",
    "deflection_ahead_rad",
    "load_estimate_Nm",
    "motor_age_s",
    "load_age_s",
    "step_s",
)
"""Columns of `cycles.csv`: whether under control, what was asked for at that instant, what was sent,
how old the data were, what was wrong (bits), how long it took.
"""


class TableLog:
    """Rows of floats to a CSV file, written by a thread of its own; `append` never waits for the disk."""

    def __init__(self, path: Path, columns: Sequence[str], rows_per_write: int = 1000) -> None:
        self.path = path
        self.rows = 0
        self.failure: OSError | None = None
        self._columns = tuple(columns)
        self._shape = (rows_per_write, len(self._columns))
        self._buffer: FloatArray = np.empty(self._shape)
        self._filled = 0
        self._queue: queue.SimpleQueue[FloatArray | None] = queue.SimpleQueue()
        try:
            self._writer = CsvWriter(path, self._columns)
        except OSError as error:
            raise DeviceError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
        self._thread: threading.Thread | None = threading.Thread(target=self._drain, name="log", daemon=True)
        self._thread.start()

    def append(self, row: Sequence[float]) -> None:
        """Take in one row."""
        self._buffer[self._filled] = row
        self._filled += 1
        self.rows += 1
        if self._filled == len(self._buffer):
            self._hand_over()

    def close(self) -> None:
        """Write the rest and finish the file; DeviceError if the disk refused. May be called again."""
        if self._thread is not None:
            self._hand_over()
            self._queue.put(None)
            self._thread.join()
            self._thread = None
        if self.failure is not None:
            raise DeviceError(f"{self.path}: is incomplete ({self.failure.strerror}); free some space")

    def _hand_over(self) -> None:
        if self._filled:
            self._queue.put(self._buffer[: self._filled])
            self._buffer = np.empty(self._shape)
            self._filled = 0

    def _drain(self) -> None:
        while (block := self._queue.get()) is not None:
            self._guarded(partial(self._write, block))
        self._guarded(self._writer.close)

    def _write(self, block: FloatArray) -> None:
        self._writer.write({name: block[:, k] for k, name in enumerate(self._columns)})
        self._writer.flush()

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            if self.failure is None:
                action()
        except OSError as error:
            self.failure = error


class JointLog:
    """Recording, predictions and cycles of one joint, in a directory of its own.

    The recording holds the very samples that the observer took in, in order, with every digit: `replay` with
    the same configuration gives the same predictions, bit for bit.
    """

    def __init__(
        self, folder: Path, first: Sample, others: Sequence[str], comments: Sequence[str] = ()
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._joint = first.joint_position_rad == first.joint_position_rad
        self._torque = first.joint_torque_Nm == first.joint_torque_Nm
        self._motor = first.motor_torque_Nm == first.motor_torque_Nm
        channels = ["time_s", "motor_position_rad"]
        channels += ["joint_position_rad"] if self._joint else []
        channels += ["joint_torque_Nm"] if self._torque else []
        channels += ["motor_torque_Nm"] if self._motor else []
        channels += ["temperature_degC", *others]
        self._recorder = Recorder(folder / "recording.csv", channels, comments)
        self._prediction = TableLog(folder / "prediction.csv", PREDICTION)
        self._cycle = TableLog(folder / "cycles.csv", CYCLE)

    @property
    def rows(self) -> int:
        """Samples recorded so far."""
        return self._recorder.rows

    def append(
        self,
        sample: Sample,
        estimate: Estimate,
        offset_rad: float,
        others: Sequence[float],
        cycle: Sequence[float],
    ) -> None:
        """One cycle: the sample as the observer took it, what it said, further channels, and a row of
        `CYCLE`.
        """
        row = [sample.time_s, sample.motor_position_rad]
        if self._joint:
            row.append(sample.joint_position_rad)
        if self._torque:
            row.append(sample.joint_torque_Nm)
        if self._motor:
            row.append(sample.motor_torque_Nm)
        row.append(sample.temperature_degC)
        row += others
        self._recorder.append(row)
        e = estimate
        residual = sample.joint_position_rad - e.joint_position_rad - offset_rad
        self._prediction.append(
            (
                e.time_s,
                e.deflection_rad,
                e.deflection_low_rad,
                e.deflection_high_rad,
                e.joint_position_rad,
                residual,
                e.tension_h_N,
                e.tension_l_N,
            )
        )
        self._cycle.append(cycle)

    def close(self) -> None:
        """Finish all files; every one of them is tried, the first failure is raised afterwards."""
        failure: DeviceError | None = None
        for log in (self._recorder, self._prediction, self._cycle):
            try:
                log.close()
            except DeviceError as error:
                failure = error if failure is None else failure
        if failure is not None:
            raise failure


class EventLog:
    """What happened, one JSON line each, at once on disk; the last ones are kept for the live view."""

    def __init__(self, path: Path, keep: int = 200) -> None:
        self.last: list[tuple[float, str, str]] = []
        self._keep = keep
        try:
            self._file = path.open("w", encoding="utf-8")
        except OSError as error:
            raise DeviceError(f"{path}: cannot be written ({error.strerror}); choose another place") from None

    def add(self, time_s: float, joint: str, what: str) -> None:
        """Note an event of a joint ("" = of the run)."""
        self.last.append((time_s, joint, what))
        if len(self.last) > self._keep:
            del self.last[0]
        if not self._file.closed:
            self._file.write(json.dumps({"time_s": round(time_s, 6), "joint": joint, "what": what}) + "\n")
            self._file.flush()

    def close(self) -> None:
        """Finish the file; may be called again."""
        self._file.close()
