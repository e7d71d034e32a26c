"""One recording of ten million rows through `cablecomp replay` in one pass, and the most memory that it takes:
`python tests/soak/long_recording.py [--rows 10000000] [--ending csv] [--no-bounds]`.

The file is written in pieces into a temporary folder. Exit code 1 where replay fails, a row is missing in what it
writes, or it takes 2 GB.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from cablecomp.config import load_joint

JOINT = "snow-closed-rig"
RATE_HZ = 1000.0
PIECE = 500_000
MOST_MB = 2000.0


def columns(first: int, rows: int) -> dict[str, np.ndarray]:
    """A piece of the recording: motor and load swing at rates that never fall in step; the drive is a straight line."""
    ratio = load_joint(JOINT).drive.ratio
    t = (first + np.arange(rows)) / RATE_HZ
    motor, load = 0.8 * np.sin(0.9 * t), 1.2 * np.sin(2.1 * t)
    noise = 1e-5 * np.random.default_rng(first).standard_normal(rows)
    joint = ratio * motor + load / 200.0 + noise
    return {
        "time_s": t,
        "motor_position_rad": motor.round(6),
        "joint_position_rad": joint.round(6),
        "joint_torque_Nm": load.round(6),
    }


def write(path: Path, rows: int) -> None:
    """The whole recording, piece by piece; Parquet by way of the CSV, without holding it."""
    text = path.with_suffix(".csv")
    with text.open("wb") as file:
        for first in range(0, rows, PIECE):
            piece = pl.DataFrame(columns(first, min(PIECE, rows - first)))
            piece.write_csv(file, include_header=first == 0)
    if path.suffix == ".parquet":
        pl.scan_csv(text).sink_parquet(path)
        text.unlink()


def main(arguments: Sequence[str] | None = None) -> int:
    """Write, replay, and say what it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--ending", choices=("csv", "parquet"), default="csv")
    parser.add_argument("--no-bounds", action="store_true")
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        path = folder / f"long.{asked.ending}"
        write(path, asked.rows)
        size_MB = path.stat().st_size / 1e6
        command = [sys.executable, "-m", "cablecomp.cli", "replay", str(path), "--config", JOINT, "--json"]
        command += ["--out", str(folder / "out"), *(["--no-bounds"] if asked.no_bounds else [])]
        began = time.monotonic()
        done = subprocess.run(command, stdout=subprocess.PIPE, check=False)
        took_s = time.monotonic() - began
        if done.returncode != 0:
            return 1
        most_MB = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
        found = json.loads(done.stdout)
        with (folder / "out/prediction.csv").open("rb") as file:
            lines = sum(part.count(b"\n") for part in iter(lambda: file.read(1 << 22), b"")) - 1
        print(f"{asked.rows:,} rows, {size_MB:.0f} MB: {took_s:.0f} s, {most_MB:.0f} MB of memory at most, "
              f"page {(folder / 'out/report.html').stat().st_size / 1e6:.1f} MB")  # fmt: skip
        return 0 if found["samples"] == lines == asked.rows and most_MB < MOST_MB else 1


if __name__ == "__main__":
    sys.exit(main())
