"""The protocols there are: for each kind of device, what it brings, claims, and how it is built."""

from __future__ import annotations

from collections.abc import Iterator

from cablecomp.errors import InputError
from cablecomp.links import device_cansimple, device_dbc, device_mit
from cablecomp.links.device_cansimple import CanSimpleDrive
from cablecomp.links.device_dbc import DbcDrive, build_sources
from cablecomp.links.device_mit import MitDrive
from cablecomp.links.devices import Claim, Drive, Receiver
from cablecomp.links.readings import JointReadings
from cablecomp.links.schema import JointEnds, LinkConfig, MotorEnd, SensorEnd
from cablecomp.links.schema_devices import CanSimpleDevice, DbcDevice, MitDevice


def extra_channels(config: LinkConfig, ends: JointEnds) -> tuple[str, ...]:
    """Channels of a joint beside the common ones, in the order in which its devices bring them."""
    names: list[str] = []
    for end in (ends.motor, ends.sensor):
        if end is None:
            continue
        device = config.device_of(end)
        if isinstance(device, MitDevice):
            names += device_mit.extra_channels(device)
        elif isinstance(device, CanSimpleDevice):
            names += device_cansimple.extra_channels(device)
        else:
            names += device_dbc.extra_channels(device)
    return tuple(dict.fromkeys(names))


def make_drive(config: LinkConfig, end: MotorEnd, joint: JointReadings) -> Drive:
    """The drive of a joint."""
    device = config.device_of(end)
    if isinstance(device, MitDevice):
        return MitDrive(device, end, joint)
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
    return device_cansimple.claims(end)
