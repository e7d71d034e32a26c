"""`cablecomp demo`, and the comparison that `run --compare` makes as well."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from math import nan
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import DEMO_LINK, JsonOption, announce_compilation, console, echo_json, errors
from cablecomp.cli.simulation import start_simulation, true_values
from cablecomp.config import JointConfig, load_joint
from cablecomp.config_text import joint_text
from cablecomp.control.options import ControlConfig, load_control
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.diagnosis.result import Value
from cablecomp.examples import example
from cablecomp.links.load import load_link
from cablecomp.links.schema import LinkConfig
from cablecomp.report.compare_page import HEADERS, feedback_words, summary_rows, write_comparison
from cablecomp.report.measured import with_sd
from cablecomp.runtime.compare import Calibrated, Columns, CompareOptions, Comparison, compare
from cablecomp.runtime.setup import matched
from cablecomp.runtime.view import LiveView

DEMO = "wrist-capstan"


def demo(
    out: Annotated[Path, out_option("folder for everything that the demonstration leaves")] = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="of true parameters, noise and motions")] = 1,
    as_json: JsonOption = False,
) -> None:
    """A compensated joint against uncompensated ones, on a simulated bus; ends with where the report lies."""
    path = example("joints", DEMO)
    joint, wanted = load_joint(path), load_control(example("control", DEMO))
    bus, wanted = matched(load_link(DEMO_LINK), wanted, own_link=False)
    compare_controllers(path, joint, bus, wanted, out, seed, 14.0, as_json)


def compare_controllers(
    path: Path,
    joint: JointConfig,
    bus: LinkConfig,
    wanted: ControlConfig,
    out: Path,
    seed: int,
    duration_s: float,
    as_json: bool,
) -> None:
    """Run motor-side control, linear stiffness and observer side by side on simulated joints; show and write it."""
    announce_compilation(joint)
    with LiveView(errors() if as_json else console) as view:
        found = compare(
            joint,
            bus,
            wanted,
            lambda wish: start_simulation(path, wish),
            partial(_calibrated, true_values(path, seed)),
            CompareOptions(out, seed, duration_s, min(10.0, duration_s)),
            time.perf_counter,
            view.say,
            view.watch,
        )
    page = write_comparison(found, out, joint_text(found.calibrated.config))
    if as_json:
        echo_json({**found.as_dict(), "report": page})
        return
    _summary(found)
    console.print(f"report: {page}")


def _calibrated(truth: Mapping[str, float], config: JointConfig, columns: Columns) -> Calibrated:
    found = calibrate(config, {"calibration": columns})
    rows = [(v.name, _beside(v, truth.get(v.name))) for v in found.values]
    rows += [
        (k.name, f"not told: nominal {k.nominal:.5g}, truth {truth.get(k.name, nan):.5g}") for k in found.kept
    ]
    return Calibrated(found.config, tuple(rows), found.warnings)


def _beside(v: Value, true: float | None) -> str:
    """A value with its sd, what was nominal and what the simulation was given."""
    nominal = "" if v.nominal is None else f"nominal {v.nominal:.5g}"
    known = "" if true is None else f", truth {true:.5g}: {abs(v.value - true) / v.sd:.1f} sd off"
    return f"{with_sd(v.value, v.sd)} ({nominal}{known})"


def _summary(found: Comparison) -> None:
    table = Table(title="Joint-side error under unseen motions with load changes")
    for name in HEADERS:
        table.add_column(name, justify="left" if name == "controller" else "right")
    for row in summary_rows(found):
        table.add_row(*row)
    console.print(table)
    console.print(feedback_words(found))
    joint = found.force.joints[0]
    console.print(
        f"force without torque sensor: RMS error {joint.true_torque_Nm:.4f} Nm, "
        f"{100 * found.force_share:.2f} % of range"
    )
    for name, words in found.open_loop.timing.rows():
        console.print(f"{name}: {words}", style="dim")
