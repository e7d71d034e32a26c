"""The command line's study of the thesis's open questions, on the simulated plant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import JsonOption, announce_compilation, console, echo_json, share_bar
from cablecomp.config import JointConfig, load_joint
from cablecomp.errors import InputError
from cablecomp.report.study_page import study_table, write_study
from cablecomp.thesis.bench.cycle import Array, Columns, Rigs
from cablecomp.thesis.bench.study import study


def study_bench(
    out: Annotated[Path, out_option("folder for study.html")] = Path("study"),
    as_json: JsonOption = False,
) -> None:
    """Which physics gives what the thesis saw on its bench and left open: simulated cycles, its own evaluation."""
    rigs = Rigs(load_joint("snow-open-rig"), load_joint("snow-closed-rig"))
    announce_compilation()
    with share_bar() as progress:
        found = study(rigs, by_plant, progress)
    page = write_study(found, out, f"cablecomp study --out {out}")
    if as_json:
        echo_json({**found.as_dict(), "report": page})
        return
    console.print(study_table(found))
    console.print(f"report: {page}")


def by_plant(config: JointConfig, columns: Columns) -> Array:
    """Simulate a joint and its effects on the plant, which shares no equation with the observer."""
    from firmware_sim.plant import EffectSpec, PlantConfig, simulate  # compiled code: only where it is wanted
    from firmware_sim.plant.errors import PlantError

    data = {**config.model_dump(by_alias=True), "effect": ()}
    effects = tuple(
        EffectSpec(entry.id, {k: v for k, v in entry.parameters.items() if k != "channel"})
        for entry in config.effect
    )
    try:
        run = simulate(
            PlantConfig.from_dict(data),
            columns["time_s"],
            columns["motor_position_rad"],
            columns["joint_torque_Nm"],
            effects=effects,
            temperature_degC=columns["temperature_degC"],
            other_1=columns["other_1"],
        )
    except PlantError as error:
        raise InputError(f"simulated bench: {error}") from None
    return run.joint_position_rad
