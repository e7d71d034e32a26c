"""`cablecomp design`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import (
    Config,
    Control,
    EffectsOption,
    JsonOption,
    console,
    control_of,
    echo_json,
    read_joint,
)
from cablecomp.control.design import design_loop
from cablecomp.control.options import ControlConfig
from cablecomp.recording.atomic import atomic_directory
from cablecomp.report.design_page import design_page, design_tables


def design(
    config: Config,
    rate: Annotated[float, typer.Option(help="loop rate, Hz")] = 1000.0,
    control: Control = None,
    out: Annotated[Path | None, out_option("folder for design.html")] = None,
    effects: EffectsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Design gains from the drive's stiffness range: margins, hysteresis as a describing function, plots."""
    joint = read_joint(config, effects)
    found = design_loop(joint, rate, to_design(control_of(control, joint)))
    if out is not None:
        with atomic_directory(out) as folder:
            (folder / "design.html").write_text(design_page(found), encoding="utf-8")
    if as_json:
        echo_json(found)
        return
    console.print(design_tables(found))
    if out is not None:
        console.print(f"plots: {out / 'design.html'}")


def to_design(wanted: ControlConfig) -> ControlConfig:
    """What is designed for: gains that the file states stay; feedback on the joint encoder is shown where it says
    nothing of it, though a run has none then."""
    if "joint_feedback_per_s" in wanted.compensator.model_fields_set:
        return wanted
    options = wanted.compensator.model_copy(update={"joint_feedback_per_s": None})
    return wanted.model_copy(update={"compensator": options})
