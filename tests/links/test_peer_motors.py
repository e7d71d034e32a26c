"""Commands and replies of MIT, Damiao and RobStride drives against what clients of others send and read."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from link_rig import Rig

from cablecomp.links import DriveState, Mode, MotorCommand, Request
from cablecomp.links.mit_profiles import profile
from cablecomp.links.records import EXTENDED, MOTOR_POSITION, MOTOR_TORQUE, MOTOR_VELOCITY

HINT = "peer not installed: pip install 'cablecomp[peers]'"
COMMANDS = (
    MotorCommand(0.0, 0.0, 0.0, 0.0, 0.0),
    MotorCommand(-0.6, 1.5, -2.0, 100.0, 2.0),
    MotorCommand(3.1, -4.0, 5.0, 20.0, 0.5),
)
DAMIAO_MODELS = {"4310": "DM4310", "4310P": "DM4310P", "4340P": "DM4340P", "6006": "DM6006", "8009": "DM8009"}


class Listener:
    """In the place of a bus: keeps what a client sends."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bytes]] = []

    def send(self, message: Any, *_: Any, **__: Any) -> None:
        self.sent.append((message.arbitration_id, bytes(message.data)))


def fields(data: bytes, widths: tuple[int, ...]) -> list[int]:
    word, left, out = int.from_bytes(data, "big"), 64, []
    for width in widths:
        left -= width
        out.append(word >> left & ((1 << width) - 1))
    return out


def alike(ours: bytes, theirs: bytes, widths: tuple[int, ...]) -> bool:
    """Field by field alike but for one count: here the nearest one is sent, clients cut off (damiao-motor,
    RobStride's SDK), or count 2^n steps to the range instead of 2^n - 1 (TMotorCANControl)."""
    pairs = zip(fields(ours, widths), fields(theirs, widths), strict=True)
    return all(abs(a - b) <= 1 for a, b in pairs)


MIT_WIDTHS = (16, 12, 12, 12, 12)


@pytest.mark.parametrize("theirs", DAMIAO_MODELS)
def test_damiao_motor_sends_the_same(rigs: Any, theirs: str) -> None:
    core = pytest.importorskip("damiao_motor.core.motor", reason=HINT)
    model = DAMIAO_MODELS[theirs]
    rig: Rig = rigs("damiao-socketcan.toml", {'model = "DM4310"': f'model = "{model}"'})
    motor = core.DaMiaoMotor(1, 0x11, Listener(), motor_type=theirs)
    assert (motor._p_max, motor._v_max, motor._t_max) == profile(model).scale[:3]
    for c in COMMANDS:
        rig.link.send(0, c)
        (identifier, data), *rest = rig.heard()
        want = motor.encode_cmd_msg(
            c.position_rad, c.velocity_rad_s, c.torque_Nm, c.stiffness_Nm_per_rad, c.damping_Nms_per_rad
        )
        assert (identifier, rest) == (1, [])
        assert alike(data, want, MIT_WIDTHS)
    for request, bytes_of in (
        (Request.DISABLE, motor.encode_disable_msg),
        (Request.SET_ZERO, motor.encode_save_position_zero_msg),
        (Request.CLEAR_FAULTS, motor.encode_clear_error_msg),
    ):
        rig.link.request(0, request)
        assert (1, bytes_of()) in rig.heard()


def test_damiao_motor_reads_a_state_the_same_way(rigs: Any) -> None:
    core = pytest.importorskip("damiao_motor.core.motor", reason=HINT)
    rig: Rig = rigs("damiao-socketcan.toml")
    joint = rig.link.joints[0]
    motor = core.DaMiaoMotor(1, 0x11, Listener(), motor_type="4310")
    for text in ("11 80 00 7F F7 FF 24 25", "01 12 34 56 78 9A 1B 1C", "91 FE 00 00 1F 00 30 31"):
        data = bytes.fromhex(text)
        told = motor.decode_sensor_feedback(data)
        rig.tell(0x11, data)
        assert rig.link.poll(1.0) > 0
        values = [joint.values[place] for place in (MOTOR_POSITION, MOTOR_VELOCITY, MOTOR_TORQUE)]
        assert values == pytest.approx([told["pos"], told["vel"], told["torq"]])
        states = {0: DriveState.DISABLED, 1: DriveState.ENABLED}
        assert joint.state is states.get(told["status_code"], DriveState.FAULT)


def test_damiao_registers_are_asked_for_and_written_as_damiao_motor_does(rigs: Any) -> None:
    core = pytest.importorskip("damiao_motor.core.motor", reason=HINT)
    rig: Rig = rigs("damiao-socketcan.toml")
    rig.heard()
    bus = Listener()
    motor = core.DaMiaoMotor(1, 0x11, bus, motor_type="4310")
    for number in (21, 22, 23):
        motor.request_register_reading(number)
    motor.request_motor_feedback()
    rig.link.request(0, Request.REPORT)
    ours = rig.heard()
    assert [(i, d[:4]) for i, d in ours] == [(i, d[:4]) for i, d in bus.sent]
    bus.sent.clear()
    tell_ranges(rig)
    motor.write_register(10, 1)
    rig.link.request(0, Request.ENABLE)
    assert rig.heard() == [*bus.sent, (1, motor.encode_enable_msg())]


def tell_ranges(rig: Rig, *numbers: int) -> None:
    """A DM4310 as delivered tells its PMAX, VMAX and TMAX, or these registers alone."""
    for number, value in ((21, 12.5), (22, 30.0), (23, 10.0)):
        if not numbers or number in numbers:
            rig.tell(0x11, struct.pack("<HBBf", 1, 0x33, number, value))
    rig.link.poll(0.5)


@pytest.mark.parametrize("told", [(), (21, 22)])
def test_a_damiao_drive_that_does_not_tell_its_ranges_is_not_enabled(
    rigs: Any, told: tuple[int, ...]
) -> None:
    rig: Rig = rigs("damiao-socketcan.toml")
    joint, state = rig.link.joints[0], bytes.fromhex("01 80 00 7F F7 FF 24 25")
    if told:
        tell_ranges(rig, *told)
    rig.tell(0x11, state)
    rig.link.poll(1.0)
    assert joint.state is DriveState.DISABLED  # nothing is wrong before it is to be enabled
    rig.heard()
    for _ in range(2):
        rig.link.request(0, Request.ENABLE)
        heard = rig.heard()  # it is asked again, and not enabled
        assert [d[2:4].hex() for i, d in heard] == [f"33{n:02x}" for n in (21, 22, 23) if n not in told] + [
            "cc00"
        ]
        assert {i for i, _ in heard} == {0x7FF}
    rig.tell(0x11, state)
    rig.link.poll(2.0)
    assert joint.state is DriveState.FAULT
    assert ("the drive has not told its " + ("TMAX" if told else "PMAX, VMAX, TMAX")) in rig.link.error_text(
        0
    )
    tell_ranges(rig)
    rig.tell(0x11, state)
    rig.link.poll(3.0)
    assert (joint.state, rig.link.error_text(0)) == (DriveState.DISABLED, "")
    rig.link.request(0, Request.ENABLE)
    assert rig.heard()[-1] == (1, bytes.fromhex("FF FF FF FF FF FF FF FC"))


def test_a_damiao_drive_of_other_ranges_is_not_enabled(rigs: Any) -> None:
    rig: Rig = rigs("damiao-socketcan.toml")
    joint = rig.link.joints[0]
    state = bytes.fromhex("01 80 00 7F F7 FF 24 25")
    for number, value in ((21, 12.5), (22, 45.0), (23, 10.0)):  # VMAX was set by somebody else
        rig.tell(0x11, struct.pack("<HBBf", 1, 0x33, number, value))
    assert rig.link.poll(1.0) == 0
    rig.tell(0x11, state)
    rig.link.poll(2.0)
    assert joint.state is DriveState.FAULT
    assert "VMAX 45 (link: 30)" in rig.link.error_text(0)
    rig.heard()
    rig.link.request(0, Request.ENABLE)
    assert rig.heard() == []
    rig.tell(0x11, struct.pack("<HBBf", 1, 0x33, 22, 30.0))
    rig.tell(0x11, state)
    rig.link.poll(3.0)
    assert joint.state is DriveState.DISABLED
    rig.link.request(0, Request.ENABLE)
    assert rig.heard()[-1] == (1, bytes.fromhex("FF FF FF FF FF FF FF FC"))


def test_damiaos_own_loops_are_commanded_as_damiao_motor_does(rigs: Any) -> None:
    core = pytest.importorskip("damiao_motor.core.motor", reason=HINT)
    native = {'model = "DM4310"': 'model = "DM4310"\nnative = true\nvelocity_limit_rad_s = 5.0'}
    rig: Rig = rigs("damiao-socketcan.toml", native)
    bus = Listener()
    motor = core.DaMiaoMotor(1, 0x11, bus, motor_type="4310")
    tell_ranges(rig)
    for mode, number, send in (
        (Mode.POSITION, 2, lambda: motor.send_cmd_pos_vel(0.3, 5.0)),
        (Mode.VELOCITY, 3, lambda: motor.send_cmd_vel(1.25)),
    ):
        bus.sent.clear()
        motor.write_register(10, number)
        rig.link.request(0, Request.ENABLE, mode)
        assert rig.heard()[0] == bus.sent[0]
        bus.sent.clear()
        send()
        rig.link.send(0, MotorCommand(0.3, 1.25))
        assert rig.heard() == bus.sent


def test_tmotor_sends_and_reads_the_same(rigs: Any) -> None:
    module = pytest.importorskip("TMotorCANControl.mit_can", reason=HINT)
    rig: Rig = rigs("mit-virtual.toml")
    manager = object.__new__(module.CAN_Manager)
    module.CAN_Manager.__del__ = lambda self: None  # it would take the network interface down
    manager.bus, manager.debug = Listener(), False
    rig.link.request(0, Request.ENABLE)
    rig.heard()
    for c in COMMANDS:
        manager.bus.sent.clear()
        manager.MIT_controller(
            1, "AK80-9", c.position_rad, c.velocity_rad_s, c.stiffness_Nm_per_rad, c.damping_Nms_per_rad,
            c.torque_Nm,
        )  # fmt: skip
        rig.link.send(0, c)
        ((identifier, data),) = rig.heard()
        assert identifier == manager.bus.sent[0][0]
        assert alike(data, manager.bus.sent[0][1], MIT_WIDTHS)
    reply = bytes.fromhex("01 92 34 56 78 9A 24 00")
    told = manager.parse_MIT_message(reply, "AK80-9")
    rig.tell(0, reply)
    rig.link.poll(1.0)
    joint = rig.link.joints[0]
    values = [joint.values[place] for place in (MOTOR_POSITION, MOTOR_VELOCITY, MOTOR_TORQUE)]
    assert values == pytest.approx([told.position, told.velocity, told.current])


ROBSTRIDES = {
    "RS00": (33.0, 14.0, 500.0, 5.0),
    "RS01": (44.0, 17.0, 500.0, 5.0),
    "RS02": (44.0, 17.0, 500.0, 5.0),
    "RS03": (20.0, 60.0, 5000.0, 100.0),
    "RS04": (15.0, 120.0, 5000.0, 100.0),
    "RS05": (50.0, 5.5, 500.0, 5.0),
    "RS06": (50.0, 36.0, 5000.0, 100.0),
}
"""Velocity, torque, kp, kd as in the maker's user manuals, 4.1.2 and 6."""


@pytest.mark.parametrize("model", ROBSTRIDES)
def test_robstrides_are_read_in_the_ranges_of_their_manuals(rigs: Any, model: str) -> None:
    """Both protocols: all that the wire carries, at the end of each range."""
    velocity, torque, _, _ = ROBSTRIDES[model]
    own: Rig = rigs("robstride-socketcan.toml", {'model = "RS01"': f'model = "{model}"'})
    own.tell(EXTENDED | 0x028001FD, bytes.fromhex("80 00 FF FF FF FF 01 1C"))
    mit: Rig = rigs(
        "mit-virtual.toml", {'model = "AK80-9"': f'model = "{model}"', "reply_id = 0 ": "reply_id = 0xFD "}
    )
    mit.tell(0xFD, bytes.fromhex("01 80 00 FF FF FF 01 1C"))
    for rig in (own, mit):
        rig.link.poll(1.0)
        joint = rig.link.joints[0]
        gear = abs(rig.link.config.joint[0].motor.gear_ratio)
        assert abs(joint.values[MOTOR_VELOCITY]) * gear == pytest.approx(velocity)
        assert abs(joint.values[MOTOR_TORQUE]) / gear == pytest.approx(torque)


@pytest.mark.parametrize("model", ROBSTRIDES)
def test_robstrides_sdk_sends_and_reads_the_same(
    rigs: Any, model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for its ranges of four models, which are not those of the maker's manuals."""
    module = pytest.importorskip("robstride_dynamics.bus", reason=HINT)
    name = f"rs-{model[2:]}"
    for what, value in zip(("VELOCITY", "TORQUE", "KP", "KD"), ROBSTRIDES[model], strict=True):
        table = getattr(module, f"MODEL_MIT_{what}_TABLE")
        differs = what in ("VELOCITY", "TORQUE") and model in ("RS00", "RS03", "RS05", "RS06")
        assert differs or table[name] == value
        monkeypatch.setitem(table, name, value)
    rig: Rig = rigs("robstride-socketcan.toml", {'model = "RS01"': f'model = "{model}"\nhost = 0xFF'})
    client = module.RobstrideBus("none", {"elbow": module.Motor(1, name)})
    bus = Listener()
    client.channel_handler = bus
    for c in COMMANDS:
        bus.sent.clear()
        client.write_operation_frame(
            "elbow", c.position_rad, c.stiffness_Nm_per_rad, c.damping_Nms_per_rad, c.velocity_rad_s,
            c.torque_Nm,
        )  # fmt: skip
        rig.link.send(0, c)
        ((identifier, data),), ((want, theirs),) = rig.heard(), bus.sent
        want |= EXTENDED
        assert (identifier & 0xFF0000FF) == (want & 0xFF0000FF)
        # it cuts off where we round, and counts 65534 steps to the range, where there are 65535
        steps = 0.5 * (1.0 + c.torque_Nm / ROBSTRIDES[model][1])
        assert 0 <= (identifier >> 8 & 0xFFFF) - (want >> 8 & 0xFFFF) < 1.5 + steps
        assert alike(data, theirs, (16, 16, 16, 16))
    for request, send in ((Request.ENABLE, client.enable), (Request.DISABLE, client.disable)):
        bus.sent.clear()
        client.receive_status_frame = lambda motor: None
        send("elbow")
        rig.link.request(0, request)
        assert (bus.sent[0][0] | EXTENDED, bus.sent[0][1]) in rig.heard()
    client.channel_handler = None


def test_robstrides_own_example_of_a_temperature(rigs: Any) -> None:
    # the maker's manual: 28.4 degC is sent as 284, high byte first
    rig: Rig = rigs("robstride-socketcan.toml")
    joint = rig.link.joints[0]
    rig.tell(EXTENDED | 0x028001FD, bytes.fromhex("80 00 7F FF 7F FF 01 1C"))
    assert rig.link.poll(1.0) == 4
    assert joint.values[joint.index("other_motor_temperature_degC")] == pytest.approx(28.4)
    assert joint.state is DriveState.ENABLED
    rig.tell(EXTENDED | 0x020401FD, bytes.fromhex("80 00 7F FF 7F FF 01 1C"))
    rig.link.poll(2.0)
    assert (joint.state, rig.link.error_text(0)) == (DriveState.FAULT, "over temperature")


def test_robstride_status_for_another_host_or_from_another_drive_is_not_taken(rigs: Any) -> None:
    rig: Rig = rigs("robstride-socketcan.toml")
    for identifier in (0x028001FE, 0x028002FD, 0x038001FD):
        rig.tell(EXTENDED | identifier, bytes.fromhex("80 00 7F FF 7F FF 01 1C"))
    assert rig.link.poll(1.0) == 0
    assert rig.link.joints[0].replies == 0
