"""A message table as data, and as the text of a DBC file (Vector's format, as cantools reads it)."""

from __future__ import annotations

from typing import NamedTuple


class Signal(NamedTuple):
    """One signal: first bit, length in bits, scale, offset, unit; Intel unless `motorola`, unsigned unless
    `signed`."""

    name: str
    start: int
    length: int
    scale: float = 1.0
    unit: str = ""
    signed: bool = False
    comment: str = ""
    values: tuple[tuple[int, str], ...] = ()
    real: bool = False
    motorola: bool = False
    offset: float = 0.0
    low: float = 0.0
    high: float = 0.0


class Message(NamedTuple):
    """One message of the table."""

    identifier: int
    name: str
    length: int
    sender: str
    receiver: str
    signals: tuple[Signal, ...]
    comment: str = ""


def render(messages: tuple[Message, ...], comment: str) -> str:
    """DBC text of a table (Vector's format, as cantools reads it)."""
    nodes = sorted({n for m in messages for n in (m.sender, m.receiver)} - {"Vector__XXX"})
    blocks = [_message(m) for m in messages]
    notes = [f'CM_ "{comment}";']
    values: list[str] = []
    reals: list[str] = []
    for m in messages:
        if m.comment:
            notes.append(f'CM_ BO_ {m.identifier} "{m.comment}";')
        for s in m.signals:
            if s.comment:
                notes.append(f'CM_ SG_ {m.identifier} {s.name} "{s.comment}";')
            if s.values:
                pairs = " ".join(f'{k} "{v}"' for k, v in s.values)
                values.append(f"VAL_ {m.identifier} {s.name} {pairs} ;")
            if s.real:
                reals.append(f"SIG_VALTYPE_ {m.identifier} {s.name} : 1;")
    head = 'VERSION "1"\n\nNS_ :\n\nBS_:\n\nBU_: ' + " ".join(nodes)
    parts = ["\n\n".join([head, *blocks]), "\n".join(notes), "\n".join(values), "\n".join(reals)]
    return "\n\n".join(p for p in parts if p) + "\n"


def _message(message: Message) -> str:
    lines = [f"BO_ {message.identifier} {message.name}: {message.length} {message.sender}"]
    for s in message.signals:
        order, sign = (0 if s.motorola else 1), ("-" if s.signed else "+")
        lines.append(
            f" SG_ {s.name} : {s.start}|{s.length}@{order}{sign} ({s.scale:.12g},{s.offset:.12g}) "
            f'[{s.low:.12g}|{s.high:.12g}] "{s.unit}" {message.receiver}'
        )
    return "\n".join(lines)
