"""A linear two-mass joint for tests of the firmware: motor inertia, spring and damper, link inertia; ratio
1."""

from __future__ import annotations

from firmware_sim.plantlike import Readings


class TwoMass:
    """Semi-implicit Euler steps of J_m q_m'' = u - b_m q_m' - T, J_l q_l'' = T + M, T = k (q_m - q_l) + d
    (q_m' - q_l')."""

    def __init__(self, load_Nm: float = 0.0, start_rad: float = 0.0) -> None:
        self.time_s = 0.0
        self.motor = self.joint = start_rad
        self.motor_rate = self.joint_rate = 0.0
        self.load_Nm = load_Nm
        self.last_command_Nm = 0.0
        self.temperature_degC = 25.0

    def step(self, dt_s: float, motor_torque_command_Nm: float, /) -> Readings:
        """One step; the load is the external moment on the joint."""
        self.last_command_Nm = motor_torque_command_Nm
        spring = 40.0 * (self.motor - self.joint) + 0.02 * (self.motor_rate - self.joint_rate)
        self.motor_rate += dt_s * (motor_torque_command_Nm - 0.02 * self.motor_rate - spring) / 2e-3
        self.joint_rate += dt_s * (spring + self.load_Nm - 0.01 * self.joint_rate) / 2e-3
        self.motor += dt_s * self.motor_rate
        self.joint += dt_s * self.joint_rate
        self.time_s += dt_s
        return Readings(
            self.time_s,
            self.motor,
            self.motor_rate,
            self.joint,
            self.joint_rate,
            self.load_Nm,
            motor_torque_command_Nm,
            motor_torque_command_Nm / 0.1,
            self.temperature_degC,
        )


class ListPort:
    """A port for tests: frames put into `arriving` are heard, `sent` keeps (time, frame) of what was told."""

    def __init__(self) -> None:
        self.arriving: list[object] = []
        self.sent: list[tuple[float, object]] = []
        self.closed = False

    def poll(self, now_s):
        frames, self.arriving = self.arriving, []
        return frames

    def send(self, frames, now_s):
        self.sent += [(now_s, frame) for frame in frames]

    def wait(self, timeout_s):
        return None

    def describe(self):
        return {"interface": "list"}

    def close(self) -> None:
        self.closed = True

    def take(self) -> list[object]:
        """What was told since the last call."""
        frames = [frame for _, frame in self.sent]
        self.sent.clear()
        return frames
