"""What is fuzzed: every reader of files and every decoder of frames. A target takes bytes and returns if they are
accepted or refused in one line; anything else is a defect.
"""

from __future__ import annotations

import atexit
import math
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from cablecomp.config import load_joint
from cablecomp.control.options import load_control
from cablecomp.control.protocol import load_protocol
from cablecomp.errors import ConfigError, InputError, printable
from cablecomp.links.load import load_link
from cablecomp.links.logged import LinkDecoder
from cablecomp.links.serial_frames import RecordReader, cobs_decode
from cablecomp.links.slcan_frames import LineReader
from cablecomp.recording.can_log import Frame, by_dbc
from cablecomp.recording.mapping import load_mapping, mapping_from
from cablecomp.recording.message_decoders import decoder_for
from cablecomp.recording.messages import numbers, stamp_of
from cablecomp.recording.raw_columns import raw_columns
from cablecomp.recording.reader import read_all

LINKS = Path(__file__).parents[2] / "configs/links"
DEVICES = ("mit-virtual", "odrive-virtual", "damiao-socketcan", "dbc-virtual")
Target = Callable[[bytes], None]

_folder = Path(tempfile.mkdtemp(prefix="cablecomp-fuzz-"))
atexit.register(shutil.rmtree, _folder, ignore_errors=True)


def _file(data: bytes, ending: str) -> Path:
    path = _folder / f"{os.getpid()}{ending}"
    path.write_bytes(data)
    return path


def _said(action: Callable[[], object]) -> None:
    """Run it; a refusal has to be one line for each error, which names something."""
    lines: tuple[str, ...] = ("fine",)
    try:
        action()
    except ConfigError as error:
        lines = error.lines
    except InputError as error:
        lines = (printable(str(error)),)
    assert lines
    assert all(line and line.isprintable() for line in lines)


def _toml(load: Callable[[Path], object]) -> Target:
    return lambda data: _said(lambda: load(_file(data, ".toml")))


def recording(data: bytes) -> None:
    """A file of any kind, read whole and looked at."""
    path = _file(data, ".rec")
    _said(lambda: _checked(path))
    _said(lambda: raw_columns(path, _by_table))


def _checked(path: Path) -> None:
    table = read_all(path, decode=_by_table)
    for name, values in table.columns.items():
        assert values.dtype == float
        if not name.startswith(("other_", "temperature")):
            assert all(map(math.isfinite, values.tolist())), name


def frames(data: bytes) -> None:
    """Frames for the devices of a link: a byte that chooses the link, then identifier (2), length, data."""
    if not data:
        return
    decoder = _decoders[data[0] % len(_decoders)]
    at = 1
    while at + 3 <= len(data):
        identifier, length = int.from_bytes(data[at : at + 2], "little"), data[at + 2] % 65
        decoder(Frame(0.0, identifier & 0x7FF, bool(identifier & 0x800), data[at + 3 : at + 3 + length]))
        at += 3 + length


def serial(data: bytes) -> None:
    """Bytes of a serial line: COBS records, and slcan's text."""
    cobs_decode(data)
    for reader in (RecordReader(), LineReader()):
        found: list[tuple[int, bytes]] = []
        for k in range(0, len(data), 7):
            reader.feed(
                data[k : k + 7], lambda identifier, body, found=found: found.append((identifier, body))
            )
        assert all(len(body) <= 64 for _, body in found)


def ros(data: bytes) -> None:
    """The body of a ROS 2 message by its schema."""
    import struct

    from rosbags.serde import SerdeError

    try:
        content = _ros_decode(data)
    except (SerdeError, ValueError, IndexError, struct.error, MemoryError):
        return
    numbers(content)
    stamp_of(content)


def words(data: bytes) -> None:
    """A mapping in words."""
    _said(lambda: mapping_from(data.decode("utf-8", "replace").split("\n")))


_by_table = by_dbc(LINKS / "cablecomp_joint.dbc")
_decoders = [LinkDecoder(load_link(LINKS / f"{name}.toml")) for name in DEVICES]
_SCHEMA = (
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    f"{'=' * 80}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)


class _Schema:
    name, encoding, data = "sensor_msgs/msg/JointState", "ros2msg", _SCHEMA.encode()


_decode = decoder_for("cdr", _Schema, Path("x"))


def _ros_decode(data: bytes) -> object:
    assert not isinstance(_decode, str)
    return _decode(data)


TARGETS: dict[str, Target] = {
    "recording": recording,
    "joint": _toml(load_joint),
    "link": _toml(load_link),
    "control": _toml(load_control),
    "protocol": _toml(load_protocol),
    "mapping": _toml(load_mapping),
    "words": words,
    "frames": frames,
    "serial": serial,
    "ros": ros,
}
