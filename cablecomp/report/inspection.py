"""What `cablecomp inspect` found in a recording, for the terminal and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from cablecomp.config import JointConfig
from cablecomp.counting import counted
from cablecomp.errors import path_text
from cablecomp.recording.channels import CANONICAL
from cablecomp.recording.inspection import ChannelQuality, Inspection, clipped_words, stuck_words, turns_words
from cablecomp.recording.mapping import ColumnMap, mapping_text
from cablecomp.recording.raw_columns import RawColumns
from cablecomp.recording.replay import required_channels
from cablecomp.recording.suggest import Suggestion


class Looked(NamedTuple):
    """A recording looked at: its columns, what they may mean and are taken for; the quality of its channels and the
    reader's remarks, or why there are none; the joint, if it is known."""

    recording: Path
    raw: RawColumns
    suggested: list[Suggestion]
    mapping: ColumnMap
    seen: Inspection | None
    notes: tuple[str, ...]
    why: str
    config: JointConfig | None = None


def missing_channels(channels: Sequence[str], config: JointConfig | None = None) -> list[str]:
    """A line that names the channels without which nothing can be compared, if any are missing: of a joint that is not
    known its load is taken to be measured."""
    read = ("motor_position_rad", "joint_torque_Nm") if config is None else required_channels(config)
    needed = dict.fromkeys((*read, "joint_position_rad"))
    missing = [name for name in needed if name not in channels]
    if not missing:
        return []
    made_of = ""
    torque = next((name for name in missing if name.endswith("torque_Nm")), None)
    if "motor_torque_Nm" in missing and "motor_current_A" in channels:
        made_of = " (the current's: --map 'motor_torque_Nm=COLUMN,torque_constant_Nm_per_A=..')"
    elif torque is not None:
        made_of = f" (a force's, at a radius in m: --map '{torque}=COLUMN,scale=RADIUS')"
    return [f"missing: {', '.join(missing)}; which columns are they?{made_of}"]


def show(looked: Looked, console: Console) -> None:
    """Print what was found: columns and what they may mean, quality, remarks, the mapping."""
    raw, mapping, seen = looked.raw, looked.mapping, looked.seen
    rows = len(next(iter(raw.columns.values())))
    console.print(
        f"{looked.recording}: {raw.kind}, {counted(len(raw.columns), 'column')} of numbers, "
        f"{counted(rows, 'row')} looked at"
    )
    for topic in raw.topics.values():
        stamped = ", stamped by its sender" if topic.stamped else ""
        console.print(
            f"  {topic.name}: {counted(topic.count, 'message')}, every {1e3 * topic.period_s:.4g} ms{stamped}"
        )
    console.print(_columns_table(raw, looked.suggested, mapping))
    if seen is None:
        console.print(f"not yet a recording: {looked.why}", style="yellow")
    else:
        _show_quality(seen, console)
        for line in missing_channels([c.name for c in seen.channels], looked.config):
            console.print(line, style="yellow")
    for note in looked.notes:
        console.print(f"note: {note}")
    console.print("\nmapping:\n" + mapping_text(mapping))


def _columns_table(raw: RawColumns, found: list[Suggestion], mapping: ColumnMap) -> Table:
    table = Table(box=None, show_header=True)
    for name in ("column", "from", "to", "channel", "sure", "because"):
        table.add_column(
            name,
            justify="right" if name in ("from", "to", "sure") else "left",
            no_wrap=name == "channel",
            overflow="fold",
        )
    by_column = {source.column: channel for channel, source in mapping.channel.items()}
    reasons = {s.source.column: s for s in found}
    for name, values in raw.columns.items():
        finite = values[np.isfinite(values)]
        low, high = (f"{finite.min():.5g}", f"{finite.max():.5g}") if len(finite) else ("–", "–")
        reason = reasons.get(name)
        itself = reason.channel if reason is not None and reason.channel == name else ""
        channel = by_column.get(name, itself)
        told = reason is not None and reason.channel == channel
        sure = f"{100 * min(reason.sure, 1.0):.0f} %" if told and reason is not None else ""
        words = "; ".join(reason.why) if told and reason is not None else ("as mapped" if channel else "")
        if not len(finite):
            words = "is empty"
        if reason is not None and reason.unknown is not None and not channel:
            words = f"unit {reason.unknown} is not known"
        table.add_row(name, low, high, channel, sure, words)
    for name in raw.left_out:
        table.add_row(name, "text", "", "", "", "")
    return table


def _show_quality(seen: Inspection, console: Console) -> None:
    console.print(
        f"{counted(seen.rows, 'row')} over {seen.duration_s:.6g} s, {seen.rate_Hz:.6g} Hz, steps even within "
        f"{max(100 * seen.jitter, 0.01):.2g} %, {counted(len(seen.gaps), 'gap')}, "
        f"{counted(seen.duplicates, 'repeated stamp')}"
    )
    table = Table(box=None)
    for name in ("channel", "least", "greatest", "noise", "step", "odd"):
        left, whole = name in ("channel", "odd"), name == "channel"
        table.add_column(name, justify="left" if left else "right", no_wrap=whole, overflow="fold")
    for c in seen.channels:
        noise = "–" if c.noise is None else f"{'≥ ' if c.coloured else ''}{c.noise:.3g}"
        step = f"{c.step:.3g}" if c.step else "–"
        low, high = (f"{v:.6g}" if np.isfinite(v) else "–" for v in (c.least, c.greatest))
        table.add_row(c.name, low, high, noise, step, "; ".join(_odd(c, seen)))
    console.print(table)
    if seen.repeats is not None:
        r = seen.repeats
        console.print(
            f"repeatability: {1e3 * r.joint_rad:.4g} mrad RMS between {r.cycles} cycles of {r.period_s:.4g} s"
        )


def _odd(c: ChannelQuality, seen: Inspection) -> list[str]:
    found = []
    if c.least == c.greatest:
        found.append("constant")
    elif c.stuck_s > 0.05 * seen.duration_s and not c.name.startswith("other_"):  # no sensor of the drive's
        found.append(stuck_words(c.stuck_s))
    if c.clipped > 0.0:
        found.append(clipped_words(c.clipped))
    if c.turns:
        found.append(turns_words(c.turns))
    if c.empty:
        found.append(f"{c.empty} empty")
    return found


def inspection_json(looked: Looked) -> dict[str, object]:
    """The same as plain data."""
    raw, seen = looked.raw, looked.seen
    quality = None
    if seen is not None:
        quality = {
            "rows": seen.rows,
            "duration_s": seen.duration_s,
            "rate_Hz": seen.rate_Hz,
            "jitter": seen.jitter,
            "gaps": [{"row": row, "gap_s": gap} for row, gap in seen.gaps],
            "duplicates": seen.duplicates,
            "channels": [_finite(c._asdict() if hasattr(c, "_asdict") else vars(c)) for c in seen.channels],
            "repeats": None if seen.repeats is None else vars(seen.repeats),
        }
    return {
        "schema": 1,
        "recording": path_text(looked.recording),
        "kind": raw.kind,
        "columns": list(raw.columns),
        "text_columns": list(raw.left_out),
        "topics": {t.name: {"messages": t.count, "period_s": t.period_s} for t in raw.topics.values()},
        "suggested": {
            s.channel: {"sure": s.sure, "why": s.why} for s in looked.suggested if s.channel in CANONICAL
        },
        "mapping": looked.mapping.model_dump(by_alias=True),
        "quality": quality,
        "notes": list(looked.notes),
        "not_yet": looked.why or None,
    }


def _finite(values: dict[str, object]) -> dict[str, object]:
    return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in values.items()}
