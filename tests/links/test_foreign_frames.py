"""Whose frame it is: another device's frame is counted and never taken, however few share its identifier."""

from __future__ import annotations

import math
import socket
import time

import can
import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from link_rig import Rig, joint_state

from cablecomp.errors import DeviceError
from cablecomp.links.port_can import can_port
from cablecomp.links.records import EXTENDED, MOTOR_POSITION, DriveState

# Drive 2 at 25 degC with error 5, as another listener of the same bus recorded it.
OTHER_CUBEMARS = "02 00 00 7F F7 FF 19 05"
OWN_CUBEMARS = "01 80 00 7F F7 FF 24 00"
DAMIAO = {'model = "AK80-9"': 'model = "DM4310"', "reply_id = 0 ": "reply_id = 0x11 "}


def readings_of(joint) -> tuple:
    return (list(map(str, joint.values)), list(map(str, joint.arrived_s)), joint.updates[:], joint.state)


def test_one_joint_takes_no_other_drives_reply(rigs) -> None:
    rig = rigs("mit-virtual.toml")
    joint = rig.link.joints[0]
    rig.tell(0, OWN_CUBEMARS)
    assert rig.link.poll(1.0) == 4
    before = readings_of(joint), joint.error, joint.replies
    rig.tell(0, OTHER_CUBEMARS)
    assert rig.link.poll(2.0) == 0
    assert (readings_of(joint), joint.error, joint.replies) == before
    status = rig.link.status()
    assert (status.frames, status.foreign, status.invalid, status.ignored) == (2, 1, 0, 0)


@pytest.mark.parametrize("first", [0x02, 0x12, 0xD2, 0x1F])
def test_one_joint_takes_no_other_damiao_drives_reply(rigs, first: int) -> None:
    rig = rigs("mit-virtual.toml", DAMIAO)
    joint = rig.link.joints[0]
    before = readings_of(joint)
    rig.tell(0x11, bytes([first, 0, 0, 0x7F, 0xF7, 0xFF, 0x19, 0x05]))
    assert rig.link.poll(1.0) == 0
    assert readings_of(joint) == before
    assert rig.link.status().foreign == 1


def test_another_identifier_is_another_drive(rigs) -> None:
    rig = rigs("mit-virtual.toml", DAMIAO)
    rig.tell(0x12, bytes.fromhex("11 80 00 7F F7 FF 24 24"))
    rig.client.send(
        can.Message(arbitration_id=0x11, is_extended_id=True, data=bytes.fromhex("1180007FF7FF2424"))
    )
    rig.client.send(can.Message(arbitration_id=0x11, is_extended_id=False, is_remote_frame=True, dlc=8))
    assert rig.link.poll(1.0) == 0
    assert math.isnan(rig.link.joints[0].values[MOTOR_POSITION])
    assert rig.link.status().ignored == 3


@pytest.mark.parametrize("kind", [0x33, 0x55, 0xAA])
def test_a_damiao_register_reply_is_no_state(rigs, kind: int) -> None:
    # Damiao: read (33), write (55) and save (AA) are answered on the identifier of the states; register 10
    rig = rigs("mit-virtual.toml", DAMIAO)
    rig.tell(0x11, bytes([0x01, 0x00, kind, 0x0A, 0, 0, 0, 0]))
    assert rig.link.poll(1.0) == 0
    assert math.isnan(rig.link.joints[0].values[MOTOR_POSITION])
    assert rig.link.joints[0].state == DriveState.UNKNOWN


def test_eight_joints_count_the_ninth(rigs) -> None:
    rig = rigs("mit-virtual-8.toml")
    rig.tell(0, bytes([9, 9, 0, 0x7F, 0xF7, 0xFF, 29, 0]))
    rig.tell(0, b"")
    assert rig.link.poll(1.0) == 0
    assert rig.link.status().foreign == 2


@given(data=st.binary(max_size=8), identifier=st.sampled_from([0, 0x680]))
def test_any_frame_of_another_number_leaves_everything_as_it_was(rig, identifier: int, data: bytes) -> None:
    joint = rig.link.joints[0]
    if identifier == 0x680 or data[:1] == b"\x01":
        data = data[:7]  # of ours, but cut short
    before = readings_of(joint)
    rig.tell(identifier, data)
    assert rig.link.poll(1.0) == 0
    assert readings_of(joint) == before


@pytest.fixture(scope="module")
def rig():
    made = Rig("mit-virtual.toml")
    made.tell(0, OWN_CUBEMARS)
    made.tell(0x680, joint_state(1, 2, 3))
    made.link.poll(0.5)
    yield made
    made.close()


WELL_FORMED = {
    "timestamp": 0.0,
    "arbitration_id": 0x123,
    "is_extended_id": False,
    "is_remote_frame": False,
    "is_error_frame": False,
    "channel": None,
    "dlc": 2,
    "data": b"ab",
    "is_fd": False,
    "bitrate_switch": False,
    "error_state_indicator": False,
}
MALFORMED = [
    {"data": "ab"},
    {"data": [1, 2]},
    {"data": None},
    {"data": 7},
    {"data": b"123456789"},
    {"arbitration_id": 291.0},
    {"arbitration_id": "291"},
    {"arbitration_id": [1]},
    {"arbitration_id": -1},
    {"arbitration_id": 1 << 40},
    {"arbitration_id": 0x800},
    {"arbitration_id": True},
    {"arbitration_id": 0x40, "is_error_frame": True, "data": "ab"},
]


GROUP, PORT = "239.74.163.9", 43960


@pytest.fixture(scope="module")
def multicast():
    port = can_port("udp_multicast", GROUP, None, {"port": PORT, "hop_limit": 0})
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    try:
        port.open()
        sender.sendto(b"", (GROUP, PORT))
    except (DeviceError, OSError) as error:
        port.close()
        sender.close()
        pytest.skip(f"no multicast here: {error}")
    drained(port, 0)
    yield port, sender
    port.close()
    sender.close()


def drained(port, before: int) -> list:
    got: list = []
    end = time.monotonic() + 5.0
    while not got and port.counters.invalid == before and time.monotonic() < end:
        port.drain(lambda identifier, data: got.append((identifier, data)), 100)
    return got


def send(sender, payload: bytes) -> None:
    sender.sendto(payload, (GROUP, PORT))


def test_a_well_formed_datagram_is_taken(multicast) -> None:
    port, sender = multicast
    send(sender, msgpack.packb(WELL_FORMED))
    assert drained(port, port.counters.invalid) == [(0x123, b"ab")]
    send(sender, msgpack.packb({**WELL_FORMED, "arbitration_id": 0x800, "is_extended_id": True}))
    assert drained(port, port.counters.invalid) == [(0x800 | EXTENDED, b"ab")]


@pytest.mark.parametrize("change", MALFORMED, ids=lambda c: " ".join(f"{k}={v!r}" for k, v in c.items()))
def test_a_malformed_datagram_is_counted(multicast, change) -> None:
    port, sender = multicast
    before = port.counters.invalid
    send(sender, msgpack.packb({**WELL_FORMED, **change}))
    assert drained(port, before) == []
    assert port.counters.invalid == before + 1


@pytest.mark.parametrize(
    "payload", [b"", b"\xc1", b"\x80", b"\x93\x01\x02\x03", b"\x81\x80\x01", b"\xd6\xff"]
)
def test_noise_is_counted(multicast, payload: bytes) -> None:
    port, sender = multicast
    before = port.counters.invalid
    send(sender, payload)
    assert drained(port, before) == []
    assert port.counters.invalid == before + 1


def test_frames_that_the_system_dropped_are_told_also_after_the_end(multicast) -> None:
    _, sender = multicast
    port = can_port("udp_multicast", GROUP, None, {"port": PORT, "hop_limit": 0})
    port.open()
    payload = msgpack.packb(WELL_FORMED)
    while port.dropped() == 0:
        for _ in range(1000):
            send(sender, payload)
    dropped = port.dropped()
    port.close()
    assert port.dropped() >= dropped


def test_a_reply_of_seven_bytes_has_a_temperature_and_no_error(rigs) -> None:
    # CubeMars V1.1 boards: number, position, velocity, torque, degC
    rig = rigs("mit-virtual.toml", {'model = "AK80-9"': 'model = "AK80-9"\nreply_length = 7'})
    joint = rig.link.joints[0]
    rig.tell(0, "01 FF FF 7F F7 FF FB")
    assert rig.link.poll(1.0) == 4
    assert joint.values[MOTOR_POSITION] == pytest.approx(12.5)
    assert joint.values[joint.index("other_motor_temperature_degC")] == -5.0
    assert joint.error == 0
    rig.tell(0, OWN_CUBEMARS)
    assert rig.link.poll(2.0) == 0
    assert rig.link.status().invalid == 1


def test_a_robstride_in_the_mit_protocol_tells_tenths_of_a_degree_and_faults_apart(rigs) -> None:
    rig = rigs(
        "mit-virtual.toml", {'model = "AK80-9"': 'model = "RS01"', "reply_id = 0 ": "reply_id = 0xFD "}
    )
    joint = rig.link.joints[0]
    rig.tell(0xFD, "01 80 00 80 08 00 01 1C")
    assert rig.link.poll(1.0) == 4
    assert joint.values[joint.index("other_motor_temperature_degC")] == pytest.approx(28.4)
    rig.tell(0xFD, "01 01 00 00 00 00 00 00")
    assert rig.link.poll(2.0) == 0
    assert joint.state is DriveState.FAULT
    assert rig.link.error_text(0)
