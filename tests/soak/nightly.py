"""Hours of control with a fault every minute, in simulated time:
`nice -n 19 python tests/soak/nightly.py --hours 100 [--rate 100] [--out out/soak]`.

At 100 Hz, on a drive with a rotor that such a loop can hold, a simulated hour takes four to five minutes of one
core: the code is the same at every rate, and hours are what is asked for. `--rate 1000` is the wrist as shipped, at
five to six times the cost.

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
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
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
from cablecomp.control.compensator import Gains
from cablecomp.control.design import design_gains
from cablecomp.control.options import ControlConfig
from cablecomp.control.standard import reaching_protocol
from cablecomp.errors import DeviceError, InputError
from cablecomp.links.schema import LinkConfig
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.minutes import resident_MB
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.simulated import SimulationWish
from firmware_sim.hosted import HostedJoints
from firmware_sim.joint import Timing

SHIPPED_HZ = 1000.0
HELD = {"stiffness_Nm_per_rad": 10.0, "damping_Nms_per_rad": 0.15}
"""How the drive of a slow loop holds its rotor: what it pulls within one period against the motion stays below what the
torque sensor may differ by."""
HEAVY = {"inertia_kgm2": 2e-3, **HELD}
SLOW = {"motor_rate_rad_s": 12.0, "joint_rate_rad_s": 4.0}
"""What such a joint does not exceed: a sample may be off by ten times as much as at 1 kHz before it is implausible."""
STEP_S = 2e-3
GOES_ON = "time is over"
FAULTS = (
    ("", (GOES_ON,)),
    ("drop:p=0.2", (GOES_ON,)),
    ("repeat:p=1", (GOES_ON,)),
    ("reorder:p=0.1,spread={two},direction=tx", (GOES_ON,)),
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
    ("late:delay={six},direction=tx", ("sensor data come late", "motor position is stale")),
)
"""A fault without its beginning (`{two}`, `{six}` periods of the loop, in s), and the reasons of which one has to be
named at the stop."""
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
    open_files: int
    threads: int
    step_p50_us: float
    step_p99_us: float
    wall_s: float


class Bench(NamedTuple):
    """The link, at the rate asked for, and the motor and controller behind it."""

    link: LinkConfig
    control: ControlConfig


def bench_at(rate_Hz: float) -> Bench:
    """The wrist on its virtual bus; below its own rate all times are longer in proportion, the rotor is heavier and the
    gains are those designed for it."""
    link, control = matched_link("wrist-virtual")
    if rate_Hz == SHIPPED_HZ:
        return Bench(link, control)
    slower = SHIPPED_HZ / rate_Hz
    times = {name: value * slower for name, value in link.timeouts.model_dump().items()}
    ends = link.joint[0]
    assert ends.motor is not None
    motor = ends.motor.model_copy(update=HELD)
    link = link.model_copy(
        update={
            "rate_Hz": rate_Hz,
            "timeouts": link.timeouts.model_copy(update=times),
            "joint": (ends.model_copy(update={"motor": motor}),),
        }
    )
    open_gains = dict.fromkeys(Gains._fields)
    control = control.model_copy(
        update={
            "health": control.health.model_copy(update=SLOW),
            "motor": control.motor.model_copy(update={**HEAVY, "delay_s": 1.0 / rate_Hz}),
            "compensator": control.compensator.model_copy(update=open_gains),
        }
    )
    gains = design_gains(load_joint(JOINT), rate_Hz, control)
    given = control.compensator.model_copy(update=gains._asdict())
    return Bench(link, control.model_copy(update={"compensator": given}))


def one_minute(number: int, folder: Path, resume: Path | None, rng: random.Random, bench: Bench) -> Minute:
    """Run one minute; raises AssertionError that says what did not hold."""
    began = time.monotonic()
    kind, reasons = rng.choice(FAULTS)
    link, control = bench
    kind = kind.format(two=2.0 / link.rate_Hz, six=6.0 / link.rate_Hz)
    begin_s = round(rng.uniform(2.0, MINUTE_S - 10.0), 3)
    faults = (f"{kind}{'' if kind.endswith(':') else ','}start={begin_s}",) if kind else ()
    joint = load_joint(JOINT)
    simulation = start_simulation(JOINT, SimulationWish(link, control, 1, False, number, faults))
    if link.rate_Hz < SHIPPED_HZ:
        slow_down(simulation, link.rate_Hz)
    protocol = reaching_protocol(joint, rng.randrange(10**6), MINUTE_S)
    options = RunOptions(MINUTE_S, True, folder, resume=resume)
    try:
        report = run_joint(joint, link, control, protocol, options, simulation)
    except DeviceError as error:
        raise AssertionError(f"{faults}: {error}") from error
    finally:
        simulation.close()
    stop = report.stop_reason
    assert any(reason in stop for reason in reasons), (
        f"{faults}: stopped by `{stop}`, not by one of {reasons}"
    )
    assert not report.failures, report.failures
    check_files(folder, link.rate_Hz)
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
        len(os.listdir("/proc/self/fd")),
        threading.active_count(),
        round(1e6 * steps.p50_s, 2),
        round(1e6 * steps.p99_s, 2),
        round(time.monotonic() - began, 1),
    )


def slow_down(simulation: HostedJoints, rate_Hz: float) -> None:
    """Steps of drive and plant that a heavy rotor allows; and a brake, as its load has long to run away with it."""
    steps = round(1.0 / (rate_Hz * STEP_S))
    for joint in simulation.bench.joints:
        joint.timing = Timing(1.0 / (rate_Hz * steps), steps)
        c = joint.drive.config
        damping, stiffness = c.velocity_gain_Nms_per_rad, c.velocity_gain_Nms_per_rad * c.position_gain_per_s
        joint.drive.config = replace(c, fault_damping_Nms_per_rad=damping, brake_Nm_per_rad=stiffness)


def check_files(folder: Path, rate_Hz: float) -> None:
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
    assert np.allclose(np.diff(cycles), 1.0 / rate_Hz), "cycles are missing"
    taken_up.load(folder / "observer.snapshot")
    assert taken_up.snapshot() == replayed.snapshot(), "replay does not end in the state that was saved"


def growth(minutes: Sequence[Minute]) -> list[str]:
    """What is greater in the last third than in the second: memory by more than 2 %, files, step time by half."""
    third = len(minutes) // 3
    if third < 5:
        return []
    found = []
    for name, factor in (
        ("memory_MB", 1.02),
        ("files", 1.0),
        ("open_files", 1.0),
        ("threads", 1.0),
        ("step_p50_us", 1.5),
    ):
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
    parser.add_argument("--rate", type=float, default=100.0, help="of the loop (Hz)")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    rng = random.Random(asked.seed)
    minutes: list[Minute] = []
    bench = bench_at(asked.rate)
    resume: Path | None = None
    kept = asked.out / "resume.snapshot"
    simulated_s = 0.0
    with (asked.out / f"minutes-{asked.seed}.jsonl").open("w", encoding="utf-8") as log:
        while simulated_s < 3600.0 * asked.hours:
            folder = asked.out / f"minute-{len(minutes) + 1}"
            try:
                minute = one_minute(len(minutes) + 1, folder, resume, rng, bench)
            except (AssertionError, InputError) as error:
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
