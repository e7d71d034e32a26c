"""Starts simulated joints for the command line: where cablecomp's wishes become firmware_sim's."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from cablecomp.config import read_toml
from cablecomp.control.options import MotorModel
from cablecomp.errors import DeviceError, InputError
from cablecomp.links.device_mit import reply_receiver
from cablecomp.links.schema import LinkConfig, MotorEnd, SerialBus
from cablecomp.links.schema_devices import (
    CanSimpleDevice,
    Cia402Device,
    CubeMarsDevice,
    Device,
    DynamixelDevice,
    MitDevice,
    MoteusDevice,
    RobStrideDevice,
)
from cablecomp.runtime.simulated import Simulation, SimulationWish
from firmware_sim.build import BenchConfig
from firmware_sim.errors import SimError
from firmware_sim.faults import parse_fault
from firmware_sim.firmware import DriveConfig, Gearbox
from firmware_sim.hosted import OFF_NOMINAL, HostedJoints, HostedSpec, off_nominal
from firmware_sim.joint import Timing
from firmware_sim.plant import LinkSpec, MotorSpec, PlantConfig
from firmware_sim.plant.errors import PlantError
from firmware_sim.wire.cia402 import Units


def start_simulation(joint: Path, wish: SimulationWish) -> Simulation:
    """Simulated joints of a configuration behind the wish's link; raises InputError for a bus that it
    cannot sit on.
    """
    data = read_toml(joint)
    motor = wish.control.motor
    torque = float(data.get("limits", {}).get("motor_torque_max_Nm", math.nan))
    torque = torque if torque == torque else 20.0 * motor.stiffness_Nm_per_rad * 0.01 + 1.0
    travel = _travel(data)
    bench = _bench(wish, torque, one_sided=data.get("drive", {}).get("circuit") == "open")
    try:
        spec = HostedSpec(
            data,
            _bus(wish.link),
            bench,
            _motor(motor, torque, bench.torque_constant * abs(bench.gearbox.turns)),
            LinkSpec(motor.output_inertia_kgm2, 0.0, 0.0, motor.output_viscous_Nms_per_rad),
            seed=wish.seed,
            off_nominal_seed=wish.seed if wish.off_nominal else None,
            travel_rad=travel,
            faults=tuple(parse_fault(text, wish.seed + k) for k, text in enumerate(wish.faults)),
        )
        return _Joints(spec)
    except (SimError, PlantError) as error:
        raise InputError(f"simulated joint: {error}") from None


def true_values(joint: Path, seed: int) -> dict[str, float]:
    """What a simulated joint off its nominal values is given, by parameter (first stage)."""
    data = read_toml(joint)
    stage = off_nominal(PlantConfig.from_dict(data, str(joint)), data.get("tolerance", {}), seed).stages[0]
    return {key: float(getattr(stage, key)) for key in OFF_NOMINAL}


class _Joints(HostedJoints):
    """Simulated joints whose own end (a drum run empty, no equilibrium) is a device's error to the run."""

    def advance(self, periods: int = 1) -> None:
        try:
            super().advance(periods)
        except (SimError, PlantError) as error:
            raise DeviceError(f"simulated joint: {error}") from None


def _motor(motor: MotorModel, torque: float, per_A: float) -> MotorSpec:
    """The motor as seen at the input pulley; `per_A`: torque there per ampere."""
    return MotorSpec(
        motor.inertia_kgm2,
        torque,
        motor.viscous_Nms_per_rad,
        motor.coulomb_Nm,
        torque_constant_Nm_per_A=per_A,
        current_bandwidth_Hz=motor.torque_bandwidth_Hz,
    )


def _bench(wish: SimulationWish, torque: float, *, one_sided: bool) -> BenchConfig:
    ends = wish.link.joint[0]
    if ends.motor is None:
        raise InputError(f"joint `{ends.name}` has no motor on this link; add [joint.motor]")
    made = _bench_of(wish.link.device_of(ends.motor), ends.motor)
    return replace(
        made,
        joints=wish.joints,
        drive=_drive(wish.control.motor, torque, ends.motor.gear_ratio, one_sided=one_sided),
        gearbox=Gearbox(ends.motor.sign * ends.motor.gear_ratio, ends.motor.position_offset_rad),
        timing=_timing(wish.link.rate_Hz),
    )


def _drive(motor: MotorModel, torque: float, gear: float, *, one_sided: bool) -> DriveConfig:
    """A drive that holds its motor as the model says; its own numbers are those at its shaft."""
    stiffness, damping = motor.stiffness_Nm_per_rad / gear**2, motor.damping_Nms_per_rad / gear**2
    made = DriveConfig(
        torque_limit_Nm=torque / gear,
        velocity_limit_rad_s=gear * DriveConfig.velocity_limit_rad_s,
        position_gain_per_s=stiffness / damping,
        velocity_gain_Nms_per_rad=damping,
    )
    if not one_sided:
        return made
    # the pretension pulls at the motor: it needs a brake before it is enabled, and afterwards
    return replace(made, fault_damping_Nms_per_rad=damping, brake_Nm_per_rad=stiffness)


def _timing(rate_Hz: float) -> Timing:
    """A sensor node that samples once a period of the link, on plant steps of 0.5 ms at most."""
    steps = math.ceil(1.0 / (rate_Hz * Timing.step_s) - 1e-9)
    return Timing(1.0 / (rate_Hz * steps), steps)


def _bench_of(device: Device, end: MotorEnd) -> BenchConfig:
    """The simulated drive that speaks what a device of the link speaks."""
    if isinstance(device, MitDevice):
        reply = reply_receiver(device, end, lambda data, now_s: 0).identifier
        return BenchConfig(protocol="mit", model=device.model or "AK80-9", reply_id=reply)
    if isinstance(device, CubeMarsDevice | RobStrideDevice):
        return BenchConfig(protocol=device.protocol, model=device.model or "AK80-9")
    if isinstance(device, MoteusDevice):
        gains = (device.kp_Nm_per_turn or 4.0, device.kd_Nms_per_turn or 0.05)
        return BenchConfig(protocol="moteus", gains_per_turn=gains)
    if isinstance(device, CanSimpleDevice):
        per_A = device.torque_constant_Nm_per_A or BenchConfig.torque_constant
        return BenchConfig(protocol="odrive", firmware=device.firmware, torque_constant=per_A)
    if isinstance(device, Cia402Device):
        turn = device.counts_per_turn
        second = device.joint_encoder_counts_per_turn or turn
        units = Units(turn, device.velocity_counts_per_turn_s or turn, second, device.rated_torque_Nm)
        return BenchConfig(protocol="cia402", units=units)
    if isinstance(device, DynamixelDevice):
        return BenchConfig(protocol="dynamixel", torque_constant=device.torque_constant_Nm_per_A)
    return BenchConfig(protocol="dbc")


def _bus(link: LinkConfig) -> str:
    bus = link.bus
    if isinstance(bus, SerialBus):
        packets = any(isinstance(device, DynamixelDevice) for device in link.device)
        return "dynamixel" if packets else "serial"
    if bus.interface == "slcan":
        return "slcan"
    if bus.interface == "virtual":
        return f"virtual:{bus.channel}"
    if bus.interface == "udp_multicast":
        port = bus.options.get("port")
        return f"udp_multicast:{bus.channel}" + (f":{port}" if port is not None else "")
    raise InputError(
        f"link `{link.name}` is on a {bus.interface} bus; virtual, udp_multicast, slcan and serial are accepted"
    )


def _travel(data: dict[str, object]) -> float:
    limits = data.get("limits")
    table = limits if isinstance(limits, dict) else {}
    ends = [table.get("motor_position_min_rad"), table.get("motor_position_max_rad")]
    known = [abs(float(v)) for v in ends if isinstance(v, int | float)]
    return max([*known, 1.0])
