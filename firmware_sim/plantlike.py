"""What the firmware needs of a plant: one step, one set of readings. SI units; NaN = no such sensor."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class Readings(NamedTuple):
    """Sensor readings at the end of one plant step.

    Motor and joint angle positive together; `joint_torque_Nm` is the external moment on the output pulley,
    positive
    along the joint angle; `motor_torque_Nm` is what the motor applies to the input pulley, positive along
    the motor angle.
    """

    time_s: float
    motor_position_rad: float
    motor_velocity_rad_s: float
    joint_position_rad: float
    joint_velocity_rad_s: float
    joint_torque_Nm: float
    motor_torque_Nm: float
    motor_current_A: float
    temperature_degC: float


class ReadingsLike(Protocol):
    """Anything that carries the fields of `Readings`."""

    @property
    def time_s(self) -> float: ...
    @property
    def motor_position_rad(self) -> float: ...
    @property
    def motor_velocity_rad_s(self) -> float: ...
    @property
    def joint_position_rad(self) -> float: ...
    @property
    def joint_velocity_rad_s(self) -> float: ...
    @property
    def joint_torque_Nm(self) -> float: ...
    @property
    def motor_torque_Nm(self) -> float: ...
    @property
    def motor_current_A(self) -> float: ...
    @property
    def temperature_degC(self) -> float: ...


class PlantLike(Protocol):
    """A plant: takes a torque command for `dt_s` seconds, gives the readings at the end of them."""

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> ReadingsLike: ...


def readings_of(source: ReadingsLike) -> Readings:
    """A plain copy of a plant's readings, whatever their class."""
    return Readings(*(float(getattr(source, name)) for name in Readings._fields))
