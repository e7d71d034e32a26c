"""Hours of control with a fault every minute, in simulated time:
`nice -n 19 python tests/soak/nightly.py --hours 100 [--out out/soak]`.

One joint's life: every minute is a run of its own that resumes from the snapshot of the one before, with a fault drawn
at random that begins somewhere in it. After each: the stop has its true reason, every row that the observer took is on
the disk, and the recording replayed from the minute's first snapshot gives its last, bit for bit. Exit code 1, and the
minute's folder kept, where one of these does not hold, or where memory, files or step time have grown in the end.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/system"))

# ruff: noqa: E402 -- the helpers of the system tests are found by the line above
from fault_runs import JOINT, matched_link

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.control.standard import reaching_protocol
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.minutes import resident_MB
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.simulated import SimulationWish

GOES_ON = "time is over"
FAULTS = (
    ("", (GOES_ON,)),
    ("drop:p=0.2", (GOES_ON,)),
    ("repeat:p=1", (GOES_ON,)),
    ("reorder:p=0.1,spread=0.002,direction=tx", (GOES_ON,)),
    ("jump:which=joint,p=0.05", (GOES_ON,)),
    ("stuck:which=joint", (GOES_ON,)),
    ("reset:node=sensor", (GOES_ON,)),
    ("drop:p=1", ("motor position is stale",)),
    ("bus_off:", ("motor position is stale",)),
    ("silent:node=drive", ("motor position is stale",)),
    ("silent:node=sensor", ("joint torque is stale",)),
    ("silent:node=both", ("motor position is stale",)),
    ("reset:node=drive", ("motor position is stale", "drive reports")),
    ("stuck:which=motor", ("motor encoder is stuck", "encoders disagree", "motor does not follow")),
    ("jump:which=motor,jump=0.5", ("motor encoder jumped", "drive reports fault")),
    ("offset:channel=joint_torque_Nm,offset=0.9", ("torque sensor disagrees with motor torque",)),
    ("late:delay=0.006,direction=tx", ("sensor data come late", "motor position is stale")),
)
"""A fault without its beginning, and the reasons of which one has to be named at the stop."""
MINUTE_S = 60.0


class Minute(NamedTuple):
    """One minute as it came to an end."""

    number: int
    fault: str
    stop: str
    simulated_s: float
    memory_MB: float
    files_MB: float
    files: int
    step_p50_us: float
    step_p99_us: float
    wall_s: float


def one_minute(number: int, folder: Path, resume: Path | None, rng: random.Random) -> Minute:
    """Run one minute; raises AssertionError that says what did not hold."""
    began = time.monotonic()
    kind, reasons = rng.choice(FAULTS)
    begin_s = round(rng.uniform(2.0, MINUTE_S - 10.0), 3)
    faults = (f"{kind}{'' if kind.endswith(':') else ','}start={begin_s}",) if kind else ()
    link, control = matched_link("wrist-virtual")
    joint = load_joint(JOINT)
    simulation = start_simulation(JOINT, SimulationWish(link, control, 1, False, number, faults))
    protocol = reaching_protocol(joint, rng.randrange(10**6), MINUTE_S)
    options = RunOptions(MINUTE_S, True, folder, resume=resume)
    try:
        report = run_joint(joint, link, control, protocol, options, simulation)
    finally:
        simulation.close()
    stop = report.stop_reason
    assert any(reason in stop for reason in reasons), (
        f"{faults}: stopped by `{stop}`, not by one of {reasons}"
    )
    assert not report.failures, report.failures
    check_files(folder)
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    steps = report.timing.step
    return Minute(
        number,
        kind or "none",
        stop,
        report.timing.ticks / link.rate_Hz,
        round(resident_MB(), 1),
        round(sum(sizes) / 1e6, 2),
        len(sizes),
        round(1e6 * steps.p50_s, 2),
        round(1e6 * steps.p99_s, 2),
        round(time.monotonic() - began, 1),
    )


def check_files(folder: Path) -> None:
    """Nothing recorded is lost: as many rows as cycles, and replay ends in the very state that was saved."""
    config = load_joint(folder / "joint.toml")
    taken_up, replayed = Observer(config), Observer(config)
    if (folder / "start.snapshot").exists():
        replayed.load(folder / "start.snapshot")
    rows = 0
    for block in open_recording(folder / "recording.csv").blocks():
        rows += block.rows
        replayed.run(block.columns)
    cycles = pl.read_csv(folder / "cycles.csv", infer_schema_length=None)["time_s"].to_numpy()
    assert rows == len(cycles), f"{rows} rows recorded, {len(cycles)} cycles"
    assert np.allclose(np.diff(cycles), 1e-3), "cycles are missing"
    taken_up.load(folder / "observer.snapshot")
    assert taken_up.snapshot() == replayed.snapshot(), "replay does not end in the state that was saved"


def growth(minutes: Sequence[Minute]) -> list[str]:
    """What is greater in the last third than in the second: memory by more than 2 %, files, step time by half."""
    third = len(minutes) // 3
    if third < 5:
        return []
    found = []
    for name, factor in (("memory_MB", 1.02), ("files", 1.0), ("step_p50_us", 1.5)):
        middle, last = (
            float(np.median([getattr(m, name) for m in part]))
            for part in (minutes[third : 2 * third], minutes[2 * third :])
        )
        if last > factor * middle:
            found.append(f"{name} grew from {middle:g} to {last:g}")
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run for so many hours of simulated time; returns 1 if something did not hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=100.0, help="of simulated time")
    parser.add_argument("--out", type=Path, default=Path("out/soak"))
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    rng = random.Random(asked.seed)
    minutes: list[Minute] = []
    resume: Path | None = None
    kept = asked.out / "resume.snapshot"
    simulated_s = 0.0
    with (asked.out / f"minutes-{asked.seed}.jsonl").open("w", encoding="utf-8") as log:
        while simulated_s < 3600.0 * asked.hours:
            folder = asked.out / f"minute-{len(minutes) + 1}"
            try:
                minute = one_minute(len(minutes) + 1, folder, resume, rng)
            except AssertionError as error:
                print(f"minute {len(minutes) + 1}, {folder}: {error}", flush=True)
                return 1
            os.replace(folder / "observer.snapshot", kept)
            shutil.rmtree(folder)
            resume = kept
            minutes.append(minute)
            simulated_s += minute.simulated_s
            log.write(json.dumps(minute._asdict()) + "\n")
            log.flush()
    grown = growth(minutes)
    for words in grown:
        print(words)
    print(f"{simulated_s / 3600.0:.2f} h in {len(minutes)} runs, memory {minutes[-1].memory_MB} MB")
    return 1 if grown else 0


if __name__ == "__main__":
    sys.exit(main())
