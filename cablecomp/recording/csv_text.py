"""CSV text to arrays, streaming: head, separator, numbers, and the exact line of anything that is wrong."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from cablecomp.counting import counted
from cablecomp.errors import InputError
from cablecomp.recording.csv_head import (
    QUOTED_COMMA,
    Head,
    number,
    odd_unit,
    plain_breaks,
    read_head,
    seconds_since,
)
from cablecomp.recording.raw import RawTable
from cablecomp.recording.source import Piece, Truncated, ahead, chunks
from cablecomp.recording.table import FloatArray

_BREAK: Final = b"\n"
_LINE_LIMIT: Final = 1 << 20
_BLANKS: Final = re.compile(rb"[ \t]+")
_AT_ENDS: Final = re.compile(rb"^[ \t]+|[ \t]+$", re.MULTILINE)


@dataclass(frozen=True)
class Rows:
    """Parsed rows, one array per column; row k is line `first_line + k`; NaN where empty."""

    first_line: int
    arrays: Mapping[str, FloatArray]
    fraction: float
    text: bytes
    head: Head
    ends_with_break: bool = True
    left_out: int = 0

    def cell(self, row: int, column: str) -> str:
        """Return the text of a cell, for messages."""
        cells = self.text.split(b"\n")[row].decode("utf-8", "replace").split(self.head.separator)
        return cells[self.head.columns.index(column)].strip()


def open_csv(path: Path, gzipped: bool) -> RawTable:
    """Open CSV text (comma, semicolon, tab, blanks; plain or gzip); InputError if it has no header of names."""
    head = read_head(path, gzipped)
    twice = next((n for n, count in Counter(head.columns).items() if count > 1), None)
    if twice is not None:
        raise InputError(f"{path}: line {head.header_line}: column {twice!r} occurs twice; keep one of them")

    def read(names: Sequence[str]) -> Iterator[Rows]:
        return read_rows(path, gzipped, head, names)

    odd = gzipped and path.suffix != ".gz"
    notes = (f"is gzip although it is named {path.suffix or path.name}; read unpacked",) if odd else ()
    where = f"line {head.header_line}: "
    units = {name: unit for name, unit in zip(head.columns, head.units, strict=False) if unit}
    units |= dict.fromkeys(head.dates, "s")
    return RawTable(head.columns, read, "line", where, head.comments, units, notes)


def read_rows(path: Path, gzipped: bool, head: Head, names: Sequence[str]) -> Iterator[Rows]:
    """Stream these columns of the rows below the head; what stands in the others does not matter.

    InputError with the line for ragged rows, text, and files cut short.
    """
    parser = _Parser(path, head, tuple(dict.fromkeys(names)))
    skip, line, tail, fraction = head.size, head.first_line, b"", 0.0
    carriage = b""
    try:
        for piece in _pieces(path, gzipped):
            data, fraction = carriage + piece.data, piece.fraction
            carriage = b"\r" if data.endswith(b"\r") else b""
            data = plain_breaks(data[: len(data) - len(carriage)])
            if skip:
                drop = min(skip, len(data))
                data, skip = data[drop:], skip - drop
            body, tail = _whole_lines(tail + data)
            if len(tail) > _LINE_LIMIT:
                found = "over a million empty lines" if tail.isspace() else "over a million characters"
                raise InputError(f"{path}: line {line + body.count(_BREAK)}: {found}; that is no recording")
            if body:
                rows = parser.parse(body, line, fraction)
                line += len(next(iter(rows.arrays.values())))
                yield rows
    except Truncated as error:
        raise InputError(f"{path}: line {line}: {error}; copy or record the file anew") from None
    rest = (tail + plain_breaks(carriage)).rstrip(b"\n")
    if rest:
        yield parser.parse(rest, line, 1.0, last=not tail.endswith(b"\n"))


def _pieces(path: Path, gzipped: bool) -> Iterator[Piece]:
    pieces = chunks(path, gzipped)
    return ahead(pieces) if gzipped else pieces


@dataclass(frozen=True)
class _Parser:
    path: Path
    head: Head
    names: tuple[str, ...]

    def parse(self, text: bytes, line: int, fraction: float, last: bool = False) -> Rows:
        text = self._unquoted(text, line) if b'"' in text else text
        if self.head.separator == " ":
            text = _BLANKS.sub(b" ", _AT_ENDS.sub(b"", text))
        if self.head.trailing:
            separator = self.head.separator.encode()
            blanks = b" " if separator == b"\t" else rb" \t"  # else empty cells before it would go too
            text = re.sub(rb"%b[%b]*$" % (re.escape(separator), blanks), b"", text, flags=re.MULTILINE)
        if self.head.decimal_comma and self.head.separator != ",":
            text = text.replace(b",", b".")
        arrays = self._fast(text) or self._slow(text, line, last)
        named = dict(zip(self.names, arrays, strict=True))
        return Rows(line, named, fraction, text, self.head, not last)

    def _unquoted(self, text: bytes, line: int) -> bytes:
        """Without quotes; a comma inside them is the decimal one that the head found, or is refused."""
        if self.head.separator == ",":
            if self.head.decimal_comma:
                text = QUOTED_COMMA.sub(rb"\1.\2", text)
            elif (cell := QUOTED_COMMA.search(text)) is not None:
                at, found = line + text[: cell.start()].count(_BREAK), cell[0].decode("utf-8", "replace")
                raise InputError(
                    f"{self.path}: line {at}: {_shown(found)} may "
                    "hold a decimal comma or divide thousands, and no cell near the head tells which; write a point "
                    "for the one and nothing for the other"
                )
        return text.replace(b'"', b"")

    def _fast(self, text: bytes) -> list[FloatArray] | None:
        """Return the columns (NaN where a cell is empty), or None if any row may be ragged or hold text.

        The parser refuses rows with too many cells and fills up short ones: with the right total of
        separators and no refusal, no row is short either.
        """
        places = {name: f"c{i}" for i, name in enumerate(self.head.columns)}
        kinds = {place: pl.Float64 if name in self._numbers else pl.String for name, place in places.items()}
        rows = text.count(b"\n") + (not text.endswith(b"\n"))
        if text.count(self.head.separator.encode()) != rows * (len(places) - 1):
            return None
        try:
            frame = pl.read_csv(
                text, has_header=False, schema=kinds, separator=self.head.separator, quote_char=None
            )
        except pl.exceptions.PolarsError:
            return None
        if frame.height != rows:
            return None
        return [
            frame[places[name]].to_numpy() if name in self._numbers else self._dates(frame[places[name]])
            for name in self.names
        ]

    @property
    def _numbers(self) -> set[str]:
        return set(self.names) - self.head.dates

    def _dates(self, cells: pl.Series) -> FloatArray:
        values = [seconds_since(cell or "", self.head.day) for cell in cells]
        return np.array([np.nan if value is None else value for value in values])

    def _slow(self, text: bytes, line: int, last: bool) -> list[FloatArray]:
        """Parse row by row: allows empty cells, and names the line and column of what is wrong."""
        lines = text.decode("utf-8", "replace").removesuffix("\n").split("\n")
        out = np.empty((len(lines), len(self.names)))
        for k, row in enumerate(lines):
            cut = last and k == len(lines) - 1
            out[k] = self._row(row, line + k, cut)
        return list(np.ascontiguousarray(out.T))

    def _row(self, row: str, line: int, cut: bool) -> list[float]:
        where = f"{self.path}: line {line}"
        ending = " and the file ends inside it: it was cut short; remove that line" if cut else ""
        if not row.strip():
            raise InputError(f"{where}: is empty; remove it, or end the recording before it")
        cells = row.split(self.head.separator)
        if len(cells) != len(self.head.columns):
            raise InputError(
                f"{where}: has {counted(len(cells), 'cell')} where the header names "
                f"{counted(len(self.head.columns), 'column')}{ending or '; mend or remove that line'}"
            )
        values = []
        for name in self.names:
            cell = cells[self.head.columns.index(name)]
            value = seconds_since(cell, self.head.day) if name in self.head.dates else number(cell)
            if value is None:
                odd = odd_unit(cells) if self.head.first_line == line == self.head.header_line + 1 else None
                units = "" if odd is None else f" (of a row of units, {_shown(odd)} is not known)"
                raise InputError(
                    f"{where}: column {name!r} holds {_shown(cell)}"
                    f"{ending or f'; a number is expected there{units}'}"
                )
            values.append(value)
        return values


def _whole_lines(text: bytes) -> tuple[bytes, bytes]:
    """Split into whole lines and the rest; breaks at the end go to the rest: a file may end in them."""
    body = text[: text.rfind(b"\n") + 1].rstrip(b"\n")
    if not body:
        return b"", text
    return body + b"\n", text[len(body) + 1 :]


def _shown(cell: str) -> str:
    return repr(cell if len(cell) <= 40 else cell[:37] + "...")
