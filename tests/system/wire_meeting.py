"""A simulated bench and a link to it, stepped in turn, for the tests in which both ends of a wire meet."""

from __future__ import annotations

import os
import tomllib
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cablecomp.links import BusLink, DriveState, MotorCommand, Request, parse_link
from cablecomp.links.records import JOINT_POSITION, MOTOR_POSITION, MOTOR_TORQUE
from firmware_sim.bench import Bench
from firmware_sim.build import FD_PROTOCOLS, BenchConfig, make_bench
from firmware_sim.faults import parse_fault
from firmware_sim.firmware import DriveConfig
from firmware_sim.plantlike import Readings
from firmware_sim.ports import open_port

CONFIGS = Path(__file__).parents[2] / "configs" / "links"
PROTOCOLS = {
    "mit": ("mit-virtual.toml", {"protocol": "mit"}),
    "damiao": ("damiao-socketcan.toml", {"protocol": "mit", "model": "DM4310", "reply_id": 0x11}),
    "odrive": ("odrive-virtual.toml", {"protocol": "odrive"}),
    "odrive-0.5": ("odrive-v3-socketcan.toml", {"protocol": "odrive", "firmware": "0.5"}),
    "odrive-dual": ("odrive-dual-encoder.toml", {"protocol": "odrive"}),
    "robstride": ("robstride-socketcan.toml", {"protocol": "robstride", "model": "RS01"}),
    "cubemars-v3": ("cubemars-v3-socketcan.toml", {"protocol": "cubemars"}),
    "cubemars-servo": ("cubemars-servo-socketcan.toml", {"protocol": "cubemars"}),
    "moteus": ("moteus-socketcan.toml", {"protocol": "moteus", "gains_per_turn": (1000.0, 10.0)}),
    "moteus-dual": ("moteus-dual-encoder.toml", {"protocol": "moteus", "gains_per_turn": (1000.0, 10.0)}),
    "cia402": ("cia402-socketcan.toml", {"protocol": "cia402"}),
    "cia402-dual": ("cia402-dual-encoder.toml", {"protocol": "cia402"}),
    "dynamixel": ("dynamixel-serial.toml", {"protocol": "dynamixel", "torque_constant": 1.78}),
    "dbc": ("dbc-virtual.toml", {"protocol": "dbc"}),
}


class Spring:
    """A motor on a spring to a joint that carries a load; only what a wire test needs."""

    def __init__(self, number: int) -> None:
        self.time_s = 0.0
        self.motor = self.rate = 0.0
        self.load_Nm = 0.5 + 0.25 * number

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> Readings:
        """One semi-implicit Euler step of `J q'' = u + M - d q'`."""
        self.rate += dt_s * (motor_torque_command_Nm + self.load_Nm - 0.5 * self.rate) / 0.02
        self.motor += dt_s * self.rate
        self.time_s += dt_s
        joint = self.motor + self.load_Nm / 50.0
        return Readings(
            self.time_s,
            self.motor,
            self.rate,
            joint,
            self.rate,
            self.load_Nm,
            motor_torque_command_Nm,
            motor_torque_command_Nm / 0.1,
            30.0,
        )


def terminal_of(bench: Bench) -> Any:
    """The port behind the faults."""
    return getattr(bench.port, "port", bench.port)


class Meeting:
    """A simulated bench, stepped by commands, and a link to it."""

    def __init__(self, protocol: str, wire: str, joints: int = 1, faults: tuple[str, ...] = ()) -> None:
        name, options = PROTOCOLS[protocol]
        if joints > 1:
            name = "mit-virtual-8.toml"
        bus = {
            "virtual": f"virtual:{uuid.uuid4().hex}",
            "udp_multicast": f"udp_multicast:239.74.163.2:{20000 + os.getpid() % 20000}",
        }.get(wire, wire)
        config = BenchConfig(joints=joints, drive=DriveConfig(torque_limit_Nm=8.0), **options)
        port = open_port(bus, fd=config.protocol in FD_PROTOCOLS)
        self.bench: Bench = make_bench(config, Spring, port, [parse_fault(f, 3) for f in faults])
        where = self.bench.port.describe()
        reach = {k: v for k, v in where.items() if k in ("port", "hop_limit")}
        text = (CONFIGS / name).read_text(encoding="utf-8").replace("gear_ratio = 8.0", "gear_ratio = 1.0")
        base = parse_link(tomllib.loads(text), name, CONFIGS)
        self.link = BusLink(base.redirect(where["interface"], where["channel"], **reach))
        self.link.open()
        self.now_s = 0.0
        if wire == "slcan":
            self.until(lambda: terminal_of(self.bench).adapter.open)

    def until(self, reached: Callable[[], object]) -> None:
        """Let both ends work until something is reached; the kernel hands bytes over in its own time."""
        for _ in range(2000):
            self.bench.pump()
            self.link.poll(self.now_s)
            if reached():
                return
            self.bench.port.wait(0.001)
        raise AssertionError(f"not reached: {self.link.status()}")

    def climb(self) -> None:
        """As the loop does: ask until the drive tells where it is, then command until it is enabled."""
        joint, device, asked = self.link.joints[0], self.bench.joints[0], False
        self.bench.port.send(device.advance_sample(), self.bench.time_s)
        for _ in range(4000):
            self.now_s += 1e-3
            if not joint.updates[MOTOR_POSITION]:
                self.link.request(0, Request.REPORT)
            elif not asked:
                asked = self.link.request(0, Request.CLEAR_FAULTS) and self.link.request(0, Request.ENABLE)
            else:
                self.link.send(0, MotorCommand(joint.values[MOTOR_POSITION]))
            self.bench.pump()
            self.link.poll(self.now_s)
            if joint.state == DriveState.ENABLED:
                return
            self.bench.port.wait(1e-3)
        raise AssertionError(f"not enabled: {self.link.status()}")

    def cycle(self, command: MotorCommand) -> None:
        """One command to every joint, one step of each, and all that they tell."""
        self.now_s += 1e-3
        joints = self.link.joints
        places = (MOTOR_POSITION, MOTOR_TORQUE, JOINT_POSITION)
        before = [[j.updates[place] for place in places] for j in joints]
        steps = self.bench.steps
        for joint in range(len(joints)):
            self.link.send(joint, command)
        self.until(
            lambda: (
                self.bench.steps - steps == len(joints)
                and all(
                    j.updates[place] > b
                    for j, old in zip(joints, before, strict=True)
                    for place, b in zip(places, old, strict=True)
                )
            )
        )

    def close(self) -> None:
        self.link.close()
        self.bench.close()
