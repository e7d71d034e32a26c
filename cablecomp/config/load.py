"""TOML files to validated models; everything that is wrong is said at once, one line each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from cablecomp.config.explain import explain
from cablecomp.config.schema import JointConfig
from cablecomp.config.toml_file import Place, TomlTable, read_toml
from cablecomp.errors import ConfigError
from cablecomp.examples import resolve

M = TypeVar("M", bound=BaseModel)


def load_joint(path: Path | str) -> JointConfig:
    """Read a joint configuration; a bare name such as `capstan-arm` stands for an example that comes with the project.

    Raises ConfigError: for everything that is wrong one line that names file, key, what was found, what is
    accepted.
    """
    path = resolve(path, "joints")
    return parse_joint(read_toml(path), str(path))


def parse_joint(data: dict[str, Any], where: str) -> JointConfig:
    """Validate a configuration already read; `where` names it in errors."""
    return validated(JointConfig, data, where)


def validated(
    kind: type[M], data: Mapping[str, Any], where: str, lines: Mapping[Place, int] | None = None
) -> M:
    """Data as a frozen model; raises ConfigError with one line for each error, each starting with `where`.

    `lines` says in which line of the file each key stands; what `read_toml` gave knows that by itself.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        if lines is None and isinstance(data, TomlTable):
            lines = data.lines()
        said = explain(error, kind, data, lines)
        raise ConfigError(f"{where}: {line}" for line in said) from None
