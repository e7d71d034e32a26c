"""From a joint's configuration file to a bench: plant, drives, sensor nodes, wires, port, faults."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from firmware_sim.bench import Bench, Stepping
from firmware_sim.errors import SimError
from firmware_sim.faults import DeviceFault, Fault, FaultyPort, LineFault, WireFault
from firmware_sim.firmware import DriveConfig, Gearbox, Mode, SensorNodeConfig
from firmware_sim.joint import SimulatedJoint, Timing
from firmware_sim.plantlike import PlantLike
from firmware_sim.ports.base import Port
from firmware_sim.wire.base import DriveWire
from firmware_sim.wire.cia402 import Cia402Wire, Units
from firmware_sim.wire.cubemars import CubeMarsWire
from firmware_sim.wire.damiao import DamiaoWire
from firmware_sim.wire.dbc import DbcWire, load_map
from firmware_sim.wire.dynamixel import DynamixelWire
from firmware_sim.wire.mit import MitWire, model_of
from firmware_sim.wire.moteus import MoteusWire
from firmware_sim.wire.odrive import FirmwareName, OdriveRates, OdriveWire
from firmware_sim.wire.robstride import RobStrideWire
from firmware_sim.wire.tables import MOST_JOINTS

PROTOCOLS = ("mit", "cubemars", "robstride", "moteus", "cia402", "dynamixel", "odrive", "dbc")
FD_PROTOCOLS = ("moteus",)
MakePlant = Callable[[int], PlantLike]


@dataclass(frozen=True)
class BenchConfig:
    """What a bench consists of, apart from its plants and its port; `gains_per_turn`: a moteus's own kp and kd
    (N m/turn, N m s/turn); `units`: of a CiA 402 drive; `drive`: at its own shaft, on the far side of `gearbox`."""

    protocol: str = "mit"
    joints: int = 1
    model: str = "AK80-9"
    reply_id: int = 0
    map_path: Path | None = None
    rates: OdriveRates = field(default_factory=OdriveRates)
    firmware: FirmwareName = "0.6"
    torque_constant: float = 0.1
    gains_per_turn: tuple[float, float] = (4.0, 0.05)
    units: Units = field(default_factory=Units)
    drive: DriveConfig = field(default_factory=DriveConfig)
    gearbox: Gearbox = field(default_factory=Gearbox)
    sensor: SensorNodeConfig = field(default_factory=SensorNodeConfig)
    timing: Timing = field(default_factory=Timing)
    stepping: Stepping = "command"

    def __post_init__(self) -> None:
        if self.protocol not in PROTOCOLS:
            raise SimError(f"protocol {self.protocol!r}; one of {', '.join(PROTOCOLS)} is accepted")
        if not 1 <= self.joints <= MOST_JOINTS:
            raise SimError(f"{self.joints} joints; 1 to {MOST_JOINTS} is accepted")


def make_wire(config: BenchConfig, number: int) -> DriveWire:
    """The drive wire of joint `number`."""
    if config.protocol == "mit":
        damiao = model_of(config.model).maker == "damiao"
        return (DamiaoWire if damiao else MitWire)(number, config.model, config.reply_id)
    if config.protocol == "cubemars":
        return CubeMarsWire(number, config.model)
    if config.protocol == "robstride":
        return RobStrideWire(number, config.model)
    if config.protocol == "moteus":
        return MoteusWire(number, *config.gains_per_turn)
    if config.protocol == "cia402":
        return Cia402Wire(number, config.units)
    if config.protocol == "dynamixel":
        return DynamixelWire(number, config.torque_constant)
    if config.protocol == "odrive":
        return OdriveWire(number, config.rates, config.torque_constant, config.firmware)
    mapped = None if config.map_path is None else load_map(config.map_path)
    return DbcWire(number, mapped, config.sensor.status_every)


def _drive_of(config: BenchConfig) -> DriveConfig:
    """The drive as its protocol knows it: ODrive, CiA 402 and Dynamixel start in position control and have no impedance
    mode; MIT drives but Damiao's and RobStride's report no error when the host falls silent."""
    if config.protocol == "odrive":
        return replace(config.drive, mode=Mode.POSITION)
    if config.protocol in ("cia402", "dynamixel"):  # they watch nobody until they are told to
        return replace(config.drive, mode=Mode.POSITION, command_timeout_s=0.0)
    silent = config.protocol == "cubemars" or (
        config.protocol == "mit" and model_of(config.model).maker in ("cubemars", "katz")
    )
    return replace(config.drive, timeout_faults=False) if silent else config.drive


def make_bench(config: BenchConfig, make_plant: MakePlant, port: Port, faults: Sequence[Fault] = ()) -> Bench:
    """A bench of `config.joints` joints; `make_plant(number)` builds the plant of each."""
    device = [f for f in faults if isinstance(f, DeviceFault)]
    on_the_way = [f for f in faults if isinstance(f, (WireFault, LineFault))]
    joints = [
        SimulatedJoint(
            make_plant(number),
            make_wire(config, number),
            number,
            _drive_of(config),
            replace(config.sensor, status_phase=number - 1),
            config.timing,
            device,
            config.gearbox,
        )
        for number in range(1, config.joints + 1)
    ]
    return Bench(FaultyPort(port, on_the_way) if on_the_way else port, joints, config.stepping)
