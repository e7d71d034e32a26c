"""`cablecomp export`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import (
    Config,
    Control,
    EffectsOption,
    JsonOption,
    announce_compilation,
    console,
    control_of,
    echo_json,
    read_joint,
)
from cablecomp.config import JointConfig
from cablecomp.control.plays import fit_plays
from cablecomp.errors import InputError
from cablecomp.export.code import c_source, identifier, left_out, write_fmu
from cablecomp.export.equivalent import equivalent, loads
from cablecomp.export.simulators import mujoco_model, urdf_model
from cablecomp.recording.atomic import atomic_file


def export(
    config: Config,
    mujoco: Annotated[
        bool, typer.Option("--mujoco", help="NAME.xml: MJCF, tendon with stiffness and friction")
    ] = False,
    urdf: Annotated[
        bool, typer.Option("--urdf", help="NAME.urdf: joint with friction; no stiffness there")
    ] = False,
    c: Annotated[
        bool, typer.Option("--c", help="NAME.c: load and deflection with history, plain C99")
    ] = False,
    fmu: Annotated[bool, typer.Option("--fmu", help="NAME.fmu: the same for co-simulation, FMI 2.0")] = False,
    control: Control = None,
    out: Annotated[Path, out_option("folder to write into")] = Path("export"),
    effects: EffectsOption = None,
    as_json: JsonOption = False,
) -> None:
    """A joint for simulators and other programs: what was identified, and what each format loses."""
    if not (mujoco or urdf or c or fmu):
        raise InputError("nothing to write: give one or more of --mujoco, --urdf, --c, --fmu")
    joint = read_joint(config, effects)
    announce_compilation()
    out.mkdir(parents=True, exist_ok=True)
    result: dict[str, object] = {"name": joint.name}
    if mujoco or urdf:
        result |= _simulators(joint, out, control, mujoco, urdf)
    if c or fmu:
        result |= _code(joint, out, c, fmu)
    if as_json:
        echo_json(result)
    else:
        _say(joint, result)


def _simulators(
    joint: JointConfig, out: Path, control: Path | None, mujoco: bool, urdf: bool
) -> dict[str, object]:
    found, motor = equivalent(joint), control_of(control, joint).motor
    result: dict[str, object] = {"equivalent": found, "simulators_leave_out": found.lost(joint)}
    if mujoco:
        result["mujoco"] = _write(out / f"{identifier(joint.name)}.xml", mujoco_model(joint, found, motor))
    if urdf:
        result["urdf"] = _write(out / f"{identifier(joint.name)}.urdf", urdf_model(joint, found, motor))
    return result


def _code(joint: JointConfig, out: Path, c: bool, fmu: bool) -> dict[str, object]:
    found = fit_plays(joint)
    result: dict[str, object] = {"code_rms_rad": found.rms_rad, "code_leaves_out": left_out(joint)}
    if c:
        result["c"] = _write(out / f"{identifier(joint.name)}.c", c_source(joint, found))
    if fmu:
        result["fmu"] = write_fmu(joint, found, out)
    return result


def _write(path: Path, text: str) -> Path:
    with atomic_file(path) as spare:
        spare.write_text(text, encoding="utf-8")
    return path


def _say(joint: JointConfig, result: Mapping[str, Any]) -> None:
    for name in ("mujoco", "urdf", "c", "fmu"):
        if name in result:
            console.print(f"written: {result[name]}", soft_wrap=True)
    if "equivalent" in result:
        found = result["equivalent"]
        console.print(
            f"stiffness {found.stiffness_Nm_per_rad:.5g} Nm/rad, friction {found.friction_Nm:.4g} Nm, equivalent "
            f"backlash {1e3 * found.backlash_rad:.4g} mrad at {loads(joint, found.most_Nm)}"
        )
    if "code_rms_rad" in result:
        console.print(
            f"error on the loops that it was fitted to: {1e3 * result['code_rms_rad']:.3g} mrad RMS"
        )
    for formats, key in (("MJCF and URDF", "simulators_leave_out"), ("C and FMU", "code_leaves_out")):
        for line in result.get(key, ()):
            console.print(f"{formats} leave out: {line}", style="dim", soft_wrap=True)
