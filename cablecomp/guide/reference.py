"""The reference of the public names, made from their signatures and docstrings: nothing to keep in step."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Annotated, Any, Final, get_origin

from pydantic import BaseModel

from cablecomp.config.reference import keys_of, kind_of

PACKAGES: Final = ("cablecomp", "cablecomp.config", "cablecomp.effects", "cablecomp.links")
"""Packages whose `__all__` is public."""


def reference() -> str:
    """Markdown: one chapter a package, one section a name, a name shown where it occurs first."""
    shown: set[int] = set()
    parts = [
        "# Reference of the public names",
        "Units are in the names; angles in rad, forces in N, moments in Nm where none is.",
    ]
    for package in PACKAGES:
        module = import_module(package)
        parts += [f"## {package}", inspect.getdoc(module) or ""]
        for name in module.__all__:
            thing = getattr(module, name)
            if id(thing) not in shown:
                shown.add(id(thing))
                parts += _entry(name, thing)
    return "\n\n".join(part for part in parts if part) + "\n"


def _entry(name: str, thing: Any) -> Iterator[str]:
    if isinstance(thing, ModuleType) or not callable(thing):
        return
    yield f"### {name}"
    if get_origin(thing) is Annotated:
        yield f"A {kind_of(thing)}."
        return
    is_error = inspect.isclass(thing) and issubclass(thing, BaseException)
    is_table = inspect.isclass(thing) and issubclass(thing, BaseModel)
    if not (is_error or is_table):
        yield f"```text\n{name}{_signature(thing)}\n```"
    yield _words(thing)
    if is_table:
        yield "\n".join(f"- `{key}`{f': {words}' if words else ''}" for key, words in keys_of(thing))
    if inspect.isclass(thing) and not is_error:
        for key, member in vars(thing).items():
            if key.startswith("_") or not isinstance(
                member, property | staticmethod | classmethod | type(_entry)
            ):
                continue
            text = _words(member)
            if text:
                call = "" if isinstance(member, property) else _signature(getattr(thing, key))
                yield f"`{name}.{key}`{f' `{call}`' if call else ''}: {text}"


def _signature(thing: Any) -> str:
    try:
        return re.sub(r"ForwardRef\(([^)]*)\)", r"\1", str(inspect.signature(thing)).replace("'", ""))
    except (TypeError, ValueError):
        return ""


def _words(thing: Any) -> str:
    """Docstring, unless it is inherited or made up by `dataclass`."""
    text = inspect.cleandoc(getattr(thing, "__doc__", None) or "")
    return "" if text.startswith(f"{getattr(thing, '__name__', '')}(") else text
