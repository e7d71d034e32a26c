"""CAN logs: the same frames give the same channels from every format, by a link file and by a message table."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from cablecomp.errors import InputError
from cablecomp.links.load import load_link
from cablecomp.links.logged import LinkDecoder
from cablecomp.recording.can_log import by_dbc, frames
from cablecomp.recording.mapping import mapping_from
from cablecomp.recording.reader import read_all

LINKS = Path(__file__).parents[2] / "configs/links"
COUNT = 30
FORMATS = ["candump", "asc", "relative.asc", "blf", "trc", "mf4"]


def sent() -> Iterator[tuple[float, int, bytes]]:
    """Every ms an encoder estimate of drive 1 (Get_Encoder_Estimates: float32 turns, turns/s), 100 µs later the
    sensor node's state (µrad, 10 µN m, sequence), and a stranger's frame."""
    for k in range(COUNT):
        t = k * 1e-3
        yield t, 0x29, struct.pack("<ff", 0.25 * k, 0.0)
        yield t + 1e-4, 0x680, struct.pack("<i", 1000 * k) + struct.pack("<i", -200 * k)[:3] + bytes([k])
        yield t + 2e-4, 0x123, b"\xff\xff"


def log(folder: Path, kind: str) -> Path:
    path = folder / f"log.{kind.rpartition('.')[2]}.txt"  # the ending says nothing
    if kind == "candump":
        lines = [f"({1.7e9 + t:.6f}) can0 {i:03X}#{data.hex().upper()}" for t, i, data in sent()]
        path.write_text("\n".join(lines) + "\n")
    elif kind.endswith("asc"):
        last, rows = 0.0, []
        for t, i, data in sent():
            shown = t - last if kind.startswith("relative") else t
            rows.append(
                f"{shown:11.6f} 1  {i:X}             Rx   d {len(data)} {' '.join(f'{b:02X}' for b in data)}"
            )
            last = t
        how = "relative" if kind.startswith("relative") else "absolute"
        head = [
            "date Mon Jan 1 10:00:00.000 am 2024",
            f"base hex  timestamps {how}",
            "internal events logged",
        ]
        path.write_text("\n".join([*head, *rows]) + "\n")
    else:
        own = folder / f"log.{kind}"
        with can.Logger(str(own)) as writer:
            for t, i, data in sent():
                writer(
                    can.Message(
                        timestamp=1.7e9 + t, arbitration_id=i, is_extended_id=False, data=data, channel=1
                    )
                )
        own.rename(path)
    return path


def link() -> Callable[[], LinkDecoder]:
    config = load_link(LINKS / "odrive-virtual.toml")
    return lambda: LinkDecoder(config)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("kind", FORMATS)
def test_a_log_with_a_link_file_gives_its_channels(kind: str, tmp_path: Path) -> None:
    if kind == "mf4":
        pytest.importorskip("asammdf", reason="optional package asammdf is not installed")
    columns = read_all(log(tmp_path, kind), decode=link()).columns
    k = np.arange(COUNT)
    assert columns["time_s"] == pytest.approx(1e-3 * k, abs=2e-6)
    assert columns["motor_position_rad"] == pytest.approx(2.0 * math.pi * 0.25 * k)
    assert columns["joint_position_rad"] == pytest.approx(1e-3 * k)
    assert columns["joint_torque_Nm"] == pytest.approx(-2e-3 * k)


def test_a_log_with_a_message_table_gives_its_signals(tmp_path: Path) -> None:
    path = log(tmp_path, "candump")
    mapping = mapping_from(
        [
            "motor_position_rad=Joint1_State.joint_torque_Nm",
            "joint_position_rad=Joint1_State.joint_position_rad",
        ]
    )
    columns = read_all(path, mapping, by_dbc(LINKS / "cablecomp_joint.dbc")).columns
    assert columns["joint_position_rad"] == pytest.approx(1e-3 * np.arange(COUNT))
    assert columns["motor_position_rad"] == pytest.approx(-2e-3 * np.arange(COUNT))


def test_a_log_without_a_table_says_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is a CAN log .*--link LINK.toml or --dbc"):
        read_all(log(tmp_path, "candump"))


def test_one_joint_of_several_is_chosen_by_name() -> None:
    config = load_link(LINKS / "mit-virtual-8.toml")
    with pytest.raises(InputError, match="choose one with --joint"):
        LinkDecoder(config)
    with pytest.raises(InputError, match="has no joint elbow"):
        LinkDecoder(config, "elbow")
    LinkDecoder(config, config.joint[3].name)


@pytest.mark.parametrize("kind", ["candump", "asc", "blf", "trc"])
def test_damaged_logs_end_in_a_line(kind: str, tmp_path: Path) -> None:
    path = log(tmp_path, kind)
    whole = path.read_bytes()
    rng = np.random.default_rng(2)
    for _ in range(60):
        cut = whole[: int(rng.integers(1, len(whole)))] if rng.random() < 0.3 else whole
        damaged = bytearray(cut)
        for place in rng.integers(0, len(damaged), 3):
            damaged[place] = int(rng.integers(256))
        path.write_bytes(damaged)
        said = ""
        try:
            read_all(path, decode=link())
        except InputError as error:
            said = str(error)
        assert "\n" not in said


@pytest.mark.parametrize("kind", ["candump", "asc"])
def test_a_damaged_line_of_a_log_is_named(kind: str, tmp_path: Path) -> None:
    path = log(tmp_path, kind)
    lines = path.read_text().split("\n")
    at = 20
    lines[at] = lines[at][:-2] + "0p"  # of the last byte in hexadecimal digits
    path.write_text("\n".join(lines))
    with pytest.raises(
        InputError, match=rf"txt: line {at + 1}: damaged {kind.upper()} log \(.*\); record it anew"
    ):
        list(frames(path, kind))


def test_a_container_that_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    packed = zlib.compress(b"\0" * (1 << 28), 9)
    head = struct.pack("<4sL", b"LOGG", 144) + b"\0" * 136
    container = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(packed), 10) + struct.pack(
        "<H6xL4x", 2, 1 << 28
    )
    path = tmp_path / "a.blf"
    path.write_bytes(head + container + packed)
    with pytest.raises(InputError, match="unpacks to over 64 MB"):
        list(frames(path, "blf"))


def test_a_container_packed_in_a_way_that_is_not_known_is_refused(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Its frames would be missing, with no word of which file that was. Method 2 is zlib, 0 is none."""
    path = log(tmp_path, "blf")
    whole = bytearray(path.read_bytes())
    assert whole[144:148] == b"LOBJ"
    assert whole[160:162] == b"\x02\x00"
    whole[160] = 66
    path.write_bytes(whole)
    with pytest.raises(
        InputError, match=r"log\.blf\S*: damaged BLF log \(a container packed by method 66; 0 and 2 are"
    ):
        list(frames(path, "blf"))
    assert not caplog.records
