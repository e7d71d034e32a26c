"""Link files: those that ship load, mistakes end in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from cablecomp.errors import InputError
from cablecomp.links import BusLink, load_link, parse_link
from cablecomp.links.schema import CanBus, SerialBus

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
SHIPPED = sorted(CONFIGS.glob("*.toml"))


def text_of(name: str) -> str:
    return (CONFIGS / name).read_text(encoding="utf-8")


def build(text: str) -> BusLink:
    return BusLink(parse_link(tomllib.loads(text), "x.toml", CONFIGS))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
def test_shipped_files_make_links(path: Path) -> None:
    link = BusLink(load_link(path))
    assert link.config.name
    assert all(joint.messages for joint in link.joints)


def test_there_is_one_for_every_kind_of_wire() -> None:
    kinds = {c.bus.interface if isinstance(c.bus, CanBus) else "serial" for c in map(load_link, SHIPPED)}
    assert {"virtual", "udp_multicast", "slcan", "socketcan", "serial"} <= kinds


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rate_Hz", "rate_hz", "unknown key `rate_hz`"),
        ('model = "AK80-9"', 'modle = "AK80-9"', "modle"),
        ('model = "AK80-9"', "", "`range` and `family`"),
        ('model = "AK80-9"', 'model = "AK81"', "unknown MIT model `AK81`"),
        ('model = "AK80-9"', 'model = "AK809"', "x.toml: unknown MIT model `AK809`; did you mean `AK80-9`?"),
        ("node = 1\nreply_id = 0", 'node = "1"\nreply_id = 0', "node"),
        ("hold_s = 0.01", "hold_s = 0.3", "hold_s < fade_s <= stop_s"),
        ("rate_Hz = 1000.0", "rate_Hz = 50.0", "0.02 s or more are accepted"),
        ("hold_s = 0.01", "hold_s = -1", "hold_s"),
        ("hold_s = 0.01", "hold_s = nan", "hold_s"),
        ('device = "drive"', 'device = "driver"', "accepted: drive, joint-node"),
        ('kind = "can"', 'kind = "cna"', "kind"),
        ('schema = 1', 'schema = 2', "schema"),
        ("joint_torque_Nm = {", "joint_torque_mNm = {", "joint_torque_mNm"),
        ('dbc = "cablecomp_joint.dbc"', 'dbc = "none.dbc"', "cannot be read"),
        ('name = "Joint{node}_State"', 'name = "Joint{node}_Stat"', "has no message `Joint1_Stat`"),
        ('signal = "joint_torque_Nm"', 'signal = "torque"', "has no signal `torque`"),
        (
            'signal = "joint_torque_Nm"',
            'signal = "joint_torque_Nm", unit = "rad"',
            "unit `rad` is not one for Nm",
        ),
        ('stamps = "Joint{node}_State"', 'stamps = "Joint{node}_Other"', "does not list"),
        ('stamps_sequence = "sequence"\n', "", "go together"),
        ("stiffness_Nm_per_rad = 200.0", "stiffness_Nm_per_rad = 0.0", "needs a positive one"),
        (
            '[joint.sensor]\ndevice = "joint-node"',
            '[joint.sensor]\ndevice = "drive"',
            "a `dbc` device, a `moteus`, a `cia402` or a `cansimple` drive is accepted",
        ),
    ],
)  # fmt: skip
def test_mistakes_end_in_one_line(old: str, new: str, says: str) -> None:
    text = text_of("mit-virtual.toml")
    assert old in text
    with pytest.raises(InputError) as caught:
        build(text.replace(old, new, 1))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('cyclic = ["encoder", "torques", "temperature"]', 'cyclic = ["encodr"]', "cyclic"),
        ('firmware = "0.6"', 'firmware = "0.5"', "firmware 0.5 has no `torques`"),
        ('firmware = "0.6"', 'firmware = "0.6"\ncurrent_limit_A = 3.0', "go together"),
        ('mode = "position"', 'mode = "impedance"', "has no mode `impedance`"),
        ("node = 1", "node = 64", "0 to 63 are accepted"),
    ],
)
def test_mistakes_with_an_odrive(old: str, new: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        build(text_of("odrive-virtual.toml").replace(old, new, 1))
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('request = "enable"', 'request = "go"', "`go` is no value"),
        ('position = "motor_position_target_rad"', 'position = "motor_pos"', "has no signal `motor_pos`"),
        ('enabled = ["enabled"]', 'enabled = ["on"]', "`on` is no value"),
        ("[device.request.enable]", "[device.request.engage]", "engage"),
        ("stiffness_Nm_per_rad = 200.0", "stiffness_Nm_per_rad = 1e6", "does not fit"),
    ],
)
def test_mistakes_with_a_table(old: str, new: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        build(text_of("dbc-virtual.toml").replace(old, new, 1))
    assert says in str(caught.value)


def test_two_joints_that_cannot_be_told_apart() -> None:
    text = text_of("mit-virtual.toml")
    joint = text[text.index("[[joint]]") :].replace("joint-1", "joint-2")
    with pytest.raises(InputError, match="cannot be told apart"):
        build(text + joint)


def test_everything_that_is_wrong_with_the_wires_is_told_at_once() -> None:
    """A bus without CAN FD for a drive that needs it, and two joints with the same drive."""
    text = text_of("moteus-socketcan.toml").replace("fd = true", "fd = false")
    joint = text[text.index("[[joint]]") :].replace('name = "', 'name = "other-', 1)
    with pytest.raises(InputError) as caught:
        build(text + joint)
    lines = str(caught.value).splitlines()
    assert all(line.startswith("x.toml: ") for line in lines)
    assert any("needs CAN FD" in line for line in lines)
    assert any("cannot be told apart" in line for line in lines)


def test_a_name_given_twice() -> None:
    text = text_of("mit-virtual.toml")
    with pytest.raises(InputError, match=r"joint\.name `joint-1` is there twice"):
        build(text + text[text.index("[[joint]]") :])


def test_redirecting_a_link() -> None:
    config = load_link(CONFIGS / "mit-virtual.toml")
    serial = config.redirect("serial", "/dev/pts/9")
    assert serial.bus == SerialBus(kind="serial", port="/dev/pts/9", sync_id=0x700)
    slcan = config.redirect("slcan", "/dev/pts/9")
    assert isinstance(slcan.bus, CanBus)
    assert slcan.bus.options == {"sleep_after_open": 0}
    udp = config.redirect("udp_multicast", "239.74.163.2", port=50000, hop_limit=0)
    assert isinstance(udp.bus, CanBus)
    assert udp.bus.options["port"] == 50000
    assert (udp.joint, udp.bus.sync_id) == (config.joint, 0x700)


def test_broken_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        load_link(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\x1f\x8b\x00\xff")
    with pytest.raises(InputError, match="not text"):
        load_link(bad)
    data: dict[str, Any] = tomllib.loads(text_of("mit-virtual.toml"))
    with pytest.raises(InputError, match="unknown key `folder`"):
        parse_link({**data, "folder": "/"}, "x.toml")
