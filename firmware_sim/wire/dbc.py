"""A drive described by a DBC table, device side, with a map of its signals to what the drive knows.

The map is a TOML file; `{joint}` in a message's name stands for the joint's number. Without a map the drive
messages of
`configs/links/cablecomp_joint.dbc` are spoken.

```toml
[device]
dbc = "maker.dbc"                      # beside this file
[device.command]                       # host to drive: targets; answered by `state`, steps stepped time
message = "Axis{joint}_Target"
signals = { Pos = "motor_position_target_rad", TorqueFF = "motor_torque_target_Nm" }
[device.control]                       # host to drive: request, control_mode, gains, torque limit; answered
by `status`
[device.state]                         # drive to host, one for each command
[device.status]                        # drive to host, every tenth state and on change
[device.requests]                      # this maker's numbers for disable, calibrate, enable, clear_faults, …
```
`signals` maps a signal to a field; signals left out must bear the field's own name or stay raw 0. A signal
in other units
is scaled by its table, not here.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firmware_sim.errors import SimError
from firmware_sim.firmware import Drive, DriveFlag, DriveReport, Mode, Request, Setpoint
from firmware_sim.wire.base import Answer, Heard
from firmware_sim.wire.dbc_text import render
from firmware_sim.wire.frame import EXTENDED, Frame
from firmware_sim.wire.packed import PackedMessage
from firmware_sim.wire.tables import joint_table

SHIPPED = "cablecomp_joint.dbc"
TARGETS = ("motor_position_target_rad", "motor_velocity_target_rad_s", "motor_torque_target_Nm")
GAINS = ("kp_Nm_per_rad", "kd_Nms_per_rad")
CONTROLS = ("request", "control_mode", *GAINS, "torque_limit_Nm")
STATES = ("motor_position_rad", "motor_velocity_rad_s", "motor_torque_Nm", "sequence")
STATUSES = ("drive_state", "control_mode", "error_flags", "motor_current_A", "temperature_degC", "sequence")
FIELDS = {
    "command": (*TARGETS, *CONTROLS),
    "control": CONTROLS,
    "state": (*STATES, *STATUSES),
    "status": (*STATES, *STATUSES),
}


@dataclass(frozen=True)
class MessageMap:
    """Name of a message (with `{joint}`) and its signals' fields."""

    message: str
    signals: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class DbcMap:
    """Which messages of which table the drive speaks (`path` None: the one that ships); `requests` maps this maker's
    numbers to requests."""

    path: Path | None
    command: MessageMap
    control: MessageMap | None
    state: MessageMap
    status: MessageMap | None
    requests: Mapping[int, Request]


def shipped_map() -> DbcMap:
    """The map of the table that ships."""
    names = {part: MessageMap(f"Drive{{joint}}_{part.capitalize()}") for part in FIELDS}
    return DbcMap(
        None,
        names["command"],
        names["control"],
        names["state"],
        names["status"],
        {r.value: r for r in Request},
    )


def load_map(path: Path) -> DbcMap:
    """Read a map; raises SimError that names file, key and what is accepted."""
    try:
        device = tomllib.loads(path.read_text(encoding="utf-8"))["device"]
        parts = {name: _message_map(path, name, device.get(name)) for name in FIELDS}
        command, state = parts["command"], parts["state"]
        if command is None or state is None:
            raise SimError(f"{path}: [device.command] and [device.state] are needed; add them")
        numbers = device.get("requests", {r.name.lower(): r.value for r in Request})
        requests = {int(number): Request[name.upper()] for name, number in numbers.items()}
        return DbcMap(
            path.parent / device["dbc"], command, parts["control"], state, parts["status"], requests
        )
    except OSError as error:
        raise SimError(f"{path}: cannot be read ({error.strerror}); give the path of a map") from None
    except tomllib.TOMLDecodeError as error:
        raise SimError(f"{path}: is not valid TOML: {error}") from None
    except KeyError as error:
        raise SimError(
            f"{path}: {error.args[0]!r} is missing or not known; see firmware_sim/wire/dbc.py"
        ) from None


def _message_map(path: Path, name: str, table: Any) -> MessageMap | None:
    if table is None:
        return None
    signals = dict(table.get("signals", {}))
    for signal, target in signals.items():
        if target not in FIELDS[name]:
            accepted = ", ".join(FIELDS[name])
            raise SimError(
                f"{path}: [device.{name}] maps {signal} to {target!r}; one of {accepted} is accepted"
            )
    return MessageMap(table["message"], signals)


def _database(path: Path | None) -> Any:
    import cantools.database  # slow to import, with python-can, and for this protocol alone

    if path is None:  # written anew: an installed package need not bring the file
        return cantools.database.load_string(render(joint_table(), SHIPPED), "dbc")
    try:
        return cantools.database.load_file(path)
    except OSError as error:
        raise SimError(f"{path}: cannot be read ({error.strerror}); give a DBC table") from None


class _Spoken:
    """One message with its signals tied to fields."""

    def __init__(
        self, database: Any, mapped: MessageMap, accepted: tuple[str, ...], joint: int, where: str
    ) -> None:
        name = mapped.message.format(joint=joint)
        try:
            self.packed = PackedMessage(database.get_message_by_name(name))
        except KeyError:
            raise SimError(f"{where}: has no message {name}; check the map or the number of joints") from None
        self.fields = {s.name: mapped.signals.get(s.name, s.name) for s in self.packed.signals}
        self.fields = {signal: target for signal, target in self.fields.items() if target in accepted}

    def encode(self, values: Mapping[str, float]) -> Frame:
        data = self.packed.encode({signal: values[target] for signal, target in self.fields.items()})
        return Frame(self.packed.identifier, data, extended=self.packed.extended)

    def decode(self, data: bytes) -> dict[str, float]:
        values = self.packed.decode(data)
        return {target: values[signal] for signal, target in self.fields.items()}


class DbcWire:
    """A drive that speaks the messages of a DBC table."""

    def __init__(self, joint: int, mapped: DbcMap | None = None, status_every: int = 10) -> None:
        m = shipped_map() if mapped is None else mapped
        database, where = _database(m.path), str(m.path or SHIPPED)
        self.command = _Spoken(database, m.command, FIELDS["command"], joint, where)
        self.control = (
            None if m.control is None else _Spoken(database, m.control, FIELDS["control"], joint, where)
        )
        self.state = _Spoken(database, m.state, FIELDS["state"], joint, where)
        self.status = (
            None if m.status is None else _Spoken(database, m.status, FIELDS["status"], joint, where)
        )
        self.requests = m.requests
        self.status_every = status_every
        self.status_phase = joint - 1
        self.reset()

    def reset(self) -> None:
        """Power cycle: gains are forgotten and the sequence starts again."""
        self._kp = self._kd = 0.0
        self._sequence = 0
        self._told: tuple[int, ...] | None = None

    def identifiers(self) -> Iterable[int]:
        """The messages that the host sends."""
        heard = (self.command,) if self.control is None else (self.command, self.control)
        return tuple(s.packed.identifier | (EXTENDED if s.packed.extended else 0) for s in heard)

    def broadcasts(self) -> Iterable[int]:
        """None."""
        return ()

    def hear(self, frame: Frame, drive: Drive, now_s: float) -> Heard:
        """Targets are answered by the state, controls by the status and the state."""
        is_command = frame.identifier == self.command.packed.identifier
        spoken = self.command if is_command else self.control
        if spoken is None or frame.remote or len(frame.data) < spoken.packed.length:
            drive.flags |= DriveFlag.BAD_FRAME
            return Heard()
        values = spoken.decode(frame.data)
        self._controls(values, drive, now_s)
        if not is_command:
            drive.feed_watchdog(now_s)
            return Heard((Answer.STATUS, Answer.STATE))
        old = drive.setpoint
        targets = [values.get(n, o) for n, o in zip(TARGETS, old[:3], strict=True)]
        drive.command(Setpoint(targets[0], targets[1], targets[2], self._kp, self._kd), now_s)
        return Heard((Answer.STATE,), steps=True)

    def _controls(self, values: Mapping[str, float], drive: Drive, now_s: float) -> None:
        self._kp = values.get(GAINS[0], self._kp)
        self._kd = values.get(GAINS[1], self._kd)
        if "control_mode" in values:
            mode = round(values["control_mode"])
            if mode not in Mode.__members__.values():
                drive.flags |= DriveFlag.BAD_FRAME
                return
            if mode != drive.mode:
                drive.set_mode(Mode(mode))
        if "torque_limit_Nm" in values:
            drive.set_limits(torque_Nm=values["torque_limit_Nm"])
        if "request" in values:
            request = self.requests.get(round(values["request"]))
            if request is None:
                drive.flags |= DriveFlag.BAD_FRAME
                return
            drive.request(request, now_s)
            if request is Request.RESET:
                self.reset()

    def answer(self, answer: Answer, frame: Frame, drive: Drive) -> Frame | None:
        """DriveN_State or DriveN_Status."""
        spoken = self.state if answer is Answer.STATE else self.status
        if spoken is None:
            return None
        if answer is Answer.STATE:
            self._sequence = (self._sequence + 1) % 256
        return spoken.encode(self._values(drive.report()))

    def cyclic(self, drive: Drive, now_s: float) -> list[Frame]:
        """The status with every tenth state (each drive of a bus at another one of the ten), and at once
        when state, mode or flags change."""
        report = drive.report()
        key = (report.state, report.mode, report.flags)
        turn = (self._sequence + self.status_phase) // self.status_every
        if self.status is None or (self._told == key and turn == self._told_turn):
            return []
        self._told, self._told_turn = key, turn
        return [self.status.encode(self._values(report))]

    _told_turn = 0

    def _values(self, report: DriveReport) -> dict[str, float]:
        temperature = report.temperature_degC
        return {
            "motor_position_rad": report.position_rad,
            "motor_velocity_rad_s": report.velocity_rad_s,
            "motor_torque_Nm": report.torque_Nm,
            "motor_current_A": report.current_A,
            "temperature_degC": -327.68 if math.isnan(temperature) else temperature,
            "drive_state": report.state,
            "control_mode": report.mode,
            "error_flags": report.flags,
            "sequence": self._sequence,
        }
