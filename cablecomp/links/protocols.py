"""The protocols there are: for each kind of device, what it brings, claims, and how it is built."""

from __future__ import annotations

from collections.abc import Iterator

from cablecomp.errors import InputError
from cablecomp.links import (
    device_cansimple,
    device_cia402,
    device_cubemars,
    device_dbc,
    device_dynamixel,
    device_mit,
    device_moteus,
    device_robstride,
)
from cablecomp.links.device_cansimple import CanSimpleDrive
from cablecomp.links.device_cia402 import Cia402Drive
from cablecomp.links.device_cubemars import CubeMarsDrive
from cablecomp.links.device_damiao import DamiaoDrive
from cablecomp.links.device_dbc import DbcDrive, build_sources
from cablecomp.links.device_dynamixel import DynamixelDrive, Line
from cablecomp.links.device_mit import MitDrive
from cablecomp.links.device_moteus import MoteusDrive
from cablecomp.links.device_robstride import RobStrideDrive
from cablecomp.links.devices import Claim, Drive, Receiver
from cablecomp.links.readings import JointReadings
from cablecomp.links.rounds import Round
from cablecomp.links.schema import JointEnds, LinkConfig, MotorEnd, SensorEnd
from cablecomp.links.schema_devices import (
    CanSimpleDevice,
    Cia402Device,
    CubeMarsDevice,
    DbcDevice,
    Device,
    DynamixelDevice,
    MitDevice,
    MoteusDevice,
    RobStrideDevice,
)


def extra_channels(config: LinkConfig, ends: JointEnds) -> tuple[str, ...]:
    """Channels of a joint beside the common ones, in the order in which its devices bring them."""
    ways = [config.device_of(end) for end in (ends.motor, ends.sensor) if end is not None]
    return tuple(dict.fromkeys(channel for device in ways for channel in _extra(device)))


def _extra(device: Device) -> tuple[str, ...]:
    if isinstance(device, MitDevice):
        return device_mit.extra_channels(device)
    if isinstance(device, CubeMarsDevice):
        return (device_cubemars.TEMPERATURE,)
    if isinstance(device, RobStrideDevice):
        return (device_robstride.TEMPERATURE,)
    if isinstance(device, MoteusDevice):
        return device_moteus.EXTRAS
    if isinstance(device, CanSimpleDevice):
        return device_cansimple.extra_channels(device)
    if isinstance(device, Cia402Device):
        return ()
    if isinstance(device, DynamixelDevice):
        return (device_dynamixel.VOLTAGE,)
    return device_dbc.extra_channels(device)


def tells(config: LinkConfig, ends: JointEnds, channel: str) -> bool:
    """Whether some device of a joint measures this channel at the joint."""
    ways = [config.device_of(end) for end in (ends.motor, ends.sensor) if end is not None]
    if any(isinstance(d, DbcDevice) and any(channel in m.channels for m in d.message) for d in ways):
        return True
    return channel == "joint_position_rad" and second_encoder(config, ends) is not None


def second_encoder(config: LinkConfig, ends: JointEnds) -> SensorEnd | None:
    """The joint's sensor, if it is the encoder on the second input of its own drive; raises InputError where it
    would be another drive's."""
    end = ends.sensor
    if end is None or isinstance(config.device_of(end), DbcDevice):
        return None
    if ends.motor is None or (ends.motor.device, ends.motor.node) != (end.device, end.node):
        raise InputError(
            f"joint `{ends.name}`: sensor `{end.device}` {end.node} is a drive, and not this joint's own; a `dbc` "
            "device, or the joint's own drive with the joint's encoder on its second input, is accepted"
        )
    return end


class Shared:
    """What the drives of one link have in common."""

    def __init__(self) -> None:
        self.sync: Round[None] = Round()
        self.line = Line()


def make_drive(config: LinkConfig, ends: JointEnds, joint: JointReadings, shared: Shared) -> Drive | None:
    """The drive of a joint, None where it has none on this link; `shared` is all drives' of the link."""
    end = ends.motor
    if end is None:
        return None
    device, second = config.device_of(end), second_encoder(config, ends)
    if isinstance(device, MoteusDevice):
        return MoteusDrive(device, end, joint, second)
    if isinstance(device, Cia402Device):
        return Cia402Drive(device, end, joint, shared.sync, config.rate_Hz, second)
    if isinstance(device, CanSimpleDevice):
        return CanSimpleDrive(device, end, joint, second)
    if second is not None:
        raise InputError(
            f"joint `{ends.name}`: device `{device.id}` speaks `{device.protocol}`, which tells of no second "
            "encoder; a `dbc` device, a `moteus`, a `cia402` or a `cansimple` drive is accepted as the joint's sensor"
        )
    if isinstance(device, DynamixelDevice):
        return DynamixelDrive(device, end, joint, shared.line)
    if isinstance(device, MitDevice):
        damiao = device_mit.family_of(device) == "damiao"
        return DamiaoDrive(device, end, joint) if damiao else MitDrive(device, end, joint)
    if isinstance(device, CubeMarsDevice):
        return CubeMarsDrive(device, end, joint)
    if isinstance(device, RobStrideDevice):
        return RobStrideDrive(device, end, joint)
    return DbcDrive(device, end, config.folder, joint)


def sensor_receivers(config: LinkConfig, ends: JointEnds, joint: JointReadings) -> tuple[Receiver, ...]:
    """Who takes the frames of a joint's sensor node; nobody where the drive itself reads the joint's encoder."""
    device = None if ends.sensor is None else config.device_of(ends.sensor)
    if ends.sensor is None or not isinstance(device, DbcDevice):
        return ()
    return build_sources(device, ends.sensor, config.folder, joint)


def claims_of(config: LinkConfig) -> Iterator[tuple[str, Claim]]:
    """Every identifier that a link's devices use, with the device's name in words."""
    if config.bus.sync_id is not None:
        yield "the bus", Claim(config.bus.sync_id, "step counter, bus.sync_id")
    for ends in config.joint:
        for end in (ends.motor, ends.sensor):
            if end is not None:
                owner = f"`{end.device}` {end.node} of joint `{ends.name}`"
                for claim in _claims(config, end):
                    yield owner, claim


def _claims(config: LinkConfig, end: MotorEnd | SensorEnd) -> tuple[Claim, ...]:
    device = config.device_of(end)
    if isinstance(device, DbcDevice):
        return device_dbc.claims(device, end, config.folder)
    if isinstance(end, SensorEnd):  # the drive's second encoder: on the drive's own identifiers
        return ()
    if isinstance(device, MitDevice):
        return device_mit.claims(device, end)
    if isinstance(device, CubeMarsDevice):
        return device_cubemars.claims(end)
    if isinstance(device, RobStrideDevice):
        return device_robstride.claims(device, end)
    if isinstance(device, MoteusDevice):
        return device_moteus.claims(device, end)
    if isinstance(device, Cia402Device):
        return device_cia402.claims(device, end)
    if isinstance(device, DynamixelDevice):
        return device_dynamixel.claims(device, end)
    return device_cansimple.claims(end)
