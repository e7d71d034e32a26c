"""The head of a CSV text: comments, names, separator, perhaps a row of units, and which columns hold dates."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Final

from cablecomp.errors import InputError
from cablecomp.recording.source import Truncated, chunks
from cablecomp.units import UNITS, unit_named

_HEAD_LEAST, _HEAD_LIMIT = 1 << 16, 1 << 20
_MOST_COLUMNS: Final = 4096
_PREAMBLE: Final = 100
"""Lines among which the names are looked for."""
_SEPARATORS: Final = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}
QUOTED_COMMA: Final = re.compile(rb'(?<![^,\r\n ])"([^",\r\n]*\d),(\d[^",\r\n]*)"(?![^,\r\n ])')
"""A cell in quotes, between commas, that holds a comma between digits: no separator stands there."""
_THOUSANDS: Final = re.compile(r"[+-]?\d{1,3}(,\d{3})+")
_GROUPED: Final = re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}")
_DATE: Final = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d([.,]\d+)?(Z|[+-]\d\d:?\d\d)?")


@dataclass(frozen=True)
class Head:
    """What stands before the first row: `first_line` is the line of the first row, counted from 1.

    `units`: those of a row of units below the names. `dates`: columns that hold dates and times (ISO 8601), read
    as seconds since midnight of `day`. `decimal_comma`: numbers hold one, where commas separate inside quotes alone.
    `trailing`: a separator stands behind the last cell of a row.
    """

    columns: tuple[str, ...]
    comments: tuple[str, ...]
    separator: str
    decimal_comma: bool
    header_line: int
    first_line: int
    size: int
    units: tuple[str, ...] = ()
    dates: frozenset[str] = frozenset()
    trailing: bool = False
    day: datetime = datetime(1970, 1, 1)


def read_head(path: Path, gzipped: bool) -> Head:
    """Read comments and header line; InputError if there is no header or it holds numbers."""
    text = b""
    try:
        for piece in chunks(path, gzipped, _HEAD_LEAST):
            text += piece.data
            if len(text) < _HEAD_LEAST:
                continue
            head = _parse_head(text)
            if head is not None and text.count(b"\n") > head.first_line:
                break
            if len(text) > _HEAD_LIMIT:
                break
    except Truncated as error:
        if _parse_head(text) is None:  # else whoever reads the rows says where it ends
            raise InputError(f"{path}: {error}, before the first row; copy or record the file anew") from None
    head = _parse_head(text)
    if head is None:
        raise InputError(
            f"{path}: has no header line; expected column names such as time_s,motor_position_rad"
        )
    if len(head.columns) > _MOST_COLUMNS:
        raise InputError(
            f"{path}: line {head.header_line}: has {len(head.columns)} columns; {_MOST_COLUMNS} are accepted"
        )
    if _is_number(head.columns[0]):
        raise InputError(
            f"{path}: line {head.header_line}: holds numbers where the column names are expected; "
            "add a header line such as time_s,motor_position_rad,joint_torque_Nm"
        )
    return head


def _parse_head(text: bytes) -> Head | None:
    shift = 3 if text.startswith(b"\xef\xbb\xbf") else 0
    quoted = _decimal_in_quotes(text)
    text = QUOTED_COMMA.sub(rb'"\1.\2"', text) if quoted else text  # as long as before
    lines = [_text(raw) for raw in plain_breaks(text[shift:].removesuffix(b"\r")).split(b"\n")]
    kept = [k for k, line in enumerate(lines) if line.strip() and not line.strip().startswith("#")]
    if not kept:
        return None
    header, first = _header_at(lines, kept)
    separator = _separator(lines[header], lines[first] if first < len(lines) else "")
    names = [name.strip().strip('"').strip() for name in _cells(lines[header].strip("#\r "), separator)]
    trailing = _trailing(lines[first:], separator, names)
    names = names[:-1] if trailing and names[-1] == "" else names
    columns = tuple(name or f"(column {k})" for k, name in enumerate(names, start=1))
    before = [line.strip().lstrip("#").strip() for line in lines[: max(header, first - 1)]]
    comma = (
        quoted
        if separator == ","
        else _decimal_comma(
            [
                cell.strip().strip('"')
                for line in lines[first:]
                if "," in line or "." in line
                for cell in _cells(line, separator)
            ]
        )
    )
    raw = plain_breaks(text[shift:]).split(b"\n")
    size = shift + sum(len(line) + 1 for line in raw[:first])
    found = Head(columns, tuple(c for c in before if c), separator, comma, header + 1, first + 1, size)
    return _below(replace(found, trailing=trailing), raw[first : first + 2])


def _text(raw: bytes) -> str:
    """A line as text: UTF-8, else the Windows code page of western Europe, as spreadsheets there write."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def _separator(header: str, row: str) -> str:
    """What stands between names: as often in the row below, and there between numbers, if anything does, else most
    often; blanks where nothing else does and the row has as many cells. A bar that the row lacks is part of a name."""
    here = [s for s in _SEPARATORS if s in header and (s != "|" or s in row or not row.strip())]
    if not here:
        numbers = [_is_number(cell) for cell in row.split()]
        return " " if all(numbers) and len(header.strip("# ").split()) == len(numbers) > 1 else ","
    agreeing = [s for s in here if _as_often(header, row, s)]
    apart = [
        s for s in agreeing if all(_is_number(c.strip().replace(",", ".")) for c in row.split(s) if c.strip())
    ]
    return max(apart or agreeing or here, key=header.count)


def _as_often(header: str, row: str, separator: str) -> bool:
    """Whether two lines have as many cells, one that is empty behind the last separator counted or not."""
    counts = [line.count(separator) for line in (header, row)]
    ends = [line.rstrip(" \r").endswith(separator) for line in (header, row)]
    return counts[0] == counts[1] or counts[0] - ends[0] == counts[1] - ends[1] > 0


def _decimal_comma(cells: list[str]) -> bool:
    """Whether cells that no comma stands between hold decimal commas: of any row, as the first may be whole numbers."""
    commas = [c for c in cells if "," in c and (_is_number(c.replace(",", ".")) or _DATE.fullmatch(c))]
    points = any("." in c and _is_number(c) for c in cells)
    return bool(commas) and not (points and all(map(_THOUSANDS.fullmatch, commas)))


def _decimal_in_quotes(text: bytes) -> bool:
    """Whether commas inside quotes are decimal ones: a cell says so that divides no thousands, such as "0,5"."""
    cells = (f"{_text(a)}.{_text(b)}".strip() for a, b in QUOTED_COMMA.findall(text))
    return any((_is_number(c) or _DATE.fullmatch(c)) and not _GROUPED.fullmatch(c) for c in cells)


def _cells(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else line.split(separator)


def _header_at(lines: list[str], kept: list[int]) -> tuple[int, int]:
    """Places of the line of names and of the line after it: the first that is no comment, the comment right above rows
    of numbers (numpy writes it so), or what follows a preamble (of other numbers of cells than the rows, or filled up
    to as many, as spreadsheets do)."""
    top = kept[0]
    if _numeric(lines[top]):
        above = [k for k in range(top) if lines[k].strip()]
        if above and _alike(lines[above[-1]].strip().lstrip("#"), lines[top]):
            return above[-1], top
        return top, top + 1
    below = kept[1:_PREAMBLE]
    found = _above_numbers(lines, kept[:_PREAMBLE])
    filled_up = below and _alike(lines[top], lines[below[0]])
    if found is None or (
        filled_up and (_states_units(lines[top]) or not _are_names(lines[found], lines[top]))
    ):
        return top, top + 1
    return found, found + 1


def _above_numbers(lines: list[str], kept: list[int]) -> int | None:
    """Place of the first line of words that may name the numbers right below it, or below a row of units."""
    for before, (k, after) in zip([None, *kept], pairwise(kept), strict=False):
        if _numeric(lines[k]) or not _alike(lines[k], lines[after]) or not _numeric(lines[after]):
            continue
        words = _words(lines[k])
        units = all(map(_is_unit, words)) or odd_unit(words) is not None
        named = before is not None and _alike(lines[before], lines[k]) and not _numeric(lines[before])
        return before if units and named else k
    return None


def _words(line: str) -> list[str]:
    """What stands in the cells of a line that are not empty."""
    cells = [cell.strip().strip('"').strip() for cell in _cells(line, _separator(line, line))]
    return [cell for cell in cells if cell]


def _are_names(line: str, above: str) -> bool:
    """Whether a line holds words alone, each once, none of them a number or a unit, and as many as one above it."""
    words = _words(line)
    if len(words) < len(_words(above)):
        return False
    texts = not any(map(_is_unit, words)) and all(any(map(str.isalpha, word)) for word in words)
    return texts and len(set(words)) == len(words) and not any(map(_is_number, words))


def _states_units(line: str) -> bool:
    """Whether a word of a line ends in a unit (`time_s`, `angle [deg]`)."""
    ends = [re.split(r"[\s_\[\]()]+", word.rstrip("])")) for word in _words(line)]
    return any(len(parts) > 1 and parts[-1] and _is_unit(parts[-1]) for parts in ends)


def _alike(names: str, row: str) -> bool:
    """Whether a line may name the cells of a row: as many, and more than one."""
    separator = _separator(names, row)
    cells, below = _cells(names, separator), _cells(row, separator)
    whole = [len(c) - (not c[-1].strip()) for c in (cells, below)]  # without a separator behind the last cell
    return len(cells) == len(below) > 1 or whole[0] == whole[1] > 1


def _trailing(below: list[str], separator: str, names: list[str]) -> bool:
    """Whether a separator stands behind the last cell of rows: in the first, and where the header ends so too, nothing
    behind it in any row seen, as a last column without a name may be empty in the first."""
    row = next((line for line in below[:2] if _numeric(line)), "")  # below a row of units, if any
    unnamed = names[-1] == ""
    if not _ends_empty(row, separator, len(names) - unnamed):
        return False
    cells = [_cells(line, separator) for line in below if unnamed and _numeric(line)]
    return not any(len(row) == len(names) and row[-1].strip() for row in cells)


def _ends_empty(row: str, separator: str, count: int) -> bool:
    """Whether a row holds this number of cells and one more behind them, which is empty."""
    *cells, last = _cells(row, separator) or [""]
    return len(cells) == count and not last.strip()


def _numeric(line: str) -> bool:
    """Whether a line begins with a number or a date."""
    cell = _cells(line, _separator(line, line))[0].strip().strip('"')
    return _is_number(cell) or _is_number(cell.replace(",", ".")) or _DATE.fullmatch(cell) is not None


def _below(head: Head, lines: list[bytes]) -> Head:
    """Take in a row of units, if there is one, and look for dates in the first row."""
    rows = [[cell.strip().strip('"') for cell in _cells(_text(line), head.separator)] for line in lines]
    if head.trailing:
        rows = [row[:-1] if len(row) > len(head.columns) else row for row in rows]
    if rows and len(rows[0]) == len(head.columns) and any(rows[0]) and all(map(_is_unit, rows[0])):
        units = tuple(cell.strip("[]()") for cell in rows.pop(0))
        first_line, size = head.first_line + 1, head.size + len(lines[0]) + 1
        head = replace(head, units=units, first_line=first_line, size=size)
    if not rows or len(rows[0]) != len(head.columns):
        return head
    dated = {name: cell for name, cell in zip(head.columns, rows[0], strict=True) if _DATE.fullmatch(cell)}
    if not dated:
        return head
    day = min(seconds_since(cell, datetime(1970, 1, 1)) or 0.0 for cell in dated.values()) // 86400.0
    return replace(
        head, dates=frozenset(dated), day=datetime.fromtimestamp(day * 86400.0, UTC).replace(tzinfo=None)
    )


def seconds_since(cell: str, day: datetime) -> float | None:
    """Seconds from midnight of `day` (UTC) to a date and time; None if the cell holds none."""
    text = cell.strip().replace(",", ".")
    if not _DATE.fullmatch(text):
        return None
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        return None
    at = at if at.tzinfo is None else at.astimezone(UTC).replace(tzinfo=None)
    whole = (at.replace(microsecond=0) - day).total_seconds()
    fraction = re.search(r"\.\d+", text)
    return whole + (float(fraction[0]) if fraction else 0.0)


def odd_unit(cells: list[str]) -> str | None:
    """Of what seems to be a row of units, the one that is not known; None if it is no such row."""
    texts = [cell.strip().strip('"') for cell in cells]
    odd = [text for text in texts if not _is_unit(text)]
    return odd[0] if 0 < len(odd) < len([t for t in texts if t]) and not any(map(_is_number, texts)) else None


def _is_unit(cell: str) -> bool:
    bare = cell.strip("[]()")
    known = any(unit_named(bare, table) is not None for table in UNITS.values())
    return not bare or known or bare in ("-", "1", "V", "%", "bool", "counts", "raw")


def plain_breaks(text: bytes) -> bytes:
    """Line breaks of any kind as `\\n`."""
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text


def number(cell: str) -> float | None:
    """The number in a cell, NaN of an empty one, None if it holds anything else."""
    if "_" in cell:
        return None
    text = cell.strip()
    if not text:
        return float("nan")
    try:
        return float(text)
    except ValueError:
        return None


def _is_number(text: str) -> bool:
    return bool(text) and number(text) is not None
