"""Which identifiers devices use: ours are free beside the common protocols, and no link file has two devices
on one."""

from __future__ import annotations

import tomllib
from pathlib import Path

import cantools
import pytest

from cablecomp.errors import InputError
from cablecomp.links import load_link, parse_link

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
# CiA 301: identifiers of restricted use, and those of the predefined connection set for nodes 1 to 127
CANOPEN = {
    *range(0x080),  # NMT, global failsafe command, restricted
    0x080,
    *range(0x081, 0x181),  # EMCY, TIME, restricted
    *range(0x181, 0x580),  # PDO 1 to 4
    *range(0x580, 0x680),  # SDO
    *range(0x6E0, 0x700),  # restricted
    *range(0x701, 0x800),  # NMT error control, restricted
}
MIT = {*range(0x100), *range(0x100, 0x180), *range(0x200, 0x280), *range(0x300, 0x380), 0x7FF}


def cansimple(nodes: range) -> set[int]:
    return {node << 5 | command for node in nodes for command in range(32)}


def own_identifiers() -> set[int]:
    table = cantools.database.load_file(CONFIGS / "cablecomp_joint.dbc")
    return {m.frame_id for m in table.messages}


def test_own_messages_collide_with_no_common_protocol() -> None:
    own = own_identifiers()
    assert len(own) == 8 * 6 + 1
    assert not own & CANOPEN
    assert not own & MIT
    assert not own & cansimple(range(52))
    assert not own & cansimple(range(57, 64))


def text_of(name: str) -> str:
    return (CONFIGS / name).read_text(encoding="utf-8")


def refusal(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_link(tomllib.loads(text), "x.toml", CONFIGS)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith("x.toml: ")
    return line


def second_joint(text: str, **change: str) -> str:
    joint = text[text.index("[[joint]]") :].replace("joint-1", "joint-2")
    for old, new in change.items():
        old = old.replace("_is_", " = ")
        assert old in joint, old
        joint = joint.replace(old, new)
    return text + joint


def test_an_odrive_on_the_sensor_nodes_identifiers() -> None:
    line = refusal(text_of("odrive-virtual.toml").replace("node = 1", "node = 52", 1))
    assert "identifier 0x680 would be used by `drive` 52 of joint `joint-1` (CANSimple command 0x00)" in line
    assert "`joint-node` 1 of joint `joint-1` (message Joint1_State)" in line
    assert "give one of them another node" in line


def test_the_step_counter_on_a_drives_identifier() -> None:
    assert "the bus" in refusal(text_of("odrive-virtual.toml").replace("node = 1", "node = 56", 1))


def test_two_sensor_nodes_of_one_number() -> None:
    text = second_joint(text_of("mit-virtual.toml"), node_is_1="node = 2").replace(
        'device = "joint-node"\nnode = 2', 'device = "joint-node"\nnode = 1'
    )
    assert "message Joint1_State" in refusal(text)


def test_replies_where_another_drive_takes_its_commands() -> None:
    # drive 1 answers on 0x11, which is drive 17's own number: it would take the answers for commands
    text = text_of("damiao-socketcan.toml")
    joint = second_joint(text)[len(text) :].replace("node = 1", "node = 17", 1).replace("0x11", "0x21")
    line = refusal(text + joint.replace('device = "joint-node"\nnode = 1', 'device = "joint-node"\nnode = 2'))
    assert "0x11" in line
    assert "MIT replies" in line
    assert "MIT commands" in line


def test_replies_that_byte_0_tells_apart_may_share() -> None:
    config = load_link(CONFIGS / "mit-virtual-8.toml")
    assert {j.motor.reply_id for j in config.joint} == {0}


@pytest.mark.parametrize(("number", "accepted"), [(3, True), (18, False)])
def test_damiao_numbers_that_byte_0_cannot_tell_apart(number: int, accepted: bool) -> None:
    # byte 0 carries four bits of the number: 2 and 18 look alike
    text = text_of("damiao-socketcan.toml").replace("node = 1", "node = 2")
    joint = second_joint(text)[len(text) :].replace("node = 2", f"node = {number}", 1)
    both = text + joint.replace("node = 2", "node = 3")
    if accepted:
        assert len(parse_link(tomllib.loads(both), "x.toml", CONFIGS).joint) == 2
    else:
        assert "0x11" in refusal(both)


def test_a_number_that_is_no_identifier() -> None:
    line = text_of("mit-virtual.toml").replace("node = 1\nreply_id", "node = 2048\nreply_id")
    with pytest.raises(InputError, match="0 to 2047 are accepted"):
        parse_link(tomllib.loads(line), "x.toml", CONFIGS)
