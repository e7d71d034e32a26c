"""Messages of our own: sensor nodes, drives that a table alone describes, and the step counter.

Identifiers (11-bit) of joint N:

| identifier      | message              | from  | what it carries                                               |
|-----------------|----------------------|-------|---------------------------------------------------------------|
| 0x680 + 2 (N-1) | JointN_State, N ≤ 32 | joint | angle (int32 1e-6 rad), torque (int24 1e-5 Nm), sequence      |
| 0x681 + 2 (N-1) | JointN_Status        | joint | time (uint32 us), temp. (int16 0.01 degC), flags, sequence    |
| 0x6C0 + 4 (N-1) | DriveN_Command, N ≤ 8 | host | targets: motor position, velocity, torque                     |
| 0x6C1 + 4 (N-1) | DriveN_Control       | host  | state request, control mode, kp, kd, torque limit             |
| 0x6C2 + 4 (N-1) | DriveN_State         | drive | motor position, velocity, torque, sequence                    |
| 0x6C3 + 4 (N-1) | DriveN_Status        | drive | state, mode, flags, current, temperature, sequence            |
| 0x700           | Sync                 | host  | step number; stepped by sync, every joint takes one step      |

0x680 to 0x6DF is what CANopen leaves free beside its restricted identifiers and its predefined connection set
(CiA 301, tables of both), and no MIT drive uses; CANSimple, which spends all identifiers on its 64 nodes, has
nodes 52 to 54 there, and 56 at Sync. Intel byte order. JointN_Status goes out with every tenth sample and at
once when its flags change; its sequence is that of the JointN_State sent just before, so that sample's device
time is known to the microsecond.
"""

from __future__ import annotations

from firmware_sim.wire.dbc_text import Message, Signal

JOINTS = 8
MOST_JOINTS = 32
SENSOR_BASE, SENSOR_STRIDE = 0x680, 2
DRIVE_BASE, DRIVE_STRIDE = 0x6C0, 4
SYNC_ID = 0x700

DRIVE_STATES = ((0, "disabled"), (1, "calibrating"), (2, "enabled"), (3, "fault"))
REQUESTS = (
    (0, "disable"),
    (1, "calibrate"),
    (2, "enable"),
    (3, "clear_faults"),
    (4, "set_zero"),
    (5, "reset"),
)
MODES = ((0, "torque"), (1, "velocity"), (2, "position"), (3, "impedance"))
SENSOR_FLAGS = (
    "bit 0 joint encoder lost, 1 joint encoder jumped, 2 torque sensor saturated, 3 over temperature, "
    "4 started afresh; the others are 0"
)
DRIVE_FLAGS = (
    "bit 0 command timeout, 1 over torque, 2 over velocity, 3 position limit, 4 motor encoder, "
    "5 index not found, 6 over temperature, 7 emergency stop, 8 bad frame, "
    "9 started afresh, 10 not calibrated, 11 asked for a mode that it does not have"
)


def sensor_messages(joint: int) -> tuple[Message, ...]:
    """Messages of the joint-side sensor node of joint 1…8."""
    base, node = SENSOR_BASE + SENSOR_STRIDE * (joint - 1), f"SensorNode{joint}"
    state = (
        Signal(
            "joint_position_rad",
            0,
            32,
            1e-6,
            "rad",
            True,
            "joint (output pulley) angle; lowest raw value = no value",
        ),
        Signal(
            "joint_torque_Nm",
            32,
            24,
            1e-5,
            "Nm",
            True,
            "external moment on the output pulley; lowest raw value = no value",
        ),
        Signal("sequence", 56, 8, comment="one more with every sample, wraps at 256"),
    )
    status = (
        Signal(
            "device_time_us",
            0,
            32,
            1.0,
            "us",
            comment="node's clock at the sample named by sequence; wraps at 2^32",
        ),
        Signal("temperature_degC", 32, 16, 0.01, "degC", True, "at the joint; lowest raw value = no value"),
        Signal("error_flags", 48, 8, comment=SENSOR_FLAGS),
        Signal("sequence", 56, 8, comment="sequence of the JointN_State sent just before"),
    )
    return (
        Message(base, f"Joint{joint}_State", 8, node, "Host", state, "every sample of the sensor node"),
        Message(
            base + 1,
            f"Joint{joint}_Status",
            8,
            node,
            "Host",
            status,
            "every tenth sample, and when error_flags change",
        ),
    )


def drive_messages(joint: int) -> tuple[Message, ...]:
    """Messages of a drive of joint 1…8 that is described by this table alone."""
    base, node = DRIVE_BASE + DRIVE_STRIDE * (joint - 1), f"Drive{joint}"
    command = (
        Signal("motor_position_target_rad", 0, 32, 1e-6, "rad", True),
        Signal("motor_velocity_target_rad_s", 32, 16, 2e-3, "rad/s", True),
        Signal(
            "motor_torque_target_Nm",
            48,
            16,
            1e-3,
            "Nm",
            True,
            "torque, or feed-forward torque in the other modes",
        ),
    )
    control = (
        Signal("request", 0, 8, values=REQUESTS),
        Signal("control_mode", 8, 8, values=MODES),
        Signal("kp_Nm_per_rad", 16, 16, 0.05, "Nm/rad"),
        Signal("kd_Nms_per_rad", 32, 16, 1e-3, "Nms/rad"),
        Signal("torque_limit_Nm", 48, 16, 1e-3, "Nm", comment="0 leaves the drive's own limit as it is"),
    )
    state = (
        Signal("motor_position_rad", 0, 28, 1e-6, "rad", True, "motor (input pulley) angle"),
        Signal("motor_velocity_rad_s", 28, 12, 0.025, "rad/s", True),
        Signal(
            "motor_torque_Nm", 40, 16, 1e-3, "Nm", True, "torque that the motor applies to the input pulley"
        ),
        Signal("sequence", 56, 8, comment="one more with every state, wraps at 256"),
    )
    status = (
        Signal("drive_state", 0, 4, values=DRIVE_STATES),
        Signal("control_mode", 4, 4, values=MODES),
        Signal("error_flags", 8, 16, comment=DRIVE_FLAGS),
        Signal("motor_current_A", 24, 16, 0.01, "A", True),
        Signal("temperature_degC", 40, 16, 0.01, "degC", True, "of the drive"),
        Signal("sequence", 56, 8, comment="sequence of the DriveN_State sent just before"),
    )
    return (
        Message(base, f"Drive{joint}_Command", 8, "Host", node, command, "answered by a DriveN_State"),
        Message(base + 1, f"Drive{joint}_Control", 8, "Host", node, control, "answered by a DriveN_Status"),
        Message(base + 2, f"Drive{joint}_State", 8, node, "Host", state, "one for each command"),
        Message(
            base + 3, f"Drive{joint}_Status", 8, node, "Host", status, "every tenth state, and on change"
        ),
    )


SYNC = Message(
    SYNC_ID,
    "Sync",
    4,
    "Host",
    "Vector__XXX",
    (Signal("step", 0, 32, comment="number of the step, wraps at 2^32"),),
    "in stepped time every joint on the bus takes one step",
)


def joint_table() -> tuple[Message, ...]:
    """Sensor nodes 1…8, drives 1…8 and Sync: `cablecomp_joint.dbc`."""
    joints = range(1, JOINTS + 1)
    return (*(m for j in joints for m in (*sensor_messages(j), *drive_messages(j))), SYNC)
