"""A joint configuration back to TOML: what is written reads back as the same configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cablecomp.config import JointConfig
from cablecomp.config.toml_file import key_text, value_text
from cablecomp.errors import InputError, printable


def joint_text(config: JointConfig, comments: tuple[str, ...] = ()) -> str:
    """TOML text of a joint; keys that stand at their default of None are left out, floats keep every
    digit."""
    data = config.model_dump(by_alias=True, exclude_none=True)
    lines = [f"# {printable(line)}" for line in comments]
    lines += [f"{key} = {value_text(data[key])}" for key in ("schema", "name")]
    drive = dict(data["drive"])
    stages = drive.pop("stage")
    lines += _table("drive", drive)
    for stage in stages:
        lines += _table("drive.stage", stage, array=True)
    for name in ("tolerance", "sensors", "observer", "limits", "condition", "remainder"):
        if values := {k: v for k, v in (data.get(name) or {}).items() if k != "follows" or v}:
            lines += _table(name, values)
    for effect in config.effect:
        lines += _table("effect", {"id": effect.id, **effect.parameters}, array=True)
    for law in data["empirical"]:
        lines += _table("empirical", {k: v for k, v in law.items() if k != "session" or v}, array=True)
    for depends in data["depends"]:
        lines += _table("depends", depends, array=True)
    for session in data["session"]:
        lines += _table("session", {k: v for k, v in session.items() if v or k == "own"}, array=True)
    return "\n".join(lines) + "\n"


def write_joint(path: Path, config: JointConfig, comments: tuple[str, ...] = ()) -> None:
    """Write a joint configuration; raises InputError if the place does not take it."""
    try:
        path.write_text(joint_text(config, comments), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None


def _table(name: str, values: dict[str, Any], array: bool = False) -> list[str]:
    head = f"\n[[{name}]]" if array else f"\n[{name}]"
    return [head, *(f"{key_text(key)} = {value_text(value)}" for key, value in values.items())]
