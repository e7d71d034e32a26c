"""The message tables (DBC) that ship in `configs/links`; `python -m firmware_sim.wire.shipped DIRECTORY` writes
them."""

from __future__ import annotations

import sys
from pathlib import Path

from firmware_sim.wire.dbc_text import render
from firmware_sim.wire.maker_tables import mit_table, odrive_table
from firmware_sim.wire.tables import JOINTS, SYNC, joint_table, sensor_messages


def tables() -> dict[str, str]:
    """File name -> text of every table that ships; each holds the sensor nodes, so that one table reads a
    bus."""
    sensors = tuple(m for j in range(1, JOINTS + 1) for m in sensor_messages(j))
    joint = "Sensor nodes and drives of cable-driven joints 1 to 8; SI units, named in each signal."
    odrive = "Sensor nodes of joints 1 to 8 and ODrive CANSimple nodes 1 to 8; ODrive counts in turns."
    mit = "Sensor nodes of joints 1 to 8, AK80-9 drives 1 to 8 in MIT mode (replies on identifier 0)."
    return {
        "cablecomp_joint.dbc": render(joint_table(), joint),
        "cablecomp_odrive.dbc": render((*sensors, *odrive_table(JOINTS), SYNC), odrive),
        "cablecomp_mit_ak80_9.dbc": render((*sensors, *mit_table("AK80-9", JOINTS), SYNC), mit),
    }


def write_tables(directory: Path) -> None:
    """Write every table into `directory`."""
    for name, text in tables().items():
        (directory / name).write_text(text, encoding="ascii")


if __name__ == "__main__":
    write_tables(Path(sys.argv[1]))
