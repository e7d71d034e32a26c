"""`cablecomp calibrate`."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.beliefs import believe_all
from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import (
    BudgetOption,
    ChanceOption,
    Config,
    EffectsOption,
    JsonOption,
    announce_compilation,
    console,
    read_joint,
    share_bar,
)
from cablecomp.cli.sources import Reading, read_moving, reads_recordings
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.recording.atomic import atomic_directory
from cablecomp.report.calibration import calibrated_text, calibration_json, calibration_summary


@reads_recordings
def calibrate_joint(
    *,
    recordings: Annotated[
        list[Path], typer.Argument(help="recordings of one joint, or folders: all recordings in them")
    ],
    config: Config,
    out: Annotated[Path, out_option("folder for joint.calibrated.toml, calibration.json")] = Path(
        "calibration"
    ),
    seed: ChanceOption = 0,
    budget: BudgetOption = inf,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    reading: Reading,
) -> None:
    """What the drive's values are, with honest intervals: EA, pretension, friction, ratio, zeros; old -> new."""
    joint = read_joint(config, effects)
    data = read_moving(recordings, reading(joint), "calibration")
    announce_compilation()
    doubted = believe_all(joint, data)
    with share_bar() as progress:
        found = calibrate(joint, data, seed, progress=progress, budget_s=budget)
    found = replace(found, warnings=(*doubted.lines, *found.warnings))
    with atomic_directory(out) as folder:
        (folder / "joint.calibrated.toml").write_text(calibrated_text(found), encoding="utf-8")
        text = json.dumps(calibration_json(found), indent=1)
        (folder / "calibration.json").write_text(text + "\n", encoding="utf-8")
    if as_json:
        typer.echo(text)
        return
    console.print(calibration_summary(found))
    console.print(f"written: {out / 'joint.calibrated.toml'}", soft_wrap=True)
