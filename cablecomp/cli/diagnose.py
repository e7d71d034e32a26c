"""`cablecomp diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from cablecomp.cli.shared import Config, announce_compilation, console, read_joint, share_bar
from cablecomp.cli.sources import DbcOption, JointOption, LinkOption, MapOption, sources
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.diagnose import Diagnosis, diagnose, report_json, write_diagnosis
from cablecomp.effects import load_effects
from cablecomp.errors import path_text
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.inspection import require_motion
from cablecomp.report.diagnosis_build import diagnosis_report


def diagnose_recordings(
    recordings: Annotated[list[Path], typer.Argument(help="one or more recordings of one joint")],
    config: Config,
    out: Annotated[
        Path, typer.Option(help="folder for diagnosis.json, report.html, joint.augmented.toml")
    ] = Path("diagnosis"),
    seed: Annotated[int, typer.Option(min=0, help="of surrogates and resampling")] = 0,
    effects: Annotated[
        list[Path] | None, typer.Option(help="Python file that registers an effect of your own")
    ] = None,
    words: MapOption = None,
    link: LinkOption = None,
    dbc: DbcOption = None,
    which: JointOption = None,
) -> None:
    """Find the physics that the configuration lacks: locate, name, model, show on held-out data."""
    for path in effects or ():
        load_effects(path)
    joint = read_joint(config)
    reading = sources(words, link, dbc, which, joint)
    data = {path_text(path): reading.read(path).columns for path in recordings}
    for name, columns in data.items():
        require_motion(columns, name)
    announce_compilation()
    with share_bar() as told:
        found = diagnose(joint, data, told, seed)
    with atomic_directory(out) as folder:
        write_diagnosis(found, folder)
        (folder / "report.html").write_text(
            diagnosis_report(found, joint_text(found.config)), encoding="utf-8"
        )
    _show(found)
    console.print(f"report: {out / 'report.html'}")


def _show(found: Diagnosis) -> None:
    result = report_json(found)
    table = Table(show_header=False, box=None)
    table.add_row("verdict", result["verdict"])
    for m in result["missing_physics"]:
        values = ", ".join(
            f"{name} = {v['value']:.4g} ± {v['sd']:.2g}"
            for name, v in m["parameters"].items()
            if isinstance(v, dict) and v["sd"]
        )
        table.add_row("missing", f"{m['effect']} (confidence {m['confidence']:.2f}): {values}")
        table.add_row("", m["statement"])
    for tied in result["not_excluded"]:
        table.add_row("cannot be told apart", f"{', '.join(tied['effects'])}: {tied['why']}")
    if result["mismatch"]:
        first = result["mismatch"][0]
        table.add_row(
            "located in", f"{first['covariate']} (share {first['share']:.2f}, p = {first['p_value']:.3g})"
        )
    table.add_row("noise floor", f"{1e3 * result['noise_floor_rad']:.4g} mrad")
    table.add_row("held-out RMSE, calibrated", f"{1e3 * result['baseline']['heldout_rmse_rad']:.4g} mrad")
    table.add_row("held-out RMSE, augmented", f"{1e3 * result['augmented']['heldout_rmse_rad']:.4g} mrad")
    if result["verdict"] == "unexplained":
        table.add_row("unexplained", str(result["remainder"]["description"]))
    if result["next_experiment"]:
        table.add_row("next experiment", result["next_experiment"]["why"])
    console.print(table)
