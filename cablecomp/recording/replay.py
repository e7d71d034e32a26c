"""Replay: a recording streams through the observer, its prediction is compared with what was measured."""

from __future__ import annotations

import dataclasses
import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.errors import InputError, path_text
from cablecomp.recording.assumptions import assumptions
from cablecomp.recording.reader import Recording
from cablecomp.recording.replay_summary import ReplaySummary
from cablecomp.recording.snapshots import END, Instants, Snapshot, WrapProfile, in_order
from cablecomp.recording.streams import Line, LineFit, Moments
from cablecomp.recording.table import Block, FloatArray, RemarkLog

COMPARED: Final = frozenset({"joint_position_rad", "tension_h_N", "tension_l_N"})
"""Channels that a prediction is compared with."""
_NEEDED: Final = {
    "joint_torque": ("joint_torque_Nm",),
    "motor_torque": ("motor_torque_Nm",),
    "both_encoders": ("joint_position_rad",),
    "none": (),
}
_SAMPLE = re.compile(r"sample (\d+): (.*)", re.DOTALL)

Progress = Callable[[float, int], None]
"""Told the share of the recording done (0..1) and the samples done, after each block."""


class StreamObserver(Protocol):
    """The observer as replay uses it: state inside, one block of samples at a time, in order."""

    def run(self, columns: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Predict a block; raises InputError("sample k: ...") with k counted in this block."""

    def profiles(self) -> Sequence[WrapProfile]:
        """Return the tension profile on each wrap after the last sample."""


@dataclass(frozen=True)
class Replayed:
    """One block, measured and predicted; what cannot be compared or is absent is None.

    `residual_rad` = measured - predicted joint position - offset of the joint encoder;
    `deflection_measured_rad` = predicted deflection + residual; `load_Nm` is the channel of the load.
    """

    block: Block
    predicted: dict[str, FloatArray]
    residual_rad: FloatArray | None
    deflection_measured_rad: FloatArray | None
    load_Nm: FloatArray | None


class Sink(Protocol):
    """Takes every replayed block, in order."""

    def take(self, replayed: Replayed) -> None:
        """Take in one block."""


def required_channels(config: JointConfig) -> tuple[str, ...]:
    """Return the channels that an observer of this joint cannot do without."""
    return ("motor_position_rad", *_NEEDED[config.observer.load])


def comparable(recording: Recording, config: JointConfig) -> Recording:
    """The recording, which may lack a reading of what a prediction is only compared with: joint angle, tensions."""
    return dataclasses.replace(recording, lacking=COMPARED.difference(required_channels(config)))


def replay(
    recording: Recording,
    observer: StreamObserver,
    sinks: Sequence[Sink],
    progress: Progress | None = None,
    *,
    config: JointConfig,
    clock: Callable[[], float] = time.perf_counter,
) -> ReplaySummary:
    """Stream a recording through the observer and every block into the sinks; see `ReplaySummary`.

    Rows without a reading of the joint's angle are predicted, and not compared. Raises InputError with the file's line
    where the recording or the joint does not allow a prediction.
    """
    recording = comparable(recording, config)
    recording.require(required_channels(config), f"with [observer] load = {config.observer.load!r}")
    run = _Run(recording, observer, config, clock)
    started = clock()
    for block in recording.blocks():
        replayed = run.block(block)
        for sink in sinks:
            sink.take(replayed)
        if progress is not None:
            progress(block.fraction, run.samples)
    return run.summary(clock() - started)


class _Run:
    """The running state of one replay."""

    def __init__(
        self,
        recording: Recording,
        observer: StreamObserver,
        config: JointConfig,
        clock: Callable[[], float],
    ) -> None:
        self._recording, self._observer, self._config = recording, observer, config
        self._clock = clock
        self._instants, self._snapshots = Instants(), dict[str, Snapshot]()
        self._log = RemarkLog(recording.line_word)
        self._residual, self._fit = Moments(), LineFit()
        self._lowest, self._highest = math.inf, -math.inf
        self._width_first, self._width_last = math.nan, math.nan
        self._first_time, self._last_time, self._busy = math.nan, math.nan, 0.0
        self.samples = 0

    def block(self, block: Block) -> Replayed:
        """Predict one block and take it into the numbers."""
        self._log.add(block.remarks)
        load = block.columns.get("joint_torque_Nm", block.columns.get("motor_torque_Nm"))
        predicted = self._predict(block, load)
        residual, deflection = None, None
        measured = block.columns.get("joint_position_rad")
        if measured is not None:
            offset = self._config.sensors.joint_position_offset_rad
            residual = measured - predicted["joint_position_rad"] - offset
            deflection = predicted["deflection_rad"] + residual
        replayed = Replayed(block, predicted, residual, deflection, load)
        self._count(replayed)
        return replayed

    def summary(self, elapsed_s: float) -> ReplaySummary:
        """Return the numbers of the rows so far."""
        # where the joint's angle told the load nothing is left of it
        compared = self._residual.count > 0 and self._config.observer.load != "both_encoders"
        line = self._fit.line()
        channels = self._recording.channels
        return ReplaySummary(
            recording=path_text(self._recording.path),
            joint=self._config.name,
            samples=self.samples,
            duration_s=self._last_time - self._first_time,
            rmse_rad=self._residual.rms if compared else None,
            mean_rad=self._residual.mean if compared else None,
            sd_rad=self._residual.sd if compared else None,
            max_rad=self._residual.largest if compared else None,
            baseline_linear_rmse_rad=None if line is None else line.rmse,
            baseline_linear_slope_rad_per_Nm=None if line is None else line.slope,
            baseline_linear_offset_rad=None if line is None else line.offset,
            deflection_range_rad=self._highest - self._lowest,
            joint_position_offset_rad=self._config.sensors.joint_position_offset_rad,
            bounds_width_first_rad=_known(self._width_first),
            bounds_width_last_rad=_known(self._width_last),
            samples_per_s=self.samples / max(elapsed_s, 1e-9),
            observer_samples_per_s=self.samples / max(self._busy, 1e-9),
            gaps=tuple({"line": gap.line, "gap_s": gap.size} for gap in self._log.gaps),
            notes=(
                *self._recording.notes,
                *self._log.notes(),
                *self._of_the_zeros(line if compared else None),
            ),
            assumptions=assumptions(self._config, channels),
            snapshots=in_order([*self._snapshots.values(), self._snapshot(END)]),
        )

    def _of_the_zeros(self, line: Line | None) -> Iterator[str]:
        """Where a straight line, which has a zero of its own, does better than the prediction by that zero."""
        left = self._residual
        if line is not None and abs(left.mean) > left.sd and left.rms > line.rmse:
            zero = self._config.sensors.joint_position_offset_rad + left.mean
            yield (
                f"{1e3 * left.mean:.4g} mrad of the error is constant, {1e3 * left.sd:.4g} mrad RMS stand beside it: "
                "the prediction takes the encoders' zeros as configured, the straight line has one of its own; "
                f"[sensors] joint_position_offset_rad = {zero:.6g} would take it off, `calibrate` finds it"
            )

    def _predict(self, block: Block, load: FloatArray | None) -> dict[str, FloatArray]:
        """Run the observer over the block, stopping where a snapshot is due: the state carries over."""
        parts, start = [], 0
        for row, label in [*self._instants.due(load), (block.rows - 1, "")]:
            if row >= start:
                parts.append(self._observe(block.part(start, row + 1)))
                start = row + 1
            self._mark(block, row, load)
            if label:
                self._snapshots[label] = self._snapshot(label)
        self.samples += block.rows
        if len(parts) == 1:
            return parts[0]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _observe(self, block: Block) -> dict[str, FloatArray]:
        started = self._clock()
        try:
            predicted = self._observer.run(block.columns)
        except InputError as error:
            raise InputError(self._located(str(error), block)) from None
        self._busy += self._clock() - started
        return predicted

    def _located(self, message: str, block: Block) -> str:
        match = _SAMPLE.fullmatch(message)
        if match is None:
            return f"{self._recording.path}: {message}"
        line = block.first_line + int(match[1])
        return f"{self._recording.path}: {self._recording.line_word} {line}: {match[2]}"

    def _mark(self, block: Block, row: int, load: FloatArray | None) -> None:
        self._here = (
            self.samples + row,
            float(block.columns["time_s"][row]),
            None if load is None else float(load[row]),
        )

    def _snapshot(self, label: str) -> Snapshot:
        return Snapshot(label, *self._here, tuple(self._observer.profiles()))

    def _count(self, replayed: Replayed) -> None:
        times, shown = replayed.block.columns["time_s"], replayed.deflection_measured_rad
        width = replayed.predicted["deflection_high_rad"] - replayed.predicted["deflection_low_rad"]
        known = width[np.isfinite(width)]
        if math.isnan(self._first_time):
            self._first_time = float(times[0])
        if math.isnan(self._width_first) and len(known):
            self._width_first = float(known[0])
        self._last_time, self._width_last = float(times[-1]), float(width[-1])
        curve = replayed.predicted["deflection_rad"] if shown is None else shown
        told = np.isfinite(curve)
        self._lowest = min(self._lowest, float(curve.min(initial=math.inf, where=told)))
        self._highest = max(self._highest, float(curve.max(initial=-math.inf, where=told)))
        if replayed.residual_rad is not None:
            self._residual.add(replayed.residual_rad[told])
        if shown is not None and replayed.load_Nm is not None:
            self._fit.add(replayed.load_Nm[told], shown[told])


class PredictionCsv:
    """Sink that writes `prediction.csv`: one row for each row of the recording."""

    COLUMNS: Final = (
        "time_s",
        "deflection_rad",
        "deflection_low_rad",
        "deflection_high_rad",
        "joint_position_rad",
        "residual_rad",
        "tension_h_N",
        "tension_l_N",
    )

    def __init__(self, write: Callable[[dict[str, FloatArray]], None]) -> None:
        self._write = write

    def take(self, replayed: Replayed) -> None:
        """Write one block; what is unknown is NaN."""
        times, residual = replayed.block.columns["time_s"], replayed.residual_rad
        unknown = np.full(len(times), np.nan)
        known = replayed.predicted | {
            "time_s": times,
            "residual_rad": unknown if residual is None else residual,
        }
        self._write({name: known.get(name, unknown) for name in self.COLUMNS})


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
