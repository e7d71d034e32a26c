"""Link configuration: `configs/links/*.toml` to frozen objects; an unknown key fails with one line.

A link file names the bus, the devices on it (each once, with `{node}` in the names of its messages where
several are alike), and the joints: which device with which node number moves each of them, and which one
measures at the joint.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from cablecomp.config.base import Finite, Frozen, NonNegative, Positive, Text
from cablecomp.links.schema_devices import Device

Sign = Literal[1, -1]
ModeName = Literal["torque", "velocity", "position", "impedance"]


class CanBus(Frozen):
    """A CAN bus through python-can: `interface`, `channel`, `bitrate`, `options` go to `can.Bus`, and for CAN FD
    `fd` and `data_bitrate`."""

    kind: Literal["can"]
    interface: Text
    channel: str | int | None = None
    bitrate: Annotated[int, Field(gt=0)] | None = None
    fd: bool = False
    data_bitrate: Annotated[int, Field(gt=0)] | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    max_frames_per_poll: Annotated[int, Field(ge=1, le=100_000)] = 2048
    sync_id: Annotated[int, Field(ge=0, le=0x7FF)] | None = None

    @model_validator(mode="after")
    def _both_rates(self) -> Self:
        if self.data_bitrate is not None and not (self.fd and self.bitrate):
            raise ValueError("`data_bitrate` goes with `fd = true` and `bitrate`; both are accepted with it")
        return self


class SerialBus(Frozen):
    """A serial port that carries COBS records; `port` is whatever pyserial opens (device, `socket://`,
    `loop://`)."""

    kind: Literal["serial"]
    port: Text
    baud: Annotated[int, Field(gt=0)] = 921_600
    max_frames_per_poll: Annotated[int, Field(ge=1, le=100_000)] = 2048
    sync_id: Annotated[int, Field(ge=0, le=0x7FF)] | None = None


class Timeouts(Frozen):
    """What happens as the oldest needed value ages, in s since it came: fresh and held until `hold_s`,
    feed-forward faded out linearly from there to `fade_s`, safe stop at `stop_s`."""

    hold_s: Positive = 0.01
    fade_s: Positive = 0.1
    stop_s: Positive = 0.2

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.hold_s < self.fade_s <= self.stop_s:
            raise ValueError("hold_s < fade_s <= stop_s is accepted")
        return self


class MotorEnd(Frozen):
    """The drive of a joint. `gear_ratio`: turns of the shaft that the drive reports per turn of the input
    pulley.

    `q_in = sign * q_drive / gear_ratio - position_offset_rad`, `torque = sign * gear_ratio * torque_drive`.
    `command_timeout_s`: after how long without commands the drive stops by itself, as it is set in the drive
    (0 = it does not; absent = not known).
    """

    device: Text
    node: Annotated[int, Field(ge=0, le=0x1FFF_FFFF)]
    reply_id: Annotated[int, Field(ge=0, le=0x7FF)] | None = None
    sign: Sign = 1
    gear_ratio: Positive = 1.0
    position_offset_rad: Finite = 0.0
    mode: ModeName = "position"
    stiffness_Nm_per_rad: NonNegative = 0.0
    damping_Nms_per_rad: NonNegative = 0.0
    command_timeout_s: NonNegative | None = None


class SensorEnd(Frozen):
    """The sensor node at the joint: `q_out = position_sign * q - position_offset_rad`, `M = torque_sign * m -
    torque_offset_Nm`."""

    device: Text
    node: Annotated[int, Field(ge=0, le=0x1FFF_FFFF)] = 0
    position_sign: Sign = 1
    position_offset_rad: Finite = 0.0
    torque_sign: Sign = 1
    torque_offset_Nm: Finite = 0.0


class JointEnds(Frozen):
    """One joint on the bus."""

    name: Text
    motor: MotorEnd | None = None
    sensor: SensorEnd | None = None

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.motor is None and self.sensor is None:
            raise ValueError("`motor`, `sensor` or both are accepted")
        return self


class LinkConfig(Frozen):
    """A link as its TOML file states it; `folder` is where relative paths start."""

    schema_: Literal[1] = Field(alias="schema")
    name: Text
    rate_Hz: Annotated[float, Field(ge=1, le=20_000, allow_inf_nan=False)] = 1000.0
    bus: Annotated[CanBus | SerialBus, Field(discriminator="kind")]
    timeouts: Timeouts = Timeouts()
    device: tuple[Device, ...] = Field(min_length=1)
    joint: tuple[JointEnds, ...] = Field(min_length=1)
    folder: Path = Path()

    @model_validator(mode="after")
    def _references(self) -> Self:
        if self.timeouts.hold_s < 1.0 / self.rate_Hz:
            raise ValueError(
                f"timeouts.hold_s is {self.timeouts.hold_s:g} s, so that nothing that comes once in a period of "
                f"rate_Hz = {self.rate_Hz:g} stays fresh; {1.0 / self.rate_Hz:g} s or more are accepted"
            )
        ids = [d.id for d in self.device]
        _distinct("device.id", ids)
        _distinct("joint.name", [j.name for j in self.joint])
        for joint in self.joint:
            for end in (joint.motor, joint.sensor):
                if end is not None and end.device not in ids:
                    raise ValueError(
                        f"joint `{joint.name}` names device `{end.device}`; accepted: {', '.join(ids)}"
                    )
        return self

    def redirect(self, interface: str, channel: str, **options: Any) -> LinkConfig:
        """The same link on another bus of the same kind of traffic: "serial" makes `channel` the port, any
        other interface a CAN bus with these options; step identifier and frame limit stay."""
        shared: dict[str, Any] = {
            "max_frames_per_poll": self.bus.max_frames_per_poll,
            "sync_id": self.bus.sync_id,
        }
        bus: CanBus | SerialBus
        if interface == "serial":
            bus = SerialBus(kind="serial", port=channel, **shared)
        else:
            if interface == "slcan":
                options = {"sleep_after_open": 0, **options}
            fd = isinstance(self.bus, CanBus) and self.bus.fd
            bus = CanBus(kind="can", interface=interface, channel=channel, options=options, fd=fd, **shared)
        return self.model_copy(update={"bus": bus})

    def at_terminal(self, path: str) -> LinkConfig:
        """The same slcan or serial link on another terminal, such as a simulated adapter's."""
        return self.redirect("serial" if isinstance(self.bus, SerialBus) else "slcan", path)

    def device_of(self, end: MotorEnd | SensorEnd) -> Device:
        """The device that an end names."""
        return next(d for d in self.device if d.id == end.device)


def _distinct(what: str, names: list[str]) -> None:
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise ValueError(f"{what} `{twice}` is there twice; distinct names are accepted")
