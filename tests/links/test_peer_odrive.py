"""ODrive CANSimple against ODrive's own message tables and a client and a device of others (odrive-can)."""

from __future__ import annotations

import asyncio
import contextlib
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

from cablecomp.links import BusLink, DriveState, MotorCommand, Request, load_link
from cablecomp.links.records import MOTOR_POSITION

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
