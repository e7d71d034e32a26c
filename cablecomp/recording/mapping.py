"""What a foreign file's columns mean: column or topic field -> channel, with unit, sign, scale, zero.

channel = sign * scale * in SI(column - zero), where `unit` (or `counts_per_rev`, or the torque constant of a
current) says how to reach SI. In TOML (`--map FILE.toml`, or found beside the recording as `RECORDING.map.toml`
or `cablecomp.map.toml`) or one by one: `--map motor_position_rad=enc1,unit=deg,sign=-1`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import Field, model_validator

from cablecomp.config import validated
from cablecomp.config.base import Finite, Frozen, NonNegative, Positive, Text
from cablecomp.config.toml_file import key_text, read_toml, value_text
from cablecomp.errors import ConfigError, InputError, printable
from cablecomp.recording.atomic import atomic_file
from cablecomp.recording.channels import CANONICAL, QUANTITIES, Column, order, parse_column
from cablecomp.recording.join import JoinRule
from cablecomp.units import Unit, unit_named

FOLDER_MAP: Final = "cablecomp.map.toml"


class Source(Frozen):
    """Where one channel comes from: `column` as the file names it (topics: `TOPIC.FIELD`)."""

    column: Text = Field(description="column, or topic.field, as `cablecomp inspect` shows it")
    unit: Text | None = Field(
        None, description="unit of the column (deg, ms, mNm, ...); that of the channel if absent"
    )
    sign: Literal[1, -1] = Field(1, description="-1 turns it round")
    scale: Finite = Field(1.0, description="factor beyond the unit, such as a gear")
    zero: Finite = Field(
        0.0, description="what the column reads where the channel is zero, in the column's unit"
    )
    counts_per_rev: Positive | None = Field(None, description="encoder counts per turn; instead of a unit")
    torque_constant_Nm_per_A: Positive | None = Field(None, description="for a torque from a current [A]")

    @model_validator(mode="after")
    def _one_unit(self) -> Self:
        given = [self.unit, self.counts_per_rev]
        if all(v is not None for v in given):
            raise ValueError("`unit` and `counts_per_rev` say the same: one is accepted")
        if self.scale == 0.0:
            raise ValueError("scale 0 makes nothing of it: another number is accepted")
        return self


class Join(Frozen):
    """How messages of several topics become rows; absent = chosen from the recording."""

    leader: Text | None = Field(None, description="the topic each message of which is a row")
    within_s: NonNegative | None = Field(
        None, description="how much later than the row a value may be stamped"
    )
    hold_s: Positive | None = Field(None, description="how old a value may be")
    clock: Literal["auto", "stamp", "log"] = Field(
        "auto", description="the senders' stamps, or the logger's time"
    )


class ColumnMap(Frozen):
    """A mapping file: `[channel.NAME]` for each channel, and `[join]`."""

    schema_: Literal[1] = Field(1, alias="schema", description="version of this format")
    channel: dict[str, Source] = Field(default_factory=dict)
    join: Join = Join()

    @model_validator(mode="after")
    def _channels(self) -> Self:
        for name in self.channel:
            if name not in CANONICAL and parse_channel(name) is None:
                raise ValueError(
                    f"[channel.{name}]: no such channel; {', '.join(CANONICAL)}, other_<name> are accepted"
                )
        return self

    @property
    def rule(self) -> JoinRule:
        """The rule of joining as far as it is stated."""
        return JoinRule(self.join.leader, self.join.within_s, self.join.hold_s, self.join.clock)


def parse_channel(name: str) -> str | None:
    """The canonical channel of this very name; None if there is none."""
    try:
        column = parse_column(name)
    except InputError:
        return None
    return name if column.name == name else None


def load_mapping(path: Path) -> ColumnMap:
    """Read a mapping file; raises ConfigError with one line for each error."""
    return validated(ColumnMap, read_toml(path), str(path))


def mapping_from(words: Iterable[str]) -> ColumnMap:
    """A mapping from `CHANNEL=COLUMN[,key=value...]` words; raises InputError for one that is not of that form."""
    table: dict[str, Any] = {}
    for word in words:
        channel, equals, rest = word.partition("=")
        column, *options = _split(rest)
        if not equals or not channel.strip() or not column:
            raise InputError(f"--map {word}: CHANNEL=COLUMN[,unit=..][,sign=-1].. or a TOML file is accepted")
        if channel.strip() in table:
            raise InputError(f"--map: {channel.strip()} is given twice; give it once")
        table[channel.strip()] = {"column": column, **dict(_option(word, option) for option in options)}
    return validated(ColumnMap, {"channel": table}, "--map")


def _split(text: str) -> list[str]:
    """Parts between commas; a part without `=` belongs to the column's name."""
    parts = text.split(",")
    while len(parts) > 1 and "=" not in parts[1]:
        parts = [f"{parts[0]},{parts[1]}", *parts[2:]]
    return [part.strip() for part in parts]


def _option(word: str, option: str) -> tuple[str, Any]:
    key, _, text = option.partition("=")
    if key.strip() == "unit":
        return "unit", text.strip()
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"--map {word}: {key.strip()} is {text!r}; a number is accepted") from None
    return key.strip(), int(number) if key.strip() == "sign" and number in (1.0, -1.0) else number


def joined_maps(first: ColumnMap, then: ColumnMap) -> ColumnMap:
    """Both mappings in one; where both name a channel, the second holds."""
    return first.model_copy(update={"channel": {**first.channel, **then.channel}})


def find_mapping(recording: Path) -> Path | None:
    """The mapping saved for this recording, or for all of its folder; None if there is none."""
    own = recording.with_name(f"{recording.name}.map.toml")
    return next((p for p in (own, recording.parent / FOLDER_MAP) if p.is_file()), None)


def foreign_column(mapping: ColumnMap, names: Collection[str]) -> str | None:
    """A column that a mapping names and a file has not: it is that of another file; None if it has all of them."""
    return next((s.column for s in mapping.channel.values() if s.column not in names), None)


def columns_by(mapping: ColumnMap, names: Sequence[str], units: Mapping[str, str]) -> tuple[Column, ...]:
    """What the file's columns mean by the mapping; canonical names that it leaves out mean themselves.

    Raises ConfigError with one line for every channel whose column or unit is not known.
    """
    found: dict[str, Column] = {}
    wrong = []
    for channel, source in mapping.channel.items():
        if source.column not in names:
            wrong.append(
                f"[channel.{channel}]: the file has no column '{source.column}'; it has {_some(names)}"
            )
            continue
        try:
            found[channel] = column_of(channel, source, units.get(source.column))
        except InputError as error:
            wrong.append(str(error))
    if wrong:
        raise ConfigError(wrong)
    taken = {column.column for column in found.values()}
    for name in names:
        own = meaning(name)
        if own is not None and own.name not in found and name not in taken:
            found[own.name] = own
    return tuple(found[name] for name in order(found))


def column_of(channel: str, source: Source, stated_unit: str | None = None) -> Column:
    """What a source means for a channel; raises InputError for a unit that is none of the channel's."""
    unit = _unit(channel, source, source.unit or stated_unit)
    factor = source.sign * source.scale * unit.factor
    if channel == "time_s" and factor < 0.0:
        raise InputError(
            "[channel.time_s]: time that is turned round runs backwards; a positive factor is accepted"
        )
    return Column(
        source.column, channel, factor, source.sign * source.scale * unit.offset - factor * source.zero
    )


def check_units(columns: Iterable[Column], units: Mapping[str, str]) -> None:
    """Raise InputError if a file states another unit for a column than the column's own name does."""
    for column in columns:
        stated = units.get(column.column)
        if stated is None or meaning(column.column) != column or column.name not in CANONICAL:
            continue
        quantity = next(q for q, table in QUANTITIES.items() if column.name == f"{q}_{next(iter(table))}")
        unit = unit_named(stated, QUANTITIES[quantity])
        if unit is None or (unit.factor, unit.offset) != (column.factor, column.offset):
            raise InputError(
                f"column {column.column!r} stands over the unit {stated!r}, which is not that of its name; "
                "mend one of them, or say by a mapping which holds"
            )


def meaning(name: str) -> Column | None:
    """What a column's own name says, if it is a channel's."""
    try:
        return parse_column(name)
    except InputError:
        return None


def _unit(channel: str, source: Source, unit: str | None) -> Unit:
    quantity = next((q for q, table in QUANTITIES.items() if channel == f"{q}_{next(iter(table))}"), None)
    where = f"[channel.{channel}]"
    if source.counts_per_rev is not None:
        if quantity is None or "rad" not in QUANTITIES[quantity]:
            raise InputError(f"{where}: counts_per_rev is for angles; give a `unit` or `scale`")
        return Unit(2.0 * math.pi / source.counts_per_rev)
    if source.torque_constant_Nm_per_A is not None:
        table = QUANTITIES["motor_current"]
        current = Unit(1.0) if unit is None else unit_named(unit, table)
        if current is None or quantity is None or "Nm" not in QUANTITIES[quantity]:
            raise InputError(
                f"{where}: a torque constant takes a torque from a current in {', '.join(table)}"
            )
        return Unit(source.torque_constant_Nm_per_A * current.factor)
    if unit is None or quantity is None:
        return Unit(1.0)
    found = unit_named(unit, QUANTITIES[quantity])
    if found is None:
        raise InputError(
            f"{where}: unit '{unit}' is none for it; {', '.join(QUANTITIES[quantity])} are accepted"
        )
    return found


def mapping_text(mapping: ColumnMap, comments: Iterable[str] = ()) -> str:
    """TOML of a mapping, which reads back as the same."""

    lines = [f"# {printable(line)}" for line in comments] + ["schema = 1"]
    for channel, source in mapping.channel.items():
        lines += ["", f"[channel.{key_text(channel)}]"]
        kept = {k: v for k, v in source.model_dump().items() if v != Source.model_fields[k].default}
        lines += [f"{k} = {value_text(v)}" for k, v in kept.items()]
    kept = {k: v for k, v in mapping.join.model_dump().items() if v is not None and v != "auto"}
    lines += ["", "[join]", *(f"{k} = {value_text(v)}" for k, v in kept.items())] if kept else []
    return "\n".join(lines) + "\n"


def save_mapping(path: Path, mapping: ColumnMap, comments: Iterable[str] = ()) -> None:
    """Write a mapping file, whole or not at all; raises InputError where it cannot be written."""
    with atomic_file(path) as temporary:
        temporary.write_text(mapping_text(mapping, comments), encoding="utf-8")


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(f"'{n}'" for n in names[:24])
    return f"{shown} and {len(names) - 24} more" if len(names) > 24 else shown
