"""What a run leaves behind: the recording that `replay` accepts, the predictions, the cycles, the events."""

from __future__ import annotations

import json
from collections.abc import Sequence
from io import FileIO
from pathlib import Path
from typing import Final

from cablecomp.errors import DeviceError
from cablecomp.recording.recorder import Recorder, TableLog
from cablecomp.recording.replay import PredictionCsv
from cablecomp.signals import Estimate, Sample

PREDICTION: Final = PredictionCsv.COLUMNS
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


class JointLog:
    """Recording, predictions and cycles of one joint, in a directory of its own.

    The recording holds the very samples that the observer took in, in order, with every digit: `replay` with
    the same configuration gives the same predictions, bit for bit.
    """

    def __init__(self, folder: Path, first: Sample, others: Sequence[str]) -> None:
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
        self._recorder = Recorder(folder / "recording.csv", channels)
        self._prediction = TableLog(folder / "prediction.csv", PREDICTION)
        self._cycle = TableLog(folder / "cycles.csv", CYCLE)

    @property
    def rows(self) -> int:
        """Samples recorded so far."""
        return self._recorder.rows

    @property
    def waiting(self) -> int:
        """Samples that a process killed now would not leave behind."""
        return self._recorder.waiting

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

    def flush(self) -> None:
        """Hand over what has been appended so far, without waiting for the disk."""
        for log in (self._recorder, self._prediction, self._cycle):
            log.flush()

    @property
    def failure(self) -> str:
        """Why one of the files takes no more ("" = all do)."""
        return self._recorder.failure or self._prediction.failure or self._cycle.failure

    def close(self) -> list[str]:
        """Finish all files, every one of them; returns why some are incomplete."""
        found: list[str] = []
        for log in (self._recorder, self._prediction, self._cycle):
            try:
                log.close()
            except DeviceError as error:
                found.append(str(error))
        return found


class EventLog:
    """What happened, one JSON line each, at once with the operating system (`path` None = nowhere; made with
    the first event); the last ones are kept for the live view. `failure` says why no more are written.
    """

    def __init__(self, path: Path | None, keep: int = 200) -> None:
        self.last: list[tuple[float, str, str]] = []
        self._keep = keep
        self.failure = ""
        self._path = path
        self._file: FileIO | None = None

    def add(self, time_s: float, joint: str, what: str) -> None:
        """Note an event of a joint ("" = of the run)."""
        self.last.append((time_s, joint, what))
        if len(self.last) > self._keep:
            del self.last[0]
        if self._file is None and self._path is not None:
            self._file = _opened(self._path)
        if self._file is None or self._file.closed or self.failure:
            return
        line = json.dumps({"time_s": round(time_s, 6), "joint": joint, "what": what}) + "\n"
        try:
            self._file.write(line.encode())
        except OSError as error:
            self.failure = f"{self._path}: is incomplete ({error.strerror}); free some space"

    def close(self) -> None:
        """Finish the file; may be called again."""
        if self._file is not None:
            self._file.close()


def _opened(path: Path) -> FileIO:
    try:
        return path.open("wb", buffering=0)
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
