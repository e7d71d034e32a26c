"""The numbers of a replay, and `replay.json`."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from cablecomp.recording.snapshots import Snapshot


@dataclass(frozen=True)
class ReplaySummary:
    """Numbers of a replay, as `replay.json` holds them; None = the recording cannot say.

    rmse, mean, sd and max (largest magnitude) are of the residual; the baseline is the best straight line of
    measured deflection against load; the range is that of measured (else predicted) deflection; bounds widths
    are high - low where first known and at the last row.
    """

    recording: str
    joint: str
    samples: int
    duration_s: float
    rmse_rad: float | None
    mean_rad: float | None
    sd_rad: float | None
    max_rad: float | None
    baseline_linear_rmse_rad: float | None
    baseline_linear_slope_rad_per_Nm: float | None
    baseline_linear_offset_rad: float | None
    deflection_range_rad: float
    joint_position_offset_rad: float
    bounds_width_first_rad: float | None
    bounds_width_last_rad: float | None
    samples_per_s: float
    observer_samples_per_s: float
    gaps: tuple[dict[str, float], ...] = ()
    notes: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    snapshots: tuple[Snapshot, ...] = field(default=(), compare=False)

    def to_json(self) -> str:
        """Return the text of `replay.json` (without the profiles); a number that is not finite is null."""
        values = asdict(replace(self, snapshots=()))
        del values["snapshots"]
        return json.dumps({"schema": 1} | {k: _json(v) for k, v in values.items()}, indent=2) + "\n"


def _json(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
