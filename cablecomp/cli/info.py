"""`cablecomp info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.folders import writable
from cablecomp.cli.shared import Config, EffectsOption, JsonOption, console, echo_json, read_joint
from cablecomp.report.info import design_table
from cablecomp.report.theory import write_theory_figures
from cablecomp.thesis.design import design_sheet


def info(
    config: Config,
    load: Annotated[
        float | None, typer.Option(help="worst load on the joint, N m (the configuration's limit if absent)")
    ] = None,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
    figures: Annotated[
        Path | None, typer.Option(callback=writable, help="folder for the theory figures of this joint")
    ] = None,
) -> None:
    """The design sheet of a joint: stiffness, hysteresis, pretension, wrap, efficiency."""
    joint = read_joint(config, effects)
    sheet = design_sheet(joint, load)
    if figures is not None:
        write_theory_figures(joint, figures, load)
    if as_json:
        echo_json(sheet)
        return
    console.print(design_table(sheet))
    if figures is not None:
        console.print(f"figures: {figures}")
