"""TOML files to validated models; what is wrong is one line that names file, key, value, what is accepted."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from cablecomp.config.schema import JointConfig
from cablecomp.errors import InputError
from cablecomp.examples import resolve

M = TypeVar("M", bound=BaseModel)


def load_joint(path: Path | str) -> JointConfig:
    """Read a joint configuration; a bare name such as `capstan-arm` stands for an example that comes with the project.

    Raises InputError with one line that names file, key, what was found, what is accepted.
    """
    path = resolve(path, "joints")
    return parse_joint(read_toml(path), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; raises InputError if it cannot be read or parsed."""
    try:
        text = path.read_bytes().decode("utf-8")
        return tomllib.loads(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a TOML file") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text; a TOML file in UTF-8 is accepted") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}; mend it at that place") from None


def parse_joint(data: dict[str, Any], where: str) -> JointConfig:
    """Validate a configuration already read; `where` names it in errors."""
    return validated(JointConfig, data, where)


def validated(kind: type[M], data: Mapping[str, Any], where: str) -> M:
    """Data as a frozen model; raises InputError with one line that starts with `where`."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {explain(error)}") from None


def explain(error: ValidationError) -> str:
    """One line for the first thing wrong: key, what was found, what is accepted."""
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"]) or "(top level)"
    kind, found = first["type"], first["input"]
    if kind == "extra_forbidden":
        return f"unknown key `{key}`; remove it or check its spelling"
    if kind == "missing":
        return f"missing key `{key}`; add it"
    shown = repr(found) if len(repr(found)) < 60 else repr(found)[:57] + "..."
    return f"key `{key}` is {shown}; {first['msg'][0].lower() + first['msg'][1:]}"
