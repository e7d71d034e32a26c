"""What a link says that its messages can carry is what they carry: read back from the bytes by hand and by cantools."""

from __future__ import annotations

import struct
from math import pi

import cantools
import pytest
from link_rig import CONFIGS

from cablecomp.links import MotorCommand, Request
from cablecomp.signals import Grid, Wire

GEAR = {'mode = "impedance"': 'mode = "impedance"\nsign = -1\ngear_ratio = 6.0\nposition_offset_rad = 0.3'}


def mit(data: bytes) -> tuple[float, float, float]:
    """At the input pulley behind 6 : 1, turned round, 0.3 rad off."""
    n = int.from_bytes(data, "big")
    p, v, t = (
        (n >> 48) * 25 / 65535 - 12.5,
        (n >> 36 & 4095) * 100 / 4095 - 50,
        (n & 4095) * 36 / 4095 - 18,
    )
    return -p / 6.0 - 0.3, -v / 6.0, -t * 6.0


def dbc(data: bytes) -> tuple[float, float, float]:
    table = cantools.database.load_file(CONFIGS / "cablecomp_joint.dbc")
    values = table.get_message_by_name("Drive1_Command").decode(data)
    keys = ("motor_position_target_rad", "motor_velocity_target_rad_s", "motor_torque_target_Nm")
    return tuple(float(values[key]) for key in keys)


def odrive(data: bytes) -> tuple[float, float, float]:
    turns, velocity, torque = struct.unpack("<fhh", data)
    return 2 * pi * turns, 2 * pi * 1e-3 * velocity, 1e-3 * torque


def some(grid: Grid) -> list[float]:
    """Ends, middle and a few between."""
    if grid.step == 0.0:
        return [-7.1, 0.0, 0.333]
    last = round((grid.high - grid.low) / grid.step)
    return [grid.low + n * grid.step for n in (0, 1, last // 3, last // 2, last - 1, last)]


@pytest.mark.parametrize(
    ("name", "change", "read"),
    [
        ("mit-virtual.toml", GEAR, mit),
        ("dbc-virtual.toml", {}, dbc),
        ("odrive-virtual.toml", {}, odrive),
    ],
)
def test_a_value_on_the_grid_goes_out_as_it_is(rigs, name: str, change, read) -> None:
    rig = rigs(name, change)
    wire = rig.link.wire(0)
    assert isinstance(wire, Wire)
    for part, grid in enumerate(wire):
        for value in some(grid):
            at_rest = [g.origin + g.step * round((0.0 - g.origin) / g.step) if g.step else 0.0 for g in wire]
            at_rest[part] = value
            rig.heard()
            assert rig.link.send(0, MotorCommand(*at_rest)) == 0
            assert read(rig.heard()[0][1])[part] == pytest.approx(value, abs=1e-6 + 1e-3 * grid.step)
        if grid.step > 0.0:  # and there is nothing between or beyond
            between = list(at_rest)
            between[part] = grid.low + 7.5 * grid.step
            rig.link.send(0, MotorCommand(*between))
            off = read(rig.heard()[0][1])[part] - between[part]
            assert abs(off) == pytest.approx(0.5 * grid.step, rel=1e-3)
            between[part] = grid.high + 2.0 * grid.step
            assert rig.link.send(0, MotorCommand(*between)) != 0


def test_stiffness_is_eased_where_a_message_carries_it(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    sent = []
    for share in (0.0, 0.5, 1.0):
        assert rig.link.ease(0, share)
        rig.link.send(0, MotorCommand())
        sent.append(int.from_bytes(rig.heard()[0][1], "big"))
    assert [round((n >> 24 & 4095) * 500 / 4095) for n in sent] == [0, 100, 200]
    assert len({n >> 12 & 4095 for n in sent}) == 1


def test_gains_of_the_enable_request_are_eased_with_it_and_only_while_enabled(rigs) -> None:
    rig = rigs("dbc-virtual.toml")
    table = cantools.database.load_file(CONFIGS / "cablecomp_joint.dbc").get_message_by_name("Drive1_Control")
    assert rig.link.ease(0, 0.0)
    assert rig.heard() == []
    rig.link.request(0, Request.ENABLE)
    rig.link.ease(0, 0.5)
    rig.link.request(0, Request.STOP)
    rig.link.ease(0, 1.0)
    said = [table.decode(data) for _, data in rig.heard()]
    assert [str(s["request"]) for s in said] == ["enable", "enable", "disable"]
    full = rig.link.config.joint[0].motor.stiffness_Nm_per_rad
    assert [s["kp_Nm_per_rad"] for s in said[:2]] == [0.0, pytest.approx(0.5 * full, rel=1e-3)]
    assert not rigs("odrive-virtual.toml").link.ease(0, 0.5)


@pytest.mark.parametrize("name", ["mit-virtual.toml", "dbc-virtual.toml"])
def test_to_report_is_to_let_go_where_there_is_no_other_question(rigs, name: str) -> None:
    rig = rigs(name)
    rig.link.request(0, Request.REPORT)
    rig.link.request(0, Request.DISABLE)
    asked, let_go = rig.heard()
    assert asked == let_go
