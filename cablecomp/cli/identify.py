"""`cablecomp identify`."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.shared import Config, EffectsOption, JsonOption, console, echo_json, read_joint
from cablecomp.cli.sources import Reading, reads_recordings
from cablecomp.errors import InputError
from cablecomp.report.info import bench_table
from cablecomp.thesis.bench.evaluate import bench_recording, evaluate_bench


@reads_recordings
def identify(
    *,
    recording: Annotated[Path, typer.Argument(help="bench recording: load ramps with holds")],
    config: Config,
    sensor_stiffness: Annotated[
        float, typer.Option(help="stiffness of torque sensor and coupling, N m/rad (App. A.3)")
    ] = inf,
    narrow: Annotated[
        bool, typer.Option("--narrow", help="tensions of nearly tangent pulleys (App. C)")
    ] = False,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    reading: Reading,
) -> None:
    """True and acting coefficient of friction from a bench recording, the thesis's way."""
    joint = read_joint(config, effects)
    source = reading(joint)
    source.check(recording)
    columns = source.read(recording).columns
    try:
        bench = bench_recording(columns, joint)
    except InputError as error:
        raise InputError(f"{recording}: {error}") from None
    found = evaluate_bench(bench, joint, sensor_stiffness_Nm_per_rad=sensor_stiffness, narrow_tensions=narrow)
    if as_json:
        echo_json(found)
    else:
        console.print(bench_table(found))
