"""The protocols there are: for each kind of device, what it brings, claims, and how it is built."""

from __future__ import annotations

from collections.abc import Iterator

from cablecomp.errors import InputError
from cablecomp.links import device_cansimple, device_cubemars, device_dbc, device_mit, device_robstride
from cablecomp.links.device_cansimple import CanSimpleDrive
from cablecomp.links.device_cubemars import CubeMarsDrive
from cablecomp.links.device_damiao import DamiaoDrive
from cablecomp.links.device_dbc import DbcDrive, build_sources
from cablecomp.links.device_mit import MitDrive
from cablecomp.links.device_robstride import RobStrideDrive
from cablecomp.links.devices import Claim, Drive, Receiver
from cablecomp.links.readings import JointReadings
from cablecomp.links.schema import JointEnds, LinkConfig, MotorEnd, SensorEnd
from cablecomp.links.schema_devices import (
    CanSimpleDevice,
    CubeMarsDevice,
    DbcDevice,
    Device,
    MitDevice,
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
    if isinstance(device, CanSimpleDevice):
        return device_cansimple.extra_channels(device)
    return device_dbc.extra_channels(device)


def make_drive(config: LinkConfig, end: MotorEnd, joint: JointReadings) -> Drive:
    """The drive of a joint."""
    device = config.device_of(end)
    if isinstance(device, MitDevice):
        damiao = device_mit.family_of(device) == "damiao"
        return DamiaoDrive(device, end, joint) if damiao else MitDrive(device, end, joint)
    if isinstance(device, CubeMarsDevice):
        return CubeMarsDrive(device, end, joint)
    if isinstance(device, RobStrideDevice):
        return RobStrideDrive(device, end, joint)
    if isinstance(device, CanSimpleDevice):
        return CanSimpleDrive(device, end, joint)
    return DbcDrive(device, end, config.folder, joint)


def sensor_receivers(config: LinkConfig, ends: JointEnds, joint: JointReadings) -> tuple[Receiver, ...]:
    """Who takes the frames of a joint's sensor node; raises InputError for a device that is none."""
    if ends.sensor is None:
        return ()
    device = config.device_of(ends.sensor)
    if not isinstance(device, DbcDevice):
        raise InputError(
            f"joint `{ends.name}`: sensor device `{device.id}` speaks `{device.protocol}`; "
            "a `dbc` device is accepted"
        )
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
    if isinstance(end, SensorEnd):  # refused by `sensor_receivers`
        return ()
    if isinstance(device, MitDevice):
        return device_mit.claims(device, end)
    if isinstance(device, CubeMarsDevice):
        return device_cubemars.claims(end)
    if isinstance(device, RobStrideDevice):
        return device_robstride.claims(device, end)
    return device_cansimple.claims(end)
