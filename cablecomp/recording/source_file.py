"""Opening any accepted kind of file as a raw table, or as a log of messages and its topics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from cablecomp.errors import InputError
from cablecomp.recording.array_file import open_mat, open_npz
from cablecomp.recording.bag_file import open_bag
from cablecomp.recording.can_log import DecodeFrame, open_can_log
from cablecomp.recording.channels import Column
from cablecomp.recording.csv_text import open_csv
from cablecomp.recording.hdf5_file import open_hdf5
from cablecomp.recording.mapping import meaning
from cablecomp.recording.mcap_file import open_mcap
from cablecomp.recording.messages import MessageLog
from cablecomp.recording.parquet_file import open_parquet
from cablecomp.recording.raw import RawTable
from cablecomp.recording.source import identify
from cablecomp.recording.topics import TopicFacts, survey


@dataclass(frozen=True)
class Messages:
    """A log of messages with what one pass found: `fields` is raw column name -> (topic, field)."""

    log: MessageLog
    topics: dict[str, TopicFacts]
    fields: dict[str, tuple[str, str]] = field(default_factory=dict)

    def own_columns(self) -> dict[str, Column]:
        """Raw column -> channel, for fields whose own name is a channel's.

        A message whose only number is called value or data goes by the last part of its topic.
        """
        found = {}
        for raw, (topic, key) in self.fields.items():
            alone = len(self.topics[topic].fields) == 1 and key in ("value", "data")
            column = meaning(topic.rsplit("/", 1)[-1] if alone else key)
            if column is not None:
                found[raw] = column._replace(column=raw)
        return found


def open_file(path: Path, decode: Callable[[], DecodeFrame] | None = None) -> tuple[str, RawTable | Messages]:
    """Open a file by what it holds; returns its kind and content. InputError if it cannot be read."""
    kind, gzipped = identify(path)
    if kind == "text":
        return kind, open_csv(path, gzipped)
    if kind == "parquet":
        return kind, open_parquet(path)
    if kind == "npz":
        return kind, open_npz(path)
    if kind == "hdf5":
        return kind, open_hdf5(path)
    if kind == "mat":
        return kind, open_mat(path)
    log = _open_log(path, kind, decode)
    topics = survey(log)
    fields = {f"{t.name}.{key}": (t.name, key) for t in topics.values() for key in t.fields}
    if not fields:
        why = "; ".join(f"{topic}: {reason}" for topic, reason in list(log.skipped.items())[:5])
        hint = "; MF4 of signals is not read: export it as CSV" if kind == "mf4" else ""
        raise InputError(f"{path}: holds no message with numbers in it{f' ({why})' if why else ''}{hint}")
    return kind, Messages(log, topics, fields)


def _open_log(path: Path, kind: str, decode: Callable[[], DecodeFrame] | None) -> MessageLog:
    if kind == "mcap":
        return open_mcap(path)
    if kind == "bag":
        return open_bag(path)
    if kind in ("blf", "asc", "candump", "trc", "mf4"):
        return open_can_log(path, kind, decode)  # type: ignore[arg-type]  # narrowed by the line above
    raise InputError(f"{path}: kind {kind} is not read")
