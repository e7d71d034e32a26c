"""Configuration of the devices on a link: MIT drives, ODrives, and anything that a DBC table describes."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from cablecomp.config.base import Finite, Frozen, Positive, Text
from cablecomp.links.cansimple_firmware import FIRMWARES, Datum, FirmwareName
from cablecomp.links.mit_profiles import Family
from cablecomp.links.records import CHANNELS

Value = Finite | str


class MitScale(Frozen):
    """Full scale of a MIT drive that is not in the table, at the shaft that it reports."""

    position_rad: Positive
    velocity_rad_s: Positive
    torque_Nm: Positive
    kp_Nm_per_rad: Positive = 500.0
    kd_Nms_per_rad: Positive = 5.0


class MitDevice(Frozen):
    """A drive that speaks the MIT frame: a `model` of the table, or `range` and `family` of another one.

    `native` (Damiao): positions and velocities go to the drive's own loops, on identifiers 0x100 and 0x200
    above its number, with `velocity_limit_rad_s` at the drive's shaft.
    """

    protocol: Literal["mit"]
    id: Text
    model: str | None = None
    range: MitScale | None = None
    family: Family | None = None
    reply_length: Literal[6, 7, 8] | None = None
    native: bool = False
    velocity_limit_rad_s: Positive | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.model is None and (self.range is None or self.family is None):
            raise ValueError("`model`, or `range` and `family` are accepted")
        if self.native and self.velocity_limit_rad_s is None:
            raise ValueError("`native` needs `velocity_limit_rad_s`")
        return self


class CubeMarsDevice(Frozen):
    """A CubeMars AK drive on extended identifiers: `control` "servo", or "force" (V3 boards).

    `electrical_turns`: pole pairs times reduction; `torque_constant_Nm_per_A` at the output shaft; both are
    known of some models.
    """

    protocol: Literal["cubemars"]
    id: Text
    control: Literal["servo", "force"]
    model: str | None = None
    range: MitScale | None = None
    electrical_turns: Annotated[int, Field(gt=0)] | None = None
    torque_constant_Nm_per_A: Positive | None = None


class RobStrideDevice(Frozen):
    """A RobStride drive in its own protocol; `host`: the number that this side goes by."""

    protocol: Literal["robstride"]
    id: Text
    model: Text
    host: Annotated[int, Field(ge=0, le=0xFF)] = 0xFD


class MoteusDevice(Frozen):
    """A moteus; `host`: the number that this side goes by.

    `kp_Nm_per_turn`, `kd_Nms_per_turn`: gains as set in the drive (`servo.pid_position`), which commands take
    parts of. `joint_encoder`: the slot of the encoder at the joint, if the joint's sensor is this drive.
    """

    protocol: Literal["moteus"]
    id: Text
    host: Annotated[int, Field(ge=0, le=127)] = 0
    kp_Nm_per_turn: Positive | None = None
    kd_Nms_per_turn: Positive | None = None
    torque_limit_Nm: Positive | None = None
    joint_encoder: Annotated[int, Field(ge=0, le=2)] = 1


class Cia402Device(Frozen):
    """A CANopen drive of profile CiA 402; `host`: the node number whose heartbeat it watches.

    `counts_per_turn`: position units per turn of the shaft that it reports, `velocity_counts_per_turn_s` (if it is
    not the same) velocity units per turn/s; `rated_torque_Nm`: what its torques are thousandths of (0x6076).
    `feed_forward`: torque goes with position and velocity commands, as 0x60B2. `joint_encoder_counts_per_turn`: of
    the encoder at the joint on its second input (0x60E4:01), if the joint's sensor is this drive.
    """

    protocol: Literal["cia402"]
    id: Text
    host: Annotated[int, Field(ge=1, le=127)] = 127
    counts_per_turn: Positive
    velocity_counts_per_turn_s: Positive | None = None
    rated_torque_Nm: Positive
    feed_forward: bool = True
    heartbeat_s: Annotated[float, Field(ge=0.01, le=10.0)] = 0.1
    joint_encoder_counts_per_turn: Positive | None = None


class DynamixelDevice(Frozen):
    """A Dynamixel of the X series, protocol 2.0, on a serial line that carries nothing else.

    `current_unit_A`: current of one count, as in the model's control table; `torque_constant_Nm_per_A`: at the
    output shaft.
    """

    protocol: Literal["dynamixel"]
    id: Text
    torque_constant_Nm_per_A: Positive
    current_unit_A: Positive = 2.69e-3


class CanSimpleDevice(Frozen):
    """An ODrive: `cyclic` names what it sends by itself, `polled` what is asked for with every command
    (firmware 0.6: all).

    `joint_endpoint`: number of `spi_encoder0.raw` (or of another float in turns) in the `flat_endpoints.json` of the
    drive's very firmware (618 in 0.6.10): the encoder at the joint, if the joint's sensor is this drive. `heartbeat_s`:
    how often it tells its state, as set in it (`heartbeat_rate_ms`, `heartbeat_msg_rate_ms`).
    """

    protocol: Literal["cansimple"]
    id: Text
    firmware: FirmwareName = "0.6"
    cyclic: tuple[Datum, ...] = ("encoder",)
    polled: tuple[Datum, ...] = ()
    torque_constant_Nm_per_A: Positive | None = None
    velocity_limit_turns_s: Positive | None = None
    current_limit_A: Positive | None = None
    heartbeat_s: Annotated[float, Field(ge=0.01, le=10.0)] = 0.1
    joint_endpoint: Annotated[int, Field(ge=1, le=0xFFFF)] | None = None

    @model_validator(mode="after")
    def _known_to_firmware(self) -> Self:
        if self.joint_endpoint is not None and self.firmware != "0.6":
            raise ValueError(
                f"firmware {self.firmware} reads no endpoints over CAN; `joint_endpoint` needs 0.6"
            )
        known = FIRMWARES[self.firmware].data
        for datum in (*self.cyclic, *self.polled):
            if datum not in known:
                raise ValueError(
                    f"firmware {self.firmware} has no `{datum}`; {', '.join(known)} are accepted"
                )
        if (self.velocity_limit_turns_s is None) != (self.current_limit_A is None):
            raise ValueError(
                "`velocity_limit_turns_s` and `current_limit_A` go together: both or none are accepted"
            )
        return self


class ChannelSource(Frozen):
    """Where a channel comes from: signal, unit (the table's if absent), and `gain * x + offset` in SI after
    conversion.

    `absent`: the counts by which the device says "no value": a number, or "lowest" for the lowest of the
    signal.
    """

    signal: Text
    unit: str | None = None
    gain: Finite = 1.0
    offset: Finite = 0.0
    absent: int | Literal["lowest"] | None = None


class StateSource(Frozen):
    """A signal that tells the drive's state: the numbers, or words of the table, that mean each state."""

    signal: Text
    disabled: tuple[Value, ...] = ()
    calibrating: tuple[Value, ...] = ()
    enabled: tuple[Value, ...] = ()
    fault: tuple[Value, ...] = ()


class DbcMessage(Frozen):
    """One message that a device sends. `sequence` counts this very message; `device_time` is the device's
    clock.

    `stamps`: the device time belongs to the frame of that other message whose counter equals
    `stamps_sequence` here. `reply`: this message answers a command.
    """

    name: Text
    channels: dict[str, ChannelSource] = Field(default_factory=dict)
    sequence: str | None = None
    device_time: str | None = None
    stamps: str | None = None
    stamps_sequence: str | None = None
    state: StateSource | None = None
    error: str | None = None
    flags: str | None = None
    reply: bool = False

    @field_validator("channels", mode="before")
    @classmethod
    def _short_form(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return {k: {"signal": v} if isinstance(v, str) else v for k, v in value.items()}

    @model_validator(mode="after")
    def _canonical(self) -> Self:
        for channel in self.channels:
            if channel not in CHANNELS and not (channel.startswith("other_") and len(channel) > 6):
                raise ValueError(f"`{channel}` is no channel; accepted: {', '.join(CHANNELS)}, other_<name>")
        if (self.stamps is None) != (self.stamps_sequence is None):
            raise ValueError("`stamps` and `stamps_sequence` go together: both or none are accepted")
        return self


class DbcCommand(Frozen):
    """The message that commands motion: the signals that carry each part of a command, and constant ones."""

    message: Text
    position: str | None = None
    velocity: str | None = None
    torque: str | None = None
    stiffness: str | None = None
    damping: str | None = None
    constants: dict[str, Value] = Field(default_factory=dict)


class DbcRequest(Frozen):
    """The message for one request; a value is a number, the table's word, or one of `{mode}`, `{stiffness}`,
    `{damping}`."""

    message: Text
    values: dict[str, Value] = Field(default_factory=dict)


class DbcDevice(Frozen):
    """Any device that a DBC file describes; `dbc` is relative to the link file."""

    protocol: Literal["dbc"]
    id: Text
    dbc: Text
    message: tuple[DbcMessage, ...] = ()
    command: DbcCommand | None = None
    request: dict[
        Literal["enable", "disable", "stop", "calibrate", "clear_faults", "set_zero", "reset", "report"],
        DbcRequest,
    ] = Field(default_factory=dict)


Device = Annotated[
    MitDevice
    | CubeMarsDevice
    | RobStrideDevice
    | MoteusDevice
    | Cia402Device
    | DynamixelDevice
    | CanSimpleDevice
    | DbcDevice,
    Field(discriminator="protocol"),
]
