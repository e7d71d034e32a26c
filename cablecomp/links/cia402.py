"""CiA 402 drive profile: power state machine, cyclic synchronous modes, objects, and the set-up that maps them.

Sources: CiA 402-2 (IEC 61800-7-201), state machine and statusword, modes of operation; CiA 402-3, mapping;
0x60E4 (additional position) of CiA 402-2 version 4.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from cablecomp.links.canopen import RPDO, TPDO, Mapping, Object, Register, Step, map_pdo
from cablecomp.links.records import DriveState, Mode

CONTROLWORD: Final = Object(0x6040, 0, 2)
STATUSWORD: Final = Object(0x6041, 0, 2)
ERROR_CODE: Final = Object(0x603F, 0, 2)
MODE: Final = Object(0x6060, 0, 1)
MODE_DISPLAY: Final = Object(0x6061, 0, 1)
POSITION: Final = Object(0x6064, 0, 4)
VELOCITY: Final = Object(0x606C, 0, 4)
TARGET_TORQUE: Final = Object(0x6071, 0, 2)
RATED_TORQUE: Final = Object(0x6076, 0, 4)
TORQUE: Final = Object(0x6077, 0, 2)
TARGET_POSITION: Final = Object(0x607A, 0, 4)
TORQUE_OFFSET: Final = Object(0x60B2, 0, 2)
SECOND_POSITION: Final = Object(0x60E4, 1, 4)
TARGET_VELOCITY: Final = Object(0x60FF, 0, 4)
_PERIOD: Final = (Object(0x60C2, 1, 1), Object(0x60C2, 2, 1))


class Control(IntEnum):
    """Controlwords."""

    DISABLE_VOLTAGE = 0x00
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


class Power(IntEnum):
    """Bits of the statusword under the mask 0x6F (0x4F where bit 5 says nothing)."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


FOLLOWS: Final = 1 << 12
"""Statusword of the cyclic modes: the drive follows its target."""
CYCLIC: Final[dict[Mode, int]] = {Mode.POSITION: 8, Mode.VELOCITY: 9, Mode.TORQUE: 10}
"""CSP, CSV, CST."""
TARGETS: Final = {Mode.POSITION: TARGET_POSITION, Mode.VELOCITY: TARGET_VELOCITY, Mode.TORQUE: TARGET_TORQUE}

ERRORS: Final[dict[int, str]] = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current at the input",
    0x22: "current inside",
    0x23: "over current at the output",
    0x31: "mains voltage",
    0x32: "voltage of the DC link",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x43: "drive temperature",
    0x50: "hardware of the device",
    0x60: "software of the device",
    0x61: "internal software",
    0x63: "parameters",
    0x70: "additional module",
    0x71: "power stage or motor",
    0x73: "sensor",
    0x81: "communication: nothing heard from this side, or bus error",
    0x82: "protocol",
    0x84: "velocity controller",
    0x85: "position controller",
    0x86: "positioning: following error or limit",
    0x90: "external error",
}
"""Upper byte of an error code (CiA 301, table of emergency codes; CiA 402-2, error codes)."""
_MASKS: Final = (
    (0x6F, (Power.READY, Power.SWITCHED_ON, Power.ENABLED, Power.QUICK_STOP)),
    (0x4F, (Power.SWITCH_ON_DISABLED, Power.FAULT_REACTION, Power.FAULT)),
)
_STATES: Final = {
    Power.ENABLED: DriveState.ENABLED,
    Power.FAULT: DriveState.FAULT,
    Power.FAULT_REACTION: DriveState.FAULT,
}
_UPWARDS: Final = {
    Power.SWITCH_ON_DISABLED: Control.SHUTDOWN,
    Power.READY: Control.SWITCH_ON,
    Power.SWITCHED_ON: Control.ENABLE_OPERATION,
    Power.ENABLED: Control.ENABLE_OPERATION,
}


def power_of(statusword: int) -> Power:
    """State that a statusword tells; what is none of them counts as not ready."""
    for mask, states in _MASKS:
        if statusword & mask in states:
            return Power(statusword & mask)
    return Power.NOT_READY


def state_of(power: Power) -> DriveState:
    """What a power state means to the loop."""
    return _STATES.get(power, DriveState.DISABLED)


def upwards(power: Power) -> Control:
    """The controlword that leads on towards operation; none does out of a fault."""
    return _UPWARDS.get(power, Control.DISABLE_VOLTAGE)


class SetUp(NamedTuple):
    """What a drive is set up for: its node, the mode, what goes into the PDOs beside the least, the period of SYNC
    in s, heartbeats in ms (`watch_ms` 0: the drive watches nobody), what its torques are thousandths of."""

    node: int
    host: int
    mode: Mode
    feed_forward: bool
    second_encoder: bool
    period_s: float
    heartbeat_ms: int
    watch_ms: int
    rated_torque_mNm: int


def command_entries(mode: Mode, feed_forward: bool) -> tuple[Object, ...]:
    """What the command PDO carries."""
    offset = (TORQUE_OFFSET,) if feed_forward and mode is not Mode.TORQUE else ()
    return (CONTROLWORD, TARGETS[mode], *offset)


def steps(s: SetUp) -> tuple[Step, ...]:
    """Every transfer of a set-up, in order; the first one takes the power away."""
    told = ((STATUSWORD, POSITION, TORQUE), (VELOCITY, ERROR_CODE, MODE_DISPLAY))
    second = (SECOND_POSITION,) if s.second_encoder else ()
    heard = Mapping(0x1400, 0x1600, RPDO + s.node, command_entries(s.mode, s.feed_forward))
    sent = [
        Mapping(0x1800 + k, 0x1A00 + k, TPDO[k] + s.node, entries)
        for k, entries in enumerate((*told, second, ()))
    ]
    exponent = next(e for e in (-4, -3, -2, -1, 0) if round(s.period_s / 10**e) <= 0xFF)
    period = (round(s.period_s / 10**exponent), exponent)
    watch = s.host << 16 | s.watch_ms if s.watch_ms else 0
    return (
        Step(CONTROLWORD, Control.DISABLE_VOLTAGE),
        Step(Object(Register.PRODUCER_HEARTBEAT, 0, 2), s.heartbeat_ms),
        Step(Object(Register.CONSUMER_HEARTBEAT, 1, 4), watch, may_lack=not s.watch_ms),
        Step(RATED_TORQUE, s.rated_torque_mNm, may_lack=True, check=True),
        *map_pdo(heard),
        *(step for mapping in sent for step in map_pdo(mapping)),
        Step(MODE, CYCLIC[s.mode]),
        *(Step(entry, n, may_lack=True) for entry, n in zip(_PERIOD, period, strict=True)),
    )


def error_words(code: int) -> str:
    """Words for an error code."""
    return f"{ERRORS.get(code >> 8, 'error of this device')} (0x{code:04X})"
