"""`cablecomp export`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.shared import Config, Control, announce_compilation, console, control_of, read_joint
from cablecomp.config import JointConfig
from cablecomp.control.nonlinear_system import fit_plays
from cablecomp.errors import InputError
from cablecomp.export.code import LOST, c_source, identifier, write_fmu
from cablecomp.export.equivalent import equivalent
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
    out: Annotated[Path, typer.Option(help="folder to write into")] = Path("export"),
) -> None:
    """A joint for simulators and other programs: what was identified, and what each format loses."""
    if not (mujoco or urdf or c or fmu):
        raise InputError("nothing to write: give one or more of --mujoco, --urdf, --c, --fmu")
    joint = read_joint(config)
    announce_compilation()
    out.mkdir(parents=True, exist_ok=True)
    if mujoco or urdf:
        _simulators(joint, out, control, mujoco, urdf)
    if c or fmu:
        _code(joint, out, c, fmu)


def _simulators(joint: JointConfig, out: Path, control: Path | None, mujoco: bool, urdf: bool) -> None:
    found, motor = equivalent(joint), control_of(control, joint).motor
    if mujoco:
        _write(out / f"{identifier(joint.name)}.xml", mujoco_model(joint, found, motor))
    if urdf:
        _write(out / f"{identifier(joint.name)}.urdf", urdf_model(joint, found, motor))
    console.print(
        f"stiffness {found.stiffness_Nm_per_rad:.5g} Nm/rad, friction {found.friction_Nm:.4g} Nm, equivalent backlash "
        f"{1e3 * found.backlash_rad:.4g} mrad at ±{found.most_Nm:.4g} Nm"
    )
    _lost(found.lost(joint))


def _code(joint: JointConfig, out: Path, c: bool, fmu: bool) -> None:
    found = fit_plays(joint)
    if c:
        _write(out / f"{identifier(joint.name)}.c", c_source(joint, found))
    if fmu:
        console.print(f"written: {write_fmu(joint, found, out)}", soft_wrap=True)
    console.print(f"error on the loops that it was fitted to: {1e3 * found.rms_rad:.3g} mrad RMS")
    _lost(LOST)


def _write(path: Path, text: str) -> None:
    with atomic_file(path) as spare:
        spare.write_text(text, encoding="utf-8")
    console.print(f"written: {path}", soft_wrap=True)


def _lost(lines: Sequence[str]) -> None:
    for line in lines:
        console.print(f"left out: {line}", style="dim", soft_wrap=True)
