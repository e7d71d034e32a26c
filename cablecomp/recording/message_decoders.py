"""Bytes of a message to its content: JSON, protobuf, ROS 1, ROS 2's CDR, by the schema that the file carries."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from cablecomp.errors import InputError
from cablecomp.recording.array_file import first_line
from cablecomp.recording.packages import package

Decode = Callable[[bytes], Any]
_MOST_SEQUENCE: Final = 100_000


def decoder_for(encoding: str, schema: Any, path: Path) -> Decode | str:
    """The decoder of a channel by its encoding and schema (as MCAP names them), or why there is none."""
    if encoding == "json":
        return _json
    try:
        if encoding == "protobuf" and schema is not None and schema.encoding == "protobuf":
            return _protobuf(schema, path)
        if encoding in ("cdr", "ros1") and schema is not None:
            return _ros(encoding, schema, path)
    except InputError:
        raise
    except Exception as error:  # whatever a schema's parser makes of a damaged one
        return f"its schema cannot be read ({first_line(error)})"
    found = f"{encoding or 'no encoding'}, schema {schema.encoding if schema is not None else 'none'}"
    return f"encoded as {found}; json, protobuf, cdr and ros1 are read"


def _json(data: bytes) -> Any:
    try:
        return json.loads(data)
    except RecursionError:
        raise ValueError("JSON nested too deeply") from None


def _protobuf(schema: Any, path: Path) -> Decode:
    """Decode by the file descriptors in the schema. Fields that are not set count as their default (proto3)."""
    descriptor_pb2 = package("google.protobuf.descriptor_pb2", path, "protobuf", "protobuf in MCAP")
    pool_module = package("google.protobuf.descriptor_pool", path, "protobuf", "protobuf in MCAP")
    factory = package("google.protobuf.message_factory", path, "protobuf", "protobuf in MCAP")
    files = {f.name: f for f in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file}
    pool = pool_module.DescriptorPool()
    done: set[str] = set()

    def add(name: str) -> None:
        if name in done or name not in files:
            return
        done.add(name)
        for needed in files[name].dependency:
            add(needed)
        pool.Add(files[name])

    for name in files:
        add(name)
    kind = factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return lambda data: _plain(kind.FromString(data))


def _plain(message: Any) -> Any:
    """A protobuf message as a dictionary of all its fields, the unset ones with their defaults."""
    content: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        repeated = getattr(field, "is_repeated", None)
        repeated = field.label == field.LABEL_REPEATED if repeated is None else repeated
        if repeated and field.message_type is not None:
            content[field.name] = [] if _is_map(field) else [_plain(v) for v in value]
        elif repeated:
            content[field.name] = list(value)
        elif field.message_type is not None:
            if message.HasField(field.name):
                content[field.name] = _plain(value)
        else:
            content[field.name] = value
    return content


def _is_map(field: Any) -> bool:
    return bool(field.message_type.GetOptions().map_entry)


def _ros(encoding: str, schema: Any, path: Path) -> Decode | str:
    typesys = package("rosbags.typesys", path, "ros", f"{encoding} messages")
    text = schema.data.decode("utf-8")
    if schema.encoding in ("ros2msg", "ros1msg"):
        types = typesys.get_types_from_msg(text, schema.name)
    elif schema.encoding == "ros2idl":
        types = typesys.get_types_from_idl(text)
    else:
        return f"schema encoded as {schema.encoding or 'nothing'}; ros2msg, ros2idl and ros1msg are read"
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.max_sequence_length = _MOST_SEQUENCE
    store.register(types)
    name = next((n for n in types if n == schema.name or n.replace("/msg/", "/") == schema.name), schema.name)
    if encoding == "cdr":
        return lambda data: store.deserialize_cdr(data, name)
    return lambda data: store.deserialize_ros1(data, name)
