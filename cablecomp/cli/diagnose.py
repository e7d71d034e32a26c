"""`cablecomp diagnose`."""

from __future__ import annotations

import json
from dataclasses import replace
from enum import StrEnum
from math import inf
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.beliefs import believe_all
from cablecomp.cli.fleet import SchedulerOption, WorkersOption, asked_for, refuse_options, work_fleet
from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import (
    BudgetOption,
    ChanceOption,
    EffectsOption,
    FleetConfig,
    JsonOption,
    announce_compilation,
    console,
    needed_config,
    read_joint,
    share_bar,
)
from cablecomp.cli.sources import Reading, read_moving, reads_recordings
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import PROTOCOL, report_json, write_diagnosis
from cablecomp.estimation.parallel import forks_allowed
from cablecomp.recording.atomic import atomic_directory
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.diagnosis_terminal import diagnosis_summary
from cablecomp.trials.own import concealed_beside


class Together(StrEnum):
    """How recordings belong together."""

    each = "each"
    folder = "folder"
    one = "one"


@reads_recordings
def diagnose_recordings(
    *,
    recordings: Annotated[
        list[Path], typer.Argument(help="recordings of one joint, or folders: all recordings in them")
    ],
    config: FleetConfig = None,
    out: Annotated[Path, out_option("folder for diagnosis.json, report.html, joint.augmented.toml")] = Path(
        "diagnosis"
    ),
    session: Annotated[
        Together | None,
        typer.Option(
            help="one mounting: each recording, each folder, or all; [[session]], else each folder if absent"
        ),
    ] = None,
    seed: ChanceOption = 0,
    budget: BudgetOption = inf,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    reading: Reading,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Find the physics that the configuration lacks: locate, name, model, show on held-out data.

    Recordings are one body of evidence. With --workers or --scheduler they are folders of a fleet, JOINT/NIGHT,
    and every night is diagnosed by itself.
    """
    fleet = asked_for(workers, scheduler)
    if fleet is not None:
        refuse_options(
            reading(),
            {
                "--session": session is not None,
                "--seed": seed != 0,
                "--budget": budget < inf,
                "--effects": effects is not None,
            },
        )
        work_fleet("diagnose", recordings, config, out, fleet, as_json)
        return
    config = needed_config(config)
    joint = read_joint(config, effects)
    data = read_moving(recordings, reading(joint), "diagnosis")
    announce_compilation()
    doubted = believe_all(joint, data)
    with share_bar() as progress, forks_allowed():
        found = diagnose(joint, data, progress, seed, None if session is None else session.value, budget)
    doubted = doubted.beside(found.in_time, data)
    found = replace(found, mend_first=doubted.mend_first, warnings=(*doubted.lines, *found.warnings))
    with atomic_directory(out, (PROTOCOL,)) as folder:
        write_diagnosis(found, folder)
        page = diagnosis_page(found, joint_text(found.augmented_joint), concealed_beside(out))
        (folder / "report.html").write_text(page, encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(report_json(found), indent=1))
        return
    console.print(diagnosis_summary(report_json(found)))
    console.print(f"report: {out / 'report.html'}")
