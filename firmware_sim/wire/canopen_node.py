"""A simulated CANopen node: NMT, heartbeats both ways, emergencies, and PDOs whose mapping can be written.

Source: CiA 301 4.2.0, 7.2.2 (PDO), 7.2.6 (SYNC), 7.2.7 (EMCY), 7.2.8 (NMT, heartbeat), 7.5.2 (0x1400…0x1BFF).
"""

from __future__ import annotations

from firmware_sim.wire.canopen_objects import RANGE, STATE, TOO_LONG, UNSUPPORTED, Abort, Entry, Objects
from firmware_sim.wire.frame import Frame

BOOTING, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
OFF = 0x8000_0000
MAPPED = 4


class Pdo:
    """Communication and mapping parameters of one PDO, `sub`-entries of 0x14xx/0x16xx or 0x18xx/0x1Axx."""

    def __init__(
        self, objects: Objects, base: int, number: int, identifier: int, mapped: tuple[int, ...]
    ) -> None:
        self.objects = objects
        parameter, mapping = base + number, base + 0x200 + number
        self.identifier = Entry(4, identifier)
        self.kind = Entry(1, 255)
        self.count = Entry(1, len(mapped), accept=self._check_count)
        self.mapping = [
            Entry(4, mapped[k] if k < len(mapped) else 0, accept=self._check_entry) for k in range(MAPPED)
        ]
        objects.entries |= {
            (parameter, 0): Entry(1, 2, writable=False),
            (parameter, 1): self.identifier,
            (parameter, 2): self.kind,
            (mapping, 0): self.count,
            **{(mapping, k + 1): entry for k, entry in enumerate(self.mapping)},
        }

    def _check_entry(self, value: int) -> None:
        if self.on or self.count.value:
            raise Abort(UNSUPPORTED)
        if self.objects.find((value >> 16, value >> 8 & 0xFF)).size * 8 != value & 0xFF:
            raise Abort(RANGE)

    def _check_count(self, value: int) -> None:
        if self.on:
            raise Abort(STATE)
        if value > MAPPED:
            raise Abort(RANGE)
        if sum(entry.value & 0xFF for entry in self.mapping[:value]) > 64:
            raise Abort(TOO_LONG)

    @property
    def on(self) -> bool:
        """Whether it is sent or listened to."""
        return not self.identifier.value & OFF

    @property
    def synchronous(self) -> bool:
        """Whether it goes with SYNC."""
        return self.kind.value <= 240

    @property
    def keys(self) -> list[tuple[int, int]]:
        """Objects that it carries."""
        return [(e.value >> 16, e.value >> 8 & 0xFF) for e in self.mapping[: self.count.value]]

    def pack(self) -> Frame:
        """The PDO with present values."""
        data = b"".join(self.objects.find(key).data for key in self.keys)
        return Frame(self.identifier.value & 0x7FF, data)

    def unpack(self, data: bytes) -> dict[tuple[int, int], bytes] | None:
        """What a PDO brought; None where it is too short."""
        out, at = {}, 0
        for key in self.keys:
            size = self.objects.find(key).size
            out[key] = data[at : at + size]
            at += size
        return out if at <= len(data) else None


class Node:
    """State of the network slave `number`, apart from what it is."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.objects = Objects()
        self.state = BOOTING
        self.produce = Entry(2, 0)
        self.consume = Entry(4, 0)
        self._next_s = 0.0
        self.objects.entries |= {
            (0x1017, 0): self.produce,
            (0x1016, 0): Entry(1, 1, writable=False),
            (0x1016, 1): self.consume,
        }

    @property
    def watched(self) -> int | None:
        """Identifier of the heartbeat that is waited for."""
        host = self.consume.value >> 16 & 0x7F
        return 0x700 + host if host and self.patience_s else None

    @property
    def patience_s(self) -> float:
        """How long it is waited for."""
        return 1e-3 * (self.consume.value & 0xFFFF)

    def heartbeat(self, now_s: float) -> list[Frame]:
        """The boot-up message once, then heartbeats when they are due."""
        if self.state == BOOTING:
            self.state, self._next_s = PRE_OPERATIONAL, now_s
            return [Frame(0x700 + self.number, b"\0")]
        if not self.produce.value or now_s < self._next_s:
            return []
        self._next_s = now_s + 1e-3 * self.produce.value
        return [Frame(0x700 + self.number, bytes([self.state]))]

    def command(self, code: int) -> None:
        """An NMT command that does not restart the node."""
        states = {0x01: OPERATIONAL, 0x02: STOPPED, 0x80: PRE_OPERATIONAL}
        self.state = states.get(code, self.state)
