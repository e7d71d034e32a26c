"""ROS bags, format 1 (`.bag`) and 2 (`.db3`, or the folder with `metadata.yaml`); optional package `rosbags`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from cablecomp.errors import InputError
from cablecomp.recording.array_file import first_line
from cablecomp.recording.messages import Message, MessageLog, numbers, stamp_of
from cablecomp.recording.packages import package

_MOST_SEQUENCE: Final = 100_000


def open_bag(path: Path) -> MessageLog:
    """Open a bag; InputError if it is damaged or holds no message whose type it defines.

    Bags of format 2 that carry no definitions are read by those of ROS 2 Humble.
    """
    ending, reindex = _habits(path)
    if path.is_file() and path.suffix != ending:
        raise InputError(f"{path}: is a ROS bag; rename it to {path.stem}{ending}")
    highlevel = package("rosbags.highlevel", path, "ros", "a ROS bag")
    typesys = package("rosbags.typesys", path, "ros", "a ROS bag")

    def reader() -> Any:
        found = highlevel.AnyReader(
            [path], default_typestore=typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        )
        found.open()
        found.typestore.max_sequence_length = _MOST_SEQUENCE
        return found

    skipped: dict[str, str] = {}
    bag = _guarded(path, reader, f"; try `{reindex}`")
    try:
        for connection in bag.connections:
            if connection.msgtype not in bag.typestore.fielddefs:
                skipped[connection.topic] = f"its type {connection.msgtype} is not defined in the bag"
    finally:
        bag.close()

    def read(topics: frozenset[str] | None) -> Iterator[tuple[Message, float]]:
        bag = _guarded(path, reader)
        try:
            wanted = [
                c for c in bag.connections if c.topic not in skipped and (topics is None or c.topic in topics)
            ]
            first, span = (bag.start_time, max(bag.duration, 1)) if wanted else (0, 1)
            stream = iter(bag.messages(wanted)) if wanted else iter(())
            while (found := _guarded(path, lambda: next(stream, None))) is not None:
                connection, logged, data = found
                content = _guarded(
                    path,
                    lambda: bag.deserialize(data, connection.msgtype),  # noqa: B023  # called at once
                )
                message = Message(connection.topic, int(logged), stamp_of(content), numbers(content))
                yield message, min((logged - first) / span, 1.0)
        finally:
            bag.close()

    return MessageLog("bag", read, skipped)


def _habits(path: Path) -> tuple[str, str]:
    """How a bag's file is named, and the command that mends its index."""
    if path.is_file():
        with path.open("rb") as file:
            if file.read(7) == b"#ROSBAG":
                return ".bag", "rosbag reindex"
    return ".db3", "ros2 bag reindex"


def _guarded(path: Path, action: Any, advice: str = "; record it anew") -> Any:
    try:
        return action()
    except InputError:
        raise
    except Exception as error:  # whatever the package makes of a damaged bag
        raise InputError(f"{path}: cannot be read as a ROS bag ({first_line(error)}){advice}") from None
