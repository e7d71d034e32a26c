"""CiA 402 over CANopen: objects, answers and statuswords as the profile lays them out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablecomp.links import DriveState, canopen, cia402
from cablecomp.links.cia402 import Power


# Published examples of drives' manuals: controlword 6, 7, F by SDO, modes 8 to A, and their answers
@pytest.mark.parametrize(
    ("entry", "value", "data"),
    [
        (cia402.CONTROLWORD, 0x06, "2b40600006000000"),
        (cia402.CONTROLWORD, 0x0F, "2b4060000f000000"),
        (cia402.MODE, 8, "2f60600008000000"),
        (cia402.TARGET_VELOCITY, -1, "23ff6000ffffffff"),
    ],
)
def test_expedited_writes(entry: canopen.Object, value: int, data: str) -> None:
    frame = canopen.sdo(1, canopen.Step(entry, value))
    assert (frame.identifier, frame.data.hex()) == (0x601, data)


def test_answers() -> None:
    assert canopen.parse_sdo(bytes.fromhex("6040600000000000")) == (0x6040, 0, 0, 0)
    assert canopen.parse_sdo(bytes.fromhex("4b41600037120000")) == (0x6041, 0, 0x1237, 0)
    assert canopen.parse_sdo(bytes.fromhex("8000180100000206")) == (0x1800, 1, 0, 0x0602_0000)
    assert canopen.parse_sdo(b"\x60") is None


@pytest.mark.parametrize(
    ("word", "power"),
    [  # x: any, as CiA 402-2 tables them; bit 5 (quick stop) and the upper byte vary
        (0x0000, Power.NOT_READY),
        (0x0240, Power.SWITCH_ON_DISABLED),
        (0x1270, Power.SWITCH_ON_DISABLED),
        (0x0231, Power.READY),
        (0x0233, Power.SWITCHED_ON),
        (0x1237, Power.ENABLED),
        (0x0217, Power.QUICK_STOP),
        (0x021F, Power.FAULT_REACTION),
        (0x0218, Power.FAULT),
        (0x0238, Power.FAULT),
    ],
)
def test_statuswords(word: int, power: Power) -> None:
    assert cia402.power_of(word) is power


@given(st.integers(0, 0xFFFF))
def test_no_statusword_is_taken_for_more_than_it_says(word: int) -> None:
    power = cia402.power_of(word)
    assert (power is Power.ENABLED) == (word & 0x6F == 0x27)
    assert (cia402.state_of(power) is DriveState.FAULT) == (word & 0x4F in (0x08, 0x0F))
