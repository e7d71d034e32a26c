"""The commands as calls: a recording, or several, and a joint in; results with `.to_frame()` and `.figure()` out.

A recording is a path, arrays by name (`{"time_s": ..., "motor_position_deg": ...}`: names and units as in a file), or a
frame of pandas or polars. A joint is a `JointConfig`, a path, or the name of an example. What is wrong raises
InputError, with the words of the command line; what hardly fits the drive stands in `doubts`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any, get_args

import numpy as np
import plotly.graph_objects as go
import polars as pl

from cablecomp.config import JointConfig, load_joint
from cablecomp.diagnosis.body import Sessions
from cablecomp.diagnosis.calibrate import Calibration
from cablecomp.diagnosis.calibrate import calibrate as _calibrate
from cablecomp.diagnosis.diagnose import diagnose as _diagnose
from cablecomp.diagnosis.pace import Progress
from cablecomp.diagnosis.result import Diagnosis, report_json
from cablecomp.errors import InputError
from cablecomp.estimation.belief import still_doubted, suspicions
from cablecomp.estimation.standing import as_it_stood
from cablecomp.estimation.view import Suspicion
from cablecomp.observer import Observer
from cablecomp.recording.arrays import as_recording, columns_of
from cablecomp.recording.mapping import ColumnMap, load_mapping, mapping_from
from cablecomp.recording.replay import Replayed
from cablecomp.recording.replay import replay as _replay
from cablecomp.recording.replay_summary import ReplaySummary
from cablecomp.recording.table import FloatArray
from cablecomp.report import style

Mapped = ColumnMap | Path | str | None
"""What foreign columns mean: a mapping, its file, or words such as `joint_torque_Nm=tau,sign=-1`."""


@dataclass(frozen=True)
class ReplayResult:
    """A replay: `summary` as `replay.json` holds it, `columns`: the predicted channels row by row."""

    summary: ReplaySummary
    columns: Mapping[str, FloatArray]
    doubts: tuple[Suspicion, ...]

    def to_frame(self) -> pl.DataFrame:
        """The prediction, a row for each of the recording's."""
        return pl.DataFrame(dict(self.columns))

    def figure(self) -> go.Figure:
        """Deflection, measured and predicted, over time."""
        return _curves(self.columns, self.summary.joint)


@dataclass(frozen=True)
class CalibrationResult:
    """A calibration: `found` (values, what stays nominal, warnings), `config`: the joint as calibrated."""

    found: Calibration
    doubts: tuple[Suspicion, ...]

    @property
    def config(self) -> JointConfig:
        """The joint with what is known now."""
        return self.found.config

    def to_frame(self) -> pl.DataFrame:
        """A row for each parameter: what was nominal, what it is, its 1-sigma, whether the recordings told it."""
        rows = [(v.name, v.nominal, v.value, v.sd, True) for v in self.found.values]
        rows += [(k.name, k.nominal, k.nominal, k.tolerance * k.nominal, False) for k in self.found.kept]
        names = ("parameter", "nominal", "value", "sd", "told")
        return pl.DataFrame({n: [row[k] for row in rows] for k, n in enumerate(names)})

    def figure(self) -> go.Figure:
        """Each value over its nominal one, with its interval."""
        shown = [v for v in self.found.values if v.nominal]
        ratio = [v.value / float(v.nominal or 1.0) for v in shown]
        bar = {"type": "data", "array": [v.sd / abs(float(v.nominal or 1.0)) for v in shown]}
        marks = {"color": style.PREDICTED, "size": 9}
        fig = go.Figure(
            go.Scatter(x=ratio, y=[v.name for v in shown], error_x=bar, mode="markers", marker=marks)
        )
        fig.add_vline(x=1.0, line={"color": style.BASELINE})
        return fig.update_layout(
            title="calibrated over nominal, 1 sigma", xaxis_title="value / nominal value [1]"
        )


@dataclass(frozen=True)
class DiagnosisResult:
    """A diagnosis: `found`, with `verdict`, `named`, `augmented_joint` and all else that the page shows."""

    found: Diagnosis
    doubts: tuple[Suspicion, ...]

    @property
    def config(self) -> JointConfig:
        """The joint with what was found in it; replay and controller run it."""
        return self.found.augmented_joint

    def to_json(self) -> dict[str, Any]:
        """The contents of `diagnosis.json`."""
        return report_json(self.found)

    def to_frame(self) -> pl.DataFrame:
        """The judged rows of all recordings: measured joint angle, predicted before and after."""
        parts = [
            pl.DataFrame(
                {
                    "recording": [t.name] * len(t.measured_rad),
                    "time_s": t.covariates["time"],
                    "measured_rad": t.measured_rad,
                    "before_rad": t.before_rad,
                    "after_rad": t.after_rad,
                }
            )
            for t in self.found.traces
        ]
        return pl.concat(parts)

    def figure(self) -> go.Figure:
        """What is left of the joint angle over time, before and after."""
        frame = self.to_frame()
        time, measured = frame["time_s"].to_numpy(), frame["measured_rad"].to_numpy()
        fig = go.Figure()
        for name, colour in (("before", style.BASELINE), ("after", style.PREDICTED)):
            left = 1e3 * (measured - frame[f"{name}_rad"].to_numpy())
            fig.add_scattergl(x=time, y=left, name=name, mode="lines", line={"color": colour})
        return fig.update_layout(
            title=f"{self.found.verdict}: what is left",
            xaxis_title="time [s]",
            yaxis_title="measured - predicted [mrad]",
        )


def replay(
    recording: Any, config: JointConfig | Path | str, *, bounds: bool = False, mapping: Mapped = None
) -> ReplayResult:
    """Stream a recording through the observer that the controller runs; compare with what was measured."""
    joint, source = _joint(config), as_recording(recording, _mapping(mapping))
    joint, _, said = as_it_stood(joint, source.path, source.head)
    for line in said:
        warnings.warn(line, stacklevel=2)
    rows = _Rows()
    summary = _replay(source, Observer(joint, bounds=bounds), [rows], config=joint)
    return ReplayResult(summary, rows.columns(), suspicions(joint, rows.measured()))


def calibrate(
    recordings: Any,
    config: JointConfig | Path | str,
    *,
    seed: int = 0,
    sessions: Sessions | None = None,
    mapping: Mapped = None,
    progress: Progress = lambda what, share: None,
    budget_s: float = inf,
) -> CalibrationResult:
    """Fit EA, pretension, friction, ratio and zeros of the nominal drive to one recording or several.

    After `budget_s` [s] no further step begins: the best so far is given, and a warning says so.
    """
    _check(seed, sessions, budget_s)
    joint, data = _joint(config), columns_of(recordings, _mapping(mapping))
    return CalibrationResult(
        _calibrate(joint, data, seed, sessions, progress, budget_s), _doubts(joint, data)
    )


def diagnose(
    recordings: Any,
    config: JointConfig | Path | str,
    *,
    seed: int = 0,
    sessions: Sessions | None = None,
    mapping: Mapped = None,
    progress: Progress = lambda what, share: None,
    budget_s: float = inf,
) -> DiagnosisResult:
    """Find the physics that the configuration lacks in one recording or several.

    After `budget_s` [s] no further hypothesis is begun: what was found by then is weighed, and a warning says so.
    """
    _check(seed, sessions, budget_s)
    joint, data = _joint(config), columns_of(recordings, _mapping(mapping))
    found = _diagnose(joint, data, progress, seed, sessions, budget_s)
    return DiagnosisResult(found, _doubts(joint, data, found.in_time))


class _Rows:
    """Sink that keeps everything, in memory."""

    def __init__(self) -> None:
        self._parts: list[Replayed] = []

    def take(self, replayed: Replayed) -> None:
        self._parts.append(replayed)

    def measured(self) -> dict[str, FloatArray]:
        """The recording's own channels."""
        names = self._parts[0].block.columns
        return {n: np.concatenate([p.block.columns[n] for p in self._parts]) for n in names}

    def columns(self) -> dict[str, FloatArray]:
        """Time, prediction, residual."""
        found = {"time_s": np.concatenate([p.block.columns["time_s"] for p in self._parts])}
        for name in self._parts[0].predicted:
            found[name] = np.concatenate([p.predicted[name] for p in self._parts])
        for name in ("residual_rad", "deflection_measured_rad"):
            values = [getattr(p, name) for p in self._parts]
            if all(v is not None for v in values):
                found[name] = np.concatenate(values)
        return found


def _joint(config: JointConfig | Path | str) -> JointConfig:
    if isinstance(config, JointConfig):
        return config
    if not isinstance(config, str | Path):
        raise InputError(
            f"`config` is a {type(config).__name__}; give a JointConfig (`load_joint`, `parse_joint`) or a file's path"
        )
    return load_joint(config)


def _check(seed: int, sessions: Sessions | None, budget_s: float) -> None:
    """Raise InputError for options that the command line would not take either."""
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"`seed` is {seed!r}; a whole number from 0 on is accepted")
    if sessions is not None and sessions not in get_args(Sessions):
        raise InputError(f"`sessions` is {sessions!r}; {', '.join(get_args(Sessions))} or None is accepted")
    if not budget_s >= 0.0:
        raise InputError(f"`budget_s` is {budget_s!r}; a time from 0 s on is accepted")


def _mapping(given: Mapped) -> ColumnMap | None:
    if given is None or isinstance(given, ColumnMap):
        return given
    text = str(given)
    return load_mapping(Path(text)) if text.endswith(".toml") else mapping_from(text.split())


def _doubts(
    joint: JointConfig, data: Mapping[str, Mapping[str, FloatArray]], found: JointConfig | None = None
) -> tuple[Suspicion, ...]:
    """What hardly fits the drive, and stands beside the joint as it was found."""
    return tuple(
        replace(s, text=f"{name}: {s.text}")
        for name, columns in data.items()
        for s in still_doubted(suspicions(joint, columns), found or joint, columns)
    )


def _curves(columns: Mapping[str, FloatArray], name: str) -> go.Figure:
    fig = go.Figure()
    shown = {
        "deflection_measured_rad": ("measured", style.MEASURED),
        "deflection_rad": ("predicted", style.PREDICTED),
    }
    for key, (words, colour) in shown.items():
        if key in columns:
            fig.add_scattergl(
                x=columns["time_s"], y=1e3 * columns[key], name=words, mode="lines", line={"color": colour}
            )
    return fig.update_layout(
        title=f"{name}: deflection", xaxis_title="time [s]", yaxis_title="deflection [mrad]"
    )
