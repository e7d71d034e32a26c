"""TOML: reading a file that may hold anything (bounded size, depth and numbers; where each key stands), and keys and
values as they are written."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any, Final

from cablecomp.errors import InputError

_MOST_BYTES: Final = 4_000_000
_MOST_DEPTH: Final = 24
_MOST_DOTS: Final = 1000
"""In one key; the parser's time grows with their square."""
_HEAD = re.compile(r"\s*\[(\[?)\s*([A-Za-z0-9_.\- ]+?)\s*\]")
_BETWEEN_KEYS = re.compile(r"[=,{\n]")
_KEY = re.compile(r"\s*([A-Za-z0-9_.\-]+)\s*=")

Place = tuple[str | int, ...]


class TomlTable(dict[str, Any]):
    """The content of a TOML file, which remembers in `text` how it was written."""

    text: str = ""

    def lines(self) -> dict[Place, int]:
        """The line, counted from 1, of every key that stands on a line of its own.

        Places are keys from the top, an array's tables counted from 0. Quoted keys and keys inside of inline
        tables are left out.
        """
        return _lines(self.text)


def read_toml(path: Path) -> TomlTable:
    """Read a TOML file; raises InputError if it cannot be read or parsed."""
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a TOML file") from None
    if len(content) > _MOST_BYTES:
        raise InputError(f"{path}: is larger than {_MOST_BYTES / 1e6:g} MB; that is no configuration")
    try:
        text = content.decode("utf-8-sig")  # some editors begin a file with a mark
        if any(part.count(".") > _MOST_DOTS for part in _BETWEEN_KEYS.split(text)):
            raise RecursionError
        found = TomlTable(tomllib.loads(text))
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text; a TOML file in UTF-8 is accepted") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}; mend it at that place") from None
    except ValueError:  # an integer of thousands of digits
        raise InputError(f"{path}: holds a number with too many digits; mend it") from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply; {_MOST_DEPTH} levels are accepted") from None
    if _deep(found):
        raise InputError(f"{path}: is nested too deeply; {_MOST_DEPTH} levels are accepted")
    found.text = text
    return found


def key_text(key: str) -> str:
    """A key as TOML has it: bare where it may be, else in quotes."""
    bare = key.replace("_", "").replace("-", "").isalnum() and key.isascii()
    return key if bare else value_text(key)


def value_text(value: Any) -> str:
    """A value as TOML has it, which reads back as the same: floats keep every digit."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(value_text(v) for v in value)}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key_text(k)} = {value_text(v)}" for k, v in value.items()) + "}"
    # JSON may write a character as two halves, and leaves DEL as it is: TOML takes neither
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")


def _deep(table: dict[str, Any]) -> bool:
    level: list[Any] = [table]
    for _ in range(_MOST_DEPTH):
        inner: list[Any] = []
        for item in level:
            values = item.values() if isinstance(item, dict) else item
            inner += [v for v in values if isinstance(v, dict | list)]
        if not inner:
            return False
        level = inner
    return True


def _lines(text: str) -> dict[Place, int]:
    found: dict[Place, int] = {}
    counts: dict[Place, int] = {}
    table: Place = ()
    for number, line in enumerate(text.split("\n"), start=1):
        head = _HEAD.match(line)
        if head:
            table = _opened(head[2], bool(head[1]), counts)
            found.setdefault(table, number)
            continue
        key = _KEY.match(line)
        if key:
            found.setdefault((*table, *key[1].split(".")), number)
    return found


def _opened(name: str, array: bool, counts: dict[Place, int]) -> Place:
    """The place of a table that a head opens; arrays on the way stand at their last table."""
    place: Place = ()
    parts = [part.strip() for part in name.split(".")]
    for k, part in enumerate(parts):
        place = (*place, part)
        if array and k == len(parts) - 1:
            counts[place] = counts.get(place, -1) + 1
        if place in counts:
            place = (*place, counts[place])
    return place
