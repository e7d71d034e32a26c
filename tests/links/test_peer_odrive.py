"""ODrive CANSimple against ODrive's own message tables and a client and a device of others (odrive-can)."""

from __future__ import annotations

import asyncio
import contextlib
import math
import struct
import threading
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import cantools
import pytest
from link_rig import Rig

from cablecomp.errors import InputError
from cablecomp.links import BusLink, DriveState, MotorCommand, Request, load_link
from cablecomp.links.records import JOINT_POSITION, MOTOR_POSITION

odrive_can = pytest.importorskip("odrive_can", reason="peer not installed: pip install 'cablecomp[peers]'")
mock = pytest.importorskip("odrive_can.mock", reason="peer not installed: pip install 'cablecomp[peers]'")

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
TABLES = {"0.5": "odrive-cansimple-0.5.6", "0.6": "odrive-cansimple-0.6.10"}


def table_of(firmware: str) -> Any:
    path = Path(odrive_can.__file__).parent / "dbc" / f"{TABLES[firmware]}.dbc"
    return cantools.database.load_file(path)


@pytest.mark.parametrize("firmware", TABLES)
def test_every_frame_sent_is_one_of_odrives_table(rigs: Any, firmware: str) -> None:
    change = {'firmware = "0.6"': f'firmware = "{firmware}"'}
    change['cyclic = ["encoder", "torques", "temperature"]'] = (
        'cyclic = ["encoder"]\nvelocity_limit_turns_s = 20.0\ncurrent_limit_A = 10.0'
    )
    rig: Rig = rigs("odrive-virtual.toml", change)
    link, table = rig.link, table_of(firmware)
    for mode in ("torque", "velocity", "position"):
        assert link.request(0, Request.ENABLE, mode)
        link.send(0, MotorCommand(0.5, 0.25, 0.125))
    for request in Request:
        if request not in (Request.ENABLE, Request.REPORT):
            assert link.request(0, request), request
    heard = rig.heard()
    named = {}
    for identifier, data in heard:
        if (firmware, identifier) == (
            "0.5",
            0x22,
        ):  # the table leaves it out, the published firmware does not
            assert data == b""
            continue
        message = table.get_message_by_frame_id(identifier)
        assert len(data) == message.length, message.name
        named[message.name.removeprefix("Axis1_")] = message.decode(data) if data else {}
    assert named["Set_Input_Torque"] == {"Input_Torque": 0.125}
    assert named["Set_Input_Pos"]["Torque_FF"] == pytest.approx(0.125)
    assert named["Set_Limits"] == {"Velocity_Limit": 20.0, "Current_Limit": 10.0}
    zero = {"0.5": "Set_Linear_Count", "0.6": "Set_Absolute_Position"}[firmware]
    assert named[zero] == {"Position": 0}
    assert {"Clear_Errors", "Reboot"} <= set(named)


DUAL = "odrive-dual-encoder.toml"


def test_the_joints_encoder_is_asked_for_and_read_by_odrives_table(rigs: Any) -> None:
    turned = {"position_offset_rad = 0.0": "position_offset_rad = 0.1\nposition_sign = -1"}
    rig: Rig = rigs(DUAL, turned)
    link, joint, table = rig.link, rig.link.joints[0], table_of("0.6")
    question = table.get_message_by_name("Axis1_RxSdo")
    for ask in (lambda: link.send(0, MotorCommand(0.5)), lambda: link.request(0, Request.REPORT)):
        ask()
        asked = [question.decode(data) for identifier, data in rig.heard() if identifier == question.frame_id]
        assert asked == [{"Opcode": "READ", "Endpoint_ID": 618, "Reserved": 0, "Value": 0}]

    def tell(endpoint: int, turns: float) -> int:
        (bits,) = struct.unpack("<I", struct.pack("<f", turns))
        told = {"Reserved0": 0, "Endpoint_ID": endpoint, "Reserved1": 0, "Value": bits}
        answer = table.get_message_by_name("Axis1_TxSdo")
        rig.tell(answer.frame_id, answer.encode(told))
        return link.poll(1.0)

    for turns, where in ((0.125, 0.125), (0.875, -0.125), (0.4375, 0.4375)):
        assert tell(618, turns) == 1
        assert joint.values[JOINT_POSITION] == pytest.approx(-where * math.tau - 0.1, abs=1e-6)
    for endpoint, turns in ((182, 0.25), (618, math.nan), (618, math.inf)):
        assert tell(endpoint, turns) == 0
    rig.tell(0x25, b"\0" * 4)
    assert link.poll(2.0) == 0
    assert joint.updates[JOINT_POSITION] == 3
    assert link.status().invalid == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joint_endpoint = 618": ""}, "add its joint_endpoint"),
        (
            {'firmware = "0.6"': 'firmware = "0.5"', ', "torques", "temperature"': ""},
            "joint_endpoint` needs 0.6",
        ),
    ],
)
def test_an_encoder_that_cannot_be_asked_for_is_refused(rigs: Any, change: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        rigs(DUAL, change)


@pytest.fixture
def device() -> Iterator[Any]:
    """The peer's device on a bus of its own, in a thread of its own."""
    channel = uuid.uuid4().hex
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    made = mock.ODriveCANMock(axis_id=1, can_bus=bus)
    loop = asyncio.new_event_loop()
    made.can_reader = can.AsyncBufferedReader()
    main: list[Any] = []

    def run() -> None:
        asyncio.set_event_loop(loop)
        main.append(loop.create_task(made.main()))
        with contextlib.suppress(asyncio.CancelledError):
            loop.run_until_complete(main[0])

    made.notifier.stop()
    made.notifier = can.Notifier(bus, [made.can_reader], loop=loop)
    thread = threading.Thread(target=run)
    thread.start()
    yield channel
    loop.call_soon_threadsafe(lambda: main[0].cancel())
    thread.join(5.0)
    made.notifier.stop()
    bus.shutdown()
    loop.close()


def until(reached: Any, poll: Any, seconds: float = 5.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        poll()
        if reached():
            return True
        time.sleep(0.002)
    return False


def test_a_device_of_others_that_reads_by_the_table_obeys(device: str) -> None:
    link = BusLink(load_link(CONFIGS / "odrive-virtual.toml").redirect("virtual", device))
    link.open()
    try:
        joint = link.joints[0]
        link.request(0, Request.ENABLE)
        assert until(lambda: joint.state is DriveState.ENABLED, lambda: link.poll(time.monotonic()))

        def towards() -> None:
            link.send(0, MotorCommand(position_rad=3.0))
            link.poll(time.monotonic())

        assert until(lambda: abs(joint.values[MOTOR_POSITION] - 3.0) < 0.1, towards)
        assert link.status().invalid == 0
    finally:
        link.close()
