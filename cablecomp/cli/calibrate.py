"""`cablecomp calibrate`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.beliefs import believe
from cablecomp.cli.shared import (
    Config,
    EffectsOption,
    JsonOption,
    announce_compilation,
    console,
    read_joint,
    share_bar,
)
from cablecomp.cli.sources import DbcOption, JointOption, LinkOption, MapOption, sources
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.errors import path_text
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.folder import find_recordings
from cablecomp.recording.inspection import require_motion
from cablecomp.report.calibration import calibrated_text, calibration_json, calibration_summary


def calibrate_joint(
    recordings: Annotated[
        list[Path], typer.Argument(help="recordings of one joint, or folders: all recordings in them")
    ],
    config: Config,
    out: Annotated[Path, typer.Option(help="folder for joint.calibrated.toml, calibration.json")] = Path(
        "calibration"
    ),
    seed: Annotated[int, typer.Option(min=0, help="of the noise that the fit is shaken with")] = 0,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    words: MapOption = None,
    link: LinkOption = None,
    dbc: DbcOption = None,
    which: JointOption = None,
) -> None:
    """What the drive's values are, with honest intervals: EA, pretension, friction, ratio, zeros; old -> new."""
    joint = read_joint(config, effects)
    reading = sources(words, link, dbc, which, joint)
    data = {path_text(path): reading.read(path, gaps=True).columns for path in find_recordings(recordings)}
    for name, columns in data.items():
        require_motion({"joint_position_rad": columns.get("joint_position_rad", columns["time_s"])}, name)
    announce_compilation()
    doubted = [line for name, columns in data.items() for line in believe(joint, name, columns)]
    with share_bar() as told:
        found = calibrate(joint, data, seed, progress=told)
    found = replace(found, warnings=(*doubted, *found.warnings))
    with atomic_directory(out) as folder:
        (folder / "joint.calibrated.toml").write_text(calibrated_text(found), encoding="utf-8")
        text = json.dumps(calibration_json(found), indent=1)
        (folder / "calibration.json").write_text(text + "\n", encoding="utf-8")
    if as_json:
        typer.echo(text)
        return
    console.print(calibration_summary(found))
    console.print(f"written: {out / 'joint.calibrated.toml'}", soft_wrap=True)
