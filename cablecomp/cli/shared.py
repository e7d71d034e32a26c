"""What several commands share: options, the console, progress, and where the project's own files lie.

What not every command needs is imported where it is used: control brings plots along, the kernels a compiler.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from cablecomp.config import JointConfig, doubts, load_joint
from cablecomp.errors import InputError
from cablecomp.examples import resolve

if TYPE_CHECKING:
    from cablecomp.control.motors import DriveGains
    from cablecomp.control.options import ControlConfig

T = TypeVar("T")
DEMO_LINK = "wrist-virtual"


class Output(Console):
    """Standard output; whoever reads it may leave early, which is no error."""

    def on_broken_pipe(self) -> None:
        """Leave it to the program's end (`app.main`): by itself, rich ends it with 1."""
        raise BrokenPipeError


console = Output(markup=False, emoji=False)
"""Prints what it is given: a name or a path may look like markup."""


def _joint(path: Path | None) -> Path | None:
    return None if path is None else resolve(path, "joints")


Config = Annotated[
    Path,
    typer.Option("--config", callback=_joint, help="joint configuration (TOML), or the name of an example"),
]
FleetConfig = Annotated[
    Path | None,
    typer.Option(
        "--config",
        callback=_joint,
        help="joint configuration (TOML), or the name of an example; of a fleet, for joints without their own",
    ),
]
Control = Annotated[
    Path | None,
    typer.Option("--control", help="control file (TOML), or the name of an example; made up if absent"),
]


EffectsOption = Annotated[
    list[Path] | None, typer.Option("--effects", help="Python file that registers an effect of your own")
]
JsonOption = Annotated[bool, typer.Option("--json", help="print the result as JSON in place of the summary")]
BoundsOption = Annotated[
    bool, typer.Option("--bounds/--no-bounds", help="guaranteed bounds beside the prediction")
]
BudgetOption = Annotated[
    float, typer.Option("--budget", min=0.0, help="seconds after which nothing is begun: the best so far")
]
ChanceOption = Annotated[int, typer.Option("--seed", min=0, help="of noise replicas and resampling")]


def needed_config(config: Path | None) -> Path:
    """The configuration of a joint by itself; raises InputError if none was given."""
    if config is None:
        raise InputError(
            "--config: is missing; give a joint's TOML file, or the name of an example (`cablecomp example` lists them)"
        )
    return config


def read_joint(path: Path, effects: Sequence[Path] | None = None) -> JointConfig:
    """The joint configuration, effects of the user's own registered first; what it states but hardly means is asked
    about on standard error."""
    if effects:
        from cablecomp.effects import load_effects

        for file in effects:
            load_effects(file)
    joint = load_joint(path)
    if joint.effect or joint.empirical:
        from cablecomp.effects import extend

        try:
            extend(joint)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    warn(f"{path}: {words}" for words in doubts(joint))
    return joint


def errors() -> Console:
    """Standard error, where what is no result goes."""
    return Console(stderr=True, markup=False, emoji=False, highlight=False, soft_wrap=True)


def warn(lines: Iterable[str]) -> None:
    """One line each on standard error."""
    asking = errors()
    for words in lines:
        asking.print(words, style="yellow")


def each_once(option: str, pairs: Iterable[tuple[str, T]]) -> dict[str, T]:
    """What an option says of each key; raises InputError for a key given twice: of two values, one would be ignored."""
    found: dict[str, T] = {}
    for key, value in pairs:
        if key in found:
            raise InputError(f"{option}: {key} is given twice; give it once")
        found[key] = value
    return found


def echo_json(result: object) -> None:
    """A result on standard output as JSON: dataclasses and named tuples as objects, what is not finite as null."""
    typer.echo(json.dumps(_plain(result), indent=1))


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return _plain(value._asdict())
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float | np.floating):
        return float(value) if isfinite(value) else None
    if isinstance(value, complex):
        return {"real": _plain(value.real), "imaginary": _plain(value.imag)}
    return (
        value.item()
        if isinstance(value, np.generic)
        else value
        if isinstance(value, int | str) or value is None
        else str(value)
    )


def control_of(path: Path | None, joint: JointConfig, stated: DriveGains | None = None) -> ControlConfig:
    """The control file, or what the joint and what its drive is told suggest if there is none."""
    if path is None:
        from cablecomp.control.motors import control_for

        return control_for(joint, stated)
    from cablecomp.control.options import load_control

    return load_control(path)


def announce_compilation(joint: JointConfig | None = None, bounds: bool = False) -> None:
    """Say so before the first use of this very version compiles its kernels, and do it where the joint is known."""
    from cablecomp.mechanics.jit import is_compiled

    if is_compiled("step_rows") and (not bounds or is_compiled("bounds_step")):
        return
    errors().print("compiling the kernels, once for this version (half a minute or so) ...", style="dim")
    if joint is not None:
        from cablecomp.observer.first_use import compile_first

        compile_first(joint, bounds)


def plain_counts(console: Console) -> Callable[[str, int, int], None]:
    """Function to be told (what, done, of how much) where there is no terminal: a line for every tenth that is full."""
    said: dict[str, int] = {}

    def progress(what: str, done: int, of: int) -> None:
        tenth = 10 * done // max(of, 1)
        if tenth > said.get(what, 0):
            said[what] = tenth
            console.print(f"{what}: {done} of {of}", soft_wrap=True)

    return progress


@contextmanager
def share_bar() -> Iterator[Callable[[str, float], None]]:
    """Give a function to be told (what is being tried, share done); the bar never runs backwards, and goes when it is
    over. Where standard error is no terminal, each new step is a plain line."""
    console = Console(stderr=True, markup=False, emoji=False, highlight=False, soft_wrap=True)
    done, said = 0.0, ""
    if not console.is_terminal:

        def line(what: str, share: float) -> None:
            nonlocal done, said
            done = max(done, share)
            if what != said:
                console.print(f"{100 * done:3.0f} %  {what}")
            said = what

        yield line
        return
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("reading", total=1.0)

        def progress(what: str, share: float) -> None:
            nonlocal done
            done = max(done, share)
            bar.update(task, description=what, completed=done)

        yield progress
