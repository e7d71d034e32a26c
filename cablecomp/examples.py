"""Configurations that come with the project, by name: in a clone they lie in `configs`, in an installed package beside
this module.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Final

from cablecomp.errors import InputError

KINDS: Final = ("joints", "links", "control", "scenarios")
"""Folders of examples."""


def folder() -> Path:
    """Where the examples lie."""
    installed = Path(__file__).parent / "configs"
    return installed if installed.is_dir() else Path(__file__).parents[1] / "configs"


def names(kind: str) -> tuple[str, ...]:
    """Names of the examples of one kind, sorted."""
    return tuple(sorted(path.stem for path in (folder() / kind).glob("*.toml")))


def example(kind: str, name: str) -> Path:
    """Path of an example; raises InputError if there is none of that name."""
    path = folder() / kind / f"{name}.toml"
    if not path.is_file():
        raise InputError(f"no example `{name}` in {kind}; there are {', '.join(names(kind))}")
    return path


def resolve(path: Path | str, kind: str) -> Path:
    """The path itself, or the example that NAME or KIND/NAME (no suffix, no such file here) stands for; raises
    InputError for a name of neither, and for what is no path."""
    if not isinstance(path, str | PathLike):
        raise InputError(f"a {type(path).__name__} is no path; give a file's path or an example's name")
    path = Path(path)
    named = not path.suffix and str(path.parent) in (".", *KINDS) and not path.is_file()
    known = path.name in names(kind) and str(path.parent) in (".", kind)
    if not named or (not known and path.exists()):
        return path
    if not known:
        raise InputError(
            f"{path}: no such file here, and no example of {kind}; those are {', '.join(names(kind))}"
        )
    return example(kind, path.name)


def find(name: str) -> Path:
    """Path of the example `NAME` or `KIND/NAME`, with or without `.toml`.

    Raises InputError if there is none, or several of different kinds.
    """
    wanted = Path(name).with_suffix("") if name.endswith(".toml") else Path(name)
    kinds = (str(wanted.parent),) if len(wanted.parts) == 2 else KINDS
    found = [kind for kind in kinds if wanted.name in names(kind)]
    if len(found) == 1:
        return example(found[0], wanted.name)
    if found:
        raise InputError(
            f"`{name}` is several: give {' or '.join(f'{kind}/{wanted.name}' for kind in found)}"
        )
    raise InputError(f"no example `{name}`; `cablecomp example` lists them")


def with_companions(path: Path) -> tuple[Path, ...]:
    """The example's file and those of its folder that it names (message tables of a link)."""
    text = path.read_text(encoding="utf-8")
    return (path, *(p for p in sorted(path.parent.iterdir()) if f'"{p.name}"' in text))
