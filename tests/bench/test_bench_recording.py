"""Speed of reading, writing and recording; run with `pytest tests/bench --benchmark-only`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from cablecomp.recording.reader import open_recording
from cablecomp.recording.recorder import Recorder
from cablecomp.recording.writer import write_canonical

ROWS = 500_000
CHANNELS = (
    "time_s",
    "motor_position_rad",
    "joint_position_rad",
    "joint_torque_Nm",
    "tension_h_N",
    "tension_l_N",
)


def _columns() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    return {name: rng.standard_normal(ROWS) for name in CHANNELS} | {"time_s": np.arange(ROWS) * 1e-3}


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "parquet"])
def test_reading(benchmark: Any, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{ending}"
    if ending == "parquet":
        pl.DataFrame(_columns()).write_parquet(path)
    else:
        write_canonical(path, _columns())
    rows = benchmark(lambda: sum(block.rows for block in open_recording(path).blocks()))
    benchmark.extra_info["rows_per_s"] = rows / benchmark.stats.stats.median
    assert rows / benchmark.stats.stats.median > 1e6


def test_writing(benchmark: Any, tmp_path: Path) -> None:
    columns = _columns()
    benchmark(lambda: write_canonical(tmp_path / "a.csv", columns))
    benchmark.extra_info["rows_per_s"] = ROWS / benchmark.stats.stats.median


def test_one_append_of_the_live_recorder(benchmark: Any, tmp_path: Path) -> None:
    row = tuple(float(k) for k in range(len(CHANNELS)))
    with Recorder(tmp_path / "live.csv", CHANNELS) as recorder:
        benchmark(recorder.append, row)
    assert benchmark.stats.stats.median < 10e-6
