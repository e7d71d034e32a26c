"""Command line of the simulation: one JSON line says where it listens, one at the end what it did."""

from __future__ import annotations

import argparse
import json
import math
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NoReturn

from firmware_sim.bench import Bench
from firmware_sim.build import FD_PROTOCOLS, PROTOCOLS, BenchConfig, MakePlant, make_bench
from firmware_sim.errors import SimError
from firmware_sim.faults import describe_faults, parse_fault
from firmware_sim.firmware import DriveConfig, SensorNodeConfig
from firmware_sim.joint import Timing
from firmware_sim.ports import BUSES, open_port
from firmware_sim.runner import run_real_time, run_stepped
from firmware_sim.wire.mit import MODELS
from firmware_sim.wire.tables import SENSOR_BASE, SENSOR_STRIDE


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise SimError(f"{message}; see python -m firmware_sim --help")


def make_parser() -> argparse.ArgumentParser:
    """The options."""
    p = _Parser(
        prog="python -m firmware_sim",
        description="Simulated cable-driven joints behind a real bus driver or serial port.",
        epilog="faults:\n" + describe_faults(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    p.add_argument("--config", type=Path, required=True, help="joint configuration (TOML)")
    p.add_argument(
        "--scenario", type=Path, help="motor, link, loads, effects, faults (firmware_sim/scenario.py)"
    )
    p.add_argument("--bus", required=True, help=BUSES)
    p.add_argument("--link", type=Path, help="symbolic link to the pseudo-terminal (slcan, serial)")
    p.add_argument("--bitrate", type=int, help="bit rate of a real CAN interface")
    p.add_argument("--protocol", choices=PROTOCOLS, default="mit")
    p.add_argument("--model", default="AK80-9", help=f"mit: {', '.join(MODELS)}")
    p.add_argument("--reply-id", type=lambda t: int(t, 0), default=0, help="mit: identifier of the replies")
    p.add_argument("--firmware", choices=("0.5", "0.6"), default="0.6", help="odrive: its firmware")
    p.add_argument("--map", type=Path, help="dbc: map of a maker's messages (firmware_sim/wire/dbc.py)")
    p.add_argument("--joints", type=int, default=1, help="number of joints, numbered from 1")
    pace = p.add_mutually_exclusive_group()
    pace.add_argument("--stepped", nargs="?", const="command", choices=("command", "sync"))
    pace.add_argument("--real-time", action="store_true", help="the default")
    p.add_argument("--fault", action="append", default=[], metavar="SPEC", help="see below; may be repeated")
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--sample-rate", type=float, default=1000.0, help="of the sensor node, Hz")
    p.add_argument("--drive-rate", type=float, default=2000.0, help="of drive and plant, Hz")
    p.add_argument(
        "--torque-limit", type=float, default=DriveConfig.torque_limit_Nm, help="Nm at the input pulley"
    )
    p.add_argument("--velocity-limit", type=float, default=DriveConfig.velocity_limit_rad_s, help="rad/s")
    p.add_argument("--command-timeout", type=float, default=DriveConfig.command_timeout_s, help="s; 0 = none")
    p.add_argument("--index", type=float, help="incremental motor encoder, its index at this angle (rad)")
    p.add_argument("--fault-damping", type=float, default=0.0, help="Nms/rad; brake of a drive in fault")
    p.add_argument("--brake", type=float, default=0.0, help="Nm/rad; holds a drive that is not enabled")
    p.add_argument("--status-every", type=int, default=10, help="samples between two JointN_Status")
    p.add_argument("--duration", type=float, default=math.inf, help="end after this many seconds")
    p.add_argument("--until-stdin-closes", action="store_true", help="end when standard input closes")
    return p


def bench_config(options: argparse.Namespace) -> BenchConfig:
    """The bench that the options ask for; raises SimError."""
    ratio = options.drive_rate / options.sample_rate if options.sample_rate > 0.0 else 0.0
    if not (ratio >= 1.0 and abs(ratio - round(ratio)) < 1e-9):
        raise SimError(f"--drive-rate {options.drive_rate} must be a whole multiple of --sample-rate")
    drive = DriveConfig(
        torque_limit_Nm=options.torque_limit,
        velocity_limit_rad_s=options.velocity_limit,
        command_timeout_s=options.command_timeout,
        index_position_rad=options.index,
        fault_damping_Nms_per_rad=options.fault_damping,
        brake_Nm_per_rad=options.brake,
    )
    return BenchConfig(
        protocol=options.protocol,
        joints=options.joints,
        model=options.model,
        reply_id=options.reply_id,
        map_path=options.map,
        firmware=options.firmware,
        drive=drive,
        sensor=SensorNodeConfig(status_every=options.status_every),
        timing=replace(Timing(), step_s=1.0 / options.drive_rate, steps_per_sample=round(ratio)),
        stepping=options.stepped or "command",
    )


def main(arguments: Sequence[str] | None = None, make_plant: MakePlant | None = None) -> int:
    """Run until asked to end; returns the exit code (2 for bad input)."""
    try:
        options = make_parser().parse_args(arguments)
        config = bench_config(options)
        specs = list(options.fault)
        maker = make_plant
        if maker is None:
            from firmware_sim import scenario  # compiled code: only where a plant is wanted

            told = (
                scenario.Scenario() if options.scenario is None else scenario.load_scenario(options.scenario)
            )
            maker = scenario.plant_maker(options.config, told, options.seed)
            specs += told.faults
        faults = [parse_fault(text, options.seed + i) for i, text in enumerate(specs)]
        if (options.bus == "dynamixel") != (config.protocol == "dynamixel"):
            raise SimError("--bus dynamixel and --protocol dynamixel go together; both or none are accepted")
        port = open_port(options.bus, options.link, options.bitrate, fd=config.protocol in FD_PROTOCOLS)
        try:
            bench = make_bench(config, maker, port, faults)
            return _run(bench, options)
        finally:
            port.close()
    except (SimError, ValueError) as error:
        print(f"firmware_sim: {' '.join(str(error).split())}", file=sys.stderr)
        return 2


def _run(bench: Bench, options: argparse.Namespace) -> int:
    stop = _stop_signal(options)
    pace = "real-time" if options.stepped is None else f"stepped by {options.stepped}"
    sample_s = bench.joints[0].timing.sample_s
    _tell(
        listening=True,
        pid=os.getpid(),
        **bench.port.describe(),
        protocol=options.protocol,
        joints=len(bench.joints),
        pace=pace,
        sample_period_s=sample_s,
        drive_identifiers=[f"0x{min(j.wire.identifiers()):X}" for j in bench.joints],
        sensor_identifiers=[f"0x{SENSOR_BASE + SENSOR_STRIDE * (j.number - 1):X}" for j in bench.joints],
    )
    report = run_real_time(bench, stop, sample_s) if options.stepped is None else run_stepped(bench, stop)
    lost = max(j.lost_s for j in bench.joints)
    _tell(ended=True, simulated_s=round(bench.time_s, 6), lost_s=round(lost, 6), **asdict(report))
    return 0


def _tell(**what: Any) -> None:
    print(json.dumps(what), flush=True)


def _stop_signal(options: argparse.Namespace) -> Callable[[], bool]:
    """SIGTERM, ctrl-c, the duration, and on request the end of standard input."""
    asked: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda received, frame: asked.append(received))
    end = time.monotonic() + options.duration
    watch = options.until_stdin_closes
    next_look = [0.0]

    def stop() -> bool:
        now = time.monotonic()
        if asked or now >= end:
            return True
        if watch and now >= next_look[0]:
            next_look[0] = now + 0.1
            if select.select([0], [], [], 0.0)[0]:
                return not os.read(0, 4096)
        return False

    return stop
