"""What several commands share: options, the console, progress, and where the project's own files lie."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from cablecomp.config import JointConfig, doubts, load_joint
from cablecomp.control.motors import control_for
from cablecomp.control.options import ControlConfig, load_control
from cablecomp.examples import resolve
from cablecomp.mechanics.jit import is_compiled

DEMO_LINK = "wrist-virtual"

console = Console(markup=False, emoji=False)
"""Prints what it is given: a name or a path may look like markup."""


def _joint(path: Path) -> Path:
    return resolve(path, "joints")


Config = Annotated[
    Path,
    typer.Option("--config", callback=_joint, help="joint configuration (TOML), or the name of an example"),
]
Control = Annotated[
    Path | None, typer.Option("--control", help="control file (TOML); made up from the joint if absent")
]


def read_joint(path: Path) -> JointConfig:
    """The joint configuration; what it states but hardly means is asked about on standard error."""
    joint = load_joint(path)
    asking = Console(stderr=True, markup=False, emoji=False, highlight=False, soft_wrap=True)
    for words in doubts(joint):
        asking.print(f"{path}: {words}", style="yellow")
    return joint


def control_of(path: Path | None, joint: JointConfig) -> ControlConfig:
    """The control file, or what the joint itself suggests if there is none."""
    return control_for(joint) if path is None else load_control(path)


def announce_compilation() -> None:
    """Say so before the first use of this very version compiles its kernels."""
    if not is_compiled():
        console.print("compiling the kernels, once for this version (under a minute) ...", style="dim")


@contextmanager
def share_bar() -> Iterator[Callable[[str, float], None]]:
    """Give a function to be told (what is being tried, share done); the bar goes when it is over."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda what, share: bar.update(task, description=what, completed=share)
