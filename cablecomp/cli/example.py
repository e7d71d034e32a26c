"""`cablecomp example`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from cablecomp import examples
from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import JsonOption, Output, echo_json
from cablecomp.errors import InputError
from cablecomp.recording.atomic import atomic_file


def copy_example(
    name: Annotated[
        str | None, typer.Argument(help="such as capstan-arm or links/mit-udp; lists them if absent")
    ] = None,
    out: Annotated[Path, out_option("folder to copy into")] = Path(),
    as_json: JsonOption = False,
) -> None:
    """Copy out a configuration that comes with the project: a joint, a link, a controller; or list them."""
    console = Output(markup=False, emoji=False)
    if name is None:
        listed = {
            f"{kind}/{each}": _about(examples.example(kind, each))
            for kind in examples.KINDS
            for each in examples.names(kind)
        }
        if as_json:
            echo_json(listed)
            return
        table = Table(show_header=False, box=None)
        for each, about in listed.items():
            table.add_row(each, about)
        console.print(table)
        return
    files = examples.with_companions(examples.find(name))
    for path in files:
        target = out / path.name
        if target.exists() and target.read_bytes() != path.read_bytes():
            raise InputError(f"{target}: is there already, and differs; remove it or give another --out")
    out.mkdir(parents=True, exist_ok=True)
    for path in files:
        with atomic_file(out / path.name) as spare:
            spare.write_bytes(path.read_bytes())
    written = [out / path.name for path in files]
    if as_json:
        echo_json({"written": written})
        return
    for place in written:
        console.print(f"written: {place}", soft_wrap=True)


def _about(path: Path) -> str:
    """First sentence of the comment at the head of a file, without what it says in brackets."""
    lines = path.read_text(encoding="utf-8").splitlines()
    head = " ".join(line.removeprefix("#").strip() for line in lines if line.startswith("#"))
    return re.split(r"(?<=\w\w)\. (?=[A-Z])", re.sub(r" \([^)]*\)", "", head))[0].rstrip(".")
