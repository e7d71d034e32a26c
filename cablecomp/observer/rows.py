"""What goes into a compiled step and what comes out, by name: a row of readings, a row of answers.

To the compiled code a row is a record that lies in a flat array; to Python a block of rows is its columns.
"""

from __future__ import annotations

from struct import Struct
from typing import Any, NamedTuple

import numpy as np

from cablecomp.mechanics.flat import records
from cablecomp.mechanics.jit import inlined_kernel
from cablecomp.mechanics.profile import Floats
from cablecomp.mechanics.records import OTHERS, floats, record

# A sample's readings; NaN where there is none.
READINGS = record(
    [
        ("time", "f8"),
        ("motor", "f8"),  # angle of the input pulley
        ("load", "f8"),  # of the joint torque sensor, as it reads
        ("joint", "f8"),  # of the joint encoder
        ("temperature", "f8"),  # degC
        ("motor_rate", "f8"),  # of rows that were picked from many: what their spacing does not tell
        ("other", "f8", (OTHERS,)),  # further channels, as many as the joint's effects read; the rest 0
    ]
)


put_sample = Struct("=5d").pack_into
"""Write time, motor, load, joint and temperature where a row of readings begins: three times as quick as by name."""
put_asked = Struct("=3d").pack_into
"""The first three of them."""

# Where a joint's arrays lie, each by its address and its length (of `rows` and `outs`: of one of them), and the machine
# code of `step_rows` for them: handed over as one array, as every one more costs a call from Python 0.13 us.
PLACES = record(
    [
        ("step_rows", "i8"),
        *((name, "i8", (2,)) for name in ("fixed", "layout", "memory", "heights", "rows", "outs")),
    ]
)


class Answer(NamedTuple):
    """What the steps of a block say of the joint, in SI units: its columns."""

    joint: Floats  # angle that the joint encoder reads
    drive: Floats  # angle of the output pulley
    load: Floats
    tension_h: Floats  # at the output pulley; `_l` NaN in an open circuit
    tension_l: Floats
    compliance: Floats
    tension_h_in: Floats  # at the input pulley
    tension_l_in: Floats
    motor_torque: Floats
    strength: Floats  # greatest share of its breaking force that any cable bears


ANSWER = record([(name, "f8") for name in Answer._fields])


class Readings(NamedTuple):
    """A block of readings: `rows` as the kernel takes it, and its columns, which lie in it."""

    rows: Floats
    time: Floats
    motor: Floats
    load: Floats
    joint: Floats
    temperature: Floats
    motor_rate: Floats
    other: Floats


def readings(count: int, channels: int) -> Readings:
    """Room for `count` samples of a joint whose effects read so many further channels: nothing is known yet."""
    rows = np.full((count, floats(READINGS)), np.nan)
    columns = rows.view(READINGS)[:, 0]
    columns["other"][:, channels:] = 0.0
    return Readings(rows, *(columns[name] for name in READINGS.names or ()))


def answers(count: int) -> tuple[Floats, Answer]:
    """Room for `count` answers: rows as the kernel takes them, and the columns that lie in them."""
    rows = np.zeros((count, floats(ANSWER)))
    columns = rows.view(ANSWER)[:, 0]
    return rows, Answer(*(columns[name] for name in Answer._fields))


def _readings_in(row: Floats) -> Any:
    return records(row, 0, (1,), READINGS)[0]


def _answer_in(out: Floats) -> Any:
    return records(out, 0, (1,), ANSWER)[0]


readings_in = inlined_kernel(_readings_in)
answer_in = inlined_kernel(_answer_in)
