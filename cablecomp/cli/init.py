"""`cablecomp init`."""

from __future__ import annotations

from typing import Annotated

import typer

from cablecomp.config.reference import CONVENTIONS, reference
from cablecomp.config.schema import JointConfig
from cablecomp.control.options import ControlConfig
from cablecomp.errors import InputError
from cablecomp.links.schema import LinkConfig

_FILES = (
    (JointConfig, "JOINT FILE (--config)"),
    (ControlConfig, "CONTROL FILE (--control)"),
    (LinkConfig, "LINK FILE (--link)"),
)


def init(
    keys: Annotated[bool, typer.Option("--keys", help="every key of joint, control and link files")] = False,
) -> None:
    """What can stand in a configuration: every key with unit, meaning, what is accepted, default."""
    if not keys:
        raise InputError(
            "init: give --keys for the reference of all keys; `cablecomp example` lists examples"
        )
    typer.echo(CONVENTIONS)
    for model, head in _FILES:
        typer.echo(reference(model, f"{head}\n{'=' * len(head)}"))
