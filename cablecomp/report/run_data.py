"""What the pages of a run are drawn from: its tables, read back and thinned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from cablecomp.recording.reader import read_all
from cablecomp.recording.thinning import RowThinner

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RunData:
    """Columns of one joint's recording, prediction and cycles, at most `points` rows, one to one."""

    recording: dict[str, Floats]
    prediction: dict[str, Floats]
    cycles: dict[str, Floats]

    @property
    def rows(self) -> int:
        """Rows that there are to draw."""
        return _rows(self.recording)

    @property
    def controlled(self) -> NDArray[np.bool_]:
        """Rows under control, from half a second after it began; in a short run, from a tenth of it on."""
        time, on = self.recording["time_s"], self.cycles["controlled"] > 0.0
        if not np.any(on):
            return np.asarray(on, dtype=np.bool_)
        held = time[on]
        return np.asarray(on & (time > held[0] + min(0.5, 0.1 * (held[-1] - held[0]))), dtype=np.bool_)

    @property
    def time_s(self) -> Floats:
        """Time since control began."""
        time, on = self.recording["time_s"], self.cycles["controlled"] > 0.0
        return np.asarray(time - (time[np.argmax(on)] if np.any(on) else time[0]), dtype=np.float64)

    def column(self, name: str) -> Floats:
        """A column of recording, cycles or prediction, NaN where it is not there."""
        for table in (self.recording, self.cycles, self.prediction):
            if name in table:
                return table[name]
        return np.full(len(self.recording["time_s"]), np.nan)

    @property
    def asked_rad(self) -> Floats:
        """What was asked for at that instant, NaN where nothing was (before control began, after it ended)."""
        asked = self.cycles["reference_position_rad"]
        return np.asarray(np.where(self.cycles["controlled"] > 0.0, asked, np.nan), dtype=np.float64)

    @property
    def is_measured(self) -> bool:
        """Whether a joint encoder was read."""
        return bool(np.any(np.isfinite(self.prediction["residual_rad"])))

    @property
    def joint_rad(self) -> Floats:
        """Where the joint encoder says that the joint is, its offset taken off; of a joint without one where it is
        predicted."""
        p = self.prediction
        off = p["residual_rad"] if self.is_measured else 0.0
        return np.asarray(p["joint_position_rad"] + off, dtype=np.float64)

    def error_rad(self) -> Floats:
        """Joint position, as measured or predicted, less what was asked for."""
        return self.joint_rad - self.asked_rad


def load_run(folder: Path, points: int = 4000) -> RunData:
    """Read what a run left in a joint's folder: the rows that all three tables hold (a disk that filled up may have
    taken more of one than of another); of more than `points` those that hold the extremes of load, errors and residual,
    so that a long run shows what lasted one row, and no slow wave in place of a quick one.
    """
    recording = read_all(folder / "recording.csv").columns
    prediction, cycles = _columns(folder / "prediction.csv"), _columns(folder / "cycles.csv")
    rows = min(_rows(table) for table in (recording, prediction, cycles))
    run = RunData(*({k: v[:rows] for k, v in table.items()} for table in (recording, prediction, cycles)))
    if rows <= points:
        return run
    extremes = {
        "load": run.column("joint_torque_Nm"), "found": run.column("load_estimate_Nm"), "error": run.error_rad(),
        "residual": run.prediction["residual_rad"],
    }  # fmt: skip
    names = tuple(extremes)
    thinner = RowThinner(names, names, buckets=max(1, points // (2 * (1 + 2 * len(names))) - 1))
    thinner.add(extremes)
    chosen = thinner.rows()["row"].astype(np.intp)
    return RunData(
        *({k: v[chosen] for k, v in table.items()} for table in (run.recording, run.prediction, run.cycles))
    )


def _rows(table: dict[str, Floats]) -> int:
    return min((len(column) for column in table.values()), default=0)


def _columns(path: Path) -> dict[str, Floats]:
    if not path.exists() or path.stat().st_size == 0:
        return {}
    table = pl.read_csv(path, infer_schema_length=None)
    return {
        name: np.asarray(table[name].cast(pl.Float64).fill_null(np.nan).to_numpy(), dtype=np.float64)
        for name in table.columns
    }
