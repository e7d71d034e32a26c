"""One row of a fleet: what a night says of its joint, replayed or diagnosed. Run in processes and on clusters."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from cablecomp.config import load_joint
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import report_json
from cablecomp.estimation.standing import as_it_stood
from cablecomp.fleet.change import change
from cablecomp.fleet.places import Night
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording, read_all
from cablecomp.recording.replay import Replayed, comparable, replay
from cablecomp.recording.streams import Moments
from cablecomp.signal.smoothing import FloatArray

Row = dict[str, Any]
_PARTS: Final = 32
"""Parts of equal length of a recording, by whose means a slip within it shows."""
_LEAST: Final = 64
"""Rows of the shortest part."""


class Parts:
    """Mean residual of equal parts of a stream of unknown length: parts are joined in pairs when there are too many."""

    def __init__(self) -> None:
        self._length, self._sums, self._open, self._count = _LEAST, list[float](), 0.0, 0

    def add(self, values: Any) -> None:
        """Take in a block; what is not finite counts as the part's mean."""
        for value in np.array_split(values, max(1, len(values) // _LEAST)):
            usable = value[np.isfinite(value)]
            self._open += float(usable.sum()) * len(value) / max(1, len(usable))
            self._count += len(value)
            if self._count >= self._length:
                self._sums.append(self._open / self._count)
                self._open, self._count = 0.0, 0
            if len(self._sums) >= 2 * _PARTS:
                self._sums = [0.5 * (a + b) for a, b in zip(self._sums[::2], self._sums[1::2], strict=True)]
                self._length *= 2

    def means(self) -> list[float]:
        """Means so far, in order."""
        return list(self._sums)


class Compliance:
    """Least-squares slopes against the load: of the predicted deflection, and of what was measured beyond it."""

    def __init__(self) -> None:
        self._n, self._sums, self._predicted_sum = 0, np.zeros(5), 0.0

    def add(self, load: Any, predicted: Any, residual: Any) -> None:
        """Take in a block; rows with a gap do not count."""
        rows = np.isfinite(load) & np.isfinite(predicted) & np.isfinite(residual)
        m, d, r = load[rows], predicted[rows], residual[rows]
        self._n += len(m)
        self._sums += (m.sum(), d.sum() + r.sum(), m @ m, m @ d, m @ r)
        self._predicted_sum += float(d.sum())

    def ratio(self) -> float | None:
        """Measured over predicted compliance; None without load or prediction."""
        if not self._n:
            return None
        m, both, mm, md, mr = self._sums / self._n
        d = self._predicted_sum / self._n
        variance, with_d, with_r = mm - m * m, md - m * d, mr - m * (both - d)
        return float(1.0 + with_r / with_d) if variance > 0.0 and with_d != 0.0 else None


class Kept:
    """Sink that keeps of a night's replay what its row needs, in bounded memory."""

    def __init__(self) -> None:
        self.parts, self.loads, self.compliance = Parts(), Parts(), Compliance()
        self.residual, self.next_less_this = Moments(), Moments()

    def take(self, replayed: Replayed) -> None:
        """Take in one replayed block."""
        if replayed.residual_rad is None:
            return
        usable = replayed.residual_rad[np.isfinite(replayed.residual_rad)]
        self.residual.add(usable)
        self.next_less_this.add(np.diff(usable))
        self.parts.add(replayed.residual_rad)
        if replayed.load_Nm is not None:
            self.loads.add(replayed.load_Nm)
            self.compliance.add(replayed.load_Nm, replayed.predicted["deflection_rad"], replayed.residual_rad)


def replayed_row(night: Night) -> Row:
    """Replay a night's recordings one by one, in bounded memory, whatever their length."""
    sink, samples, seconds = Kept(), 0, 0.0
    for path in night.recordings:
        nominal = load_joint(night.config)
        recording = comparable(open_recording(path), nominal)
        joint, _, _ = as_it_stood(nominal, path, recording.head)
        summary = replay(recording, Observer(joint), [sink], config=joint)
        samples, seconds = samples + summary.samples, seconds + summary.duration_s
    compared = sink.residual.count > 0
    return {
        "samples": samples,
        "duration_s": seconds,
        "rmse_rad": sink.residual.rms if compared else None,
        "zero_rad": sink.residual.mean if compared else None,
        "compliance_ratio": sink.compliance.ratio(),
        "step_within_rad": step_within(sink) if compared else 0.0,
    }


def step_within(sink: Kept) -> float:
    """By how much the zero steps within a night [rad], beyond what follows the load; 0 where it does not.

    Friction remembers noise: a step that single readings hide is none.
    """
    means, loads = np.array(sink.parts.means()), np.array(sink.loads.means())
    if len(means) < _PARTS // 2:
        return 0.0
    if len(loads) == len(means) and np.ptp(loads) > 0.0:
        m = loads - loads.mean()
        means = means - (m @ means) / (m @ m) * m
    found = change(means, _scatter(means))
    noise = sink.next_less_this.rms / np.sqrt(2.0)
    return found.size if found.how == "step" and abs(found.size) > noise else 0.0


def _scatter(means: FloatArray) -> float:
    """What one part's mean is good for: the median change from part to part, which a single step does not move."""
    return float(np.median(np.abs(np.diff(means)))) / 0.954 if len(means) > 2 else 0.0


def diagnosed_row(night: Night) -> Row:
    """Diagnose a night's recordings as one body of evidence."""
    data = {str(path): read_all(path, gaps=True).columns for path in night.recordings}
    found = report_json(diagnose(load_joint(night.config), data))
    named = found["missing_physics"]
    return {
        "samples": sum(len(columns["time_s"]) for columns in data.values()),
        "verdict": found["verdict"],
        "missing": ", ".join(m["effect"] for m in named),
        "confidence": min((m["confidence"] for m in named), default=None),
        "before_rad": found["baseline"]["heldout_rmse_rad"],
        "after_rad": found["augmented"]["heldout_rmse_rad"],
        **{name: entry["value"] for name, entry in found["calibration"].items() if entry["session"] is None},
    }
