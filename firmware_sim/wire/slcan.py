"""The adapter side of slcan: Lawicel's ASCII commands, each ended by CR, answered by CR (done) or BEL
(refused).

Understood: S0…S8 and sXXYY (bit rate), O (open), L (open, listen only), C (close), tIIILDD…, TIIIIIIIILDD…
(data frame),
rIIIL, RIIIIIIIIL (remote request), V and N (version, serial number), F (status flags), Z0/Z1 (time stamps),
M and m
(acceptance); FD frames as CANable 2.0 has them: d, D, with the data bit rate b, B, the length a code of one
hexadecimal digit. Time stamps: four hexadecimal digits, ms, modulo 60 000. Source: Lawicel AB, CANUSB manual,
"CANUSB commands".
"""

from __future__ import annotations

from typing import NamedTuple

from firmware_sim.wire.frame import Frame

OK, REFUSED = b"\r", b"\x07"
LONGEST = 160
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


class Spoken(NamedTuple):
    """What came of some bytes: frames for the bus, and the adapter's answers."""

    frames: list[Frame]
    answers: bytes


class SlcanAdapter:
    """State of the adapter: channel open or closed, time stamps on or off, bus off or not."""

    def __init__(self) -> None:
        self._line = bytearray()
        self.open = False
        self.listen_only = False
        self.stamps = False
        self.bus_off = False

    def feed(self, data: bytes) -> Spoken:
        """Take bytes from the computer."""
        frames: list[Frame] = []
        answers = b""
        for byte in data:
            if byte != 0x0D:
                if len(self._line) < LONGEST:
                    self._line.append(byte)
                continue
            line = bytes(self._line)
            self._line.clear()
            answers += self._command(line, frames)
        return Spoken(frames, answers)

    def reset(self) -> None:
        """The computer went away: channel closed, half a line forgotten."""
        self._line.clear()
        self.open = self.listen_only = self.stamps = False

    def encode(self, frame: Frame, now_s: float) -> bytes:
        """One frame from the bus as the adapter passes it on; nothing while the channel is closed."""
        if not self.open or self.bus_off:
            return b""
        if frame.fd:
            return self._encode_fd(frame)
        letter = (b"R" if frame.extended else b"r") if frame.remote else (b"T" if frame.extended else b"t")
        identifier = b"%08X" % frame.identifier if frame.extended else b"%03X" % frame.identifier
        line = letter + identifier + b"%d" % len(frame.data)
        if not frame.remote:
            line += frame.data.hex().upper().encode()
        if self.stamps:
            line += b"%04X" % (int(now_s * 1e3) % 60_000)
        return line + OK

    def _encode_fd(self, frame: Frame) -> bytes:
        letter = b"b" if frame.switch else b"d"
        head = (letter.upper() + b"%08X" if frame.extended else letter + b"%03X") % frame.identifier
        code = b"%X" % FD_LENGTHS.index(len(frame.data))
        return head + code + frame.data.hex().upper().encode() + OK

    def _command(self, line: bytes, frames: list[Frame]) -> bytes:
        if not line:
            return OK
        letter = line[:1]
        if letter in b"tTrRdDbB":
            return self._transmit(line, frames)
        if letter in (b"O", b"L"):
            if self.open:
                return REFUSED
            self.open, self.listen_only = True, letter == b"L"
            return OK
        if letter == b"C":
            self.open = False
            return OK
        if letter in b"SsMmYyQWU":
            return REFUSED if self.open else OK
        if letter == b"Z":
            self.stamps = line[1:2] == b"1"
            return OK
        if letter in (b"V", b"v"):
            return letter + b"1013" + OK
        if letter == b"N":
            return b"NSIM1" + OK
        if letter == b"F":
            return (b"F80" if self.bus_off else b"F00") + OK
        return REFUSED

    def _transmit(self, line: bytes, frames: list[Frame]) -> bytes:
        remote, extended, fd = line[:1] in b"rR", line[:1] in b"TRDB", line[:1] in b"dDbB"
        digits = 8 if extended else 3
        try:
            identifier = int(line[1 : 1 + digits], 16)
            code = int(line[1 + digits : 2 + digits], 16)
            length = FD_LENGTHS[code] if fd else code
            data = b"" if remote else bytes.fromhex(line[2 + digits :].decode("ascii"))
        except (ValueError, UnicodeDecodeError):
            return REFUSED
        whole = (
            length <= (64 if fd else 8)
            and (remote or len(data) == length)
            and identifier < (1 << (29 if extended else 11))
        )
        if not whole or not self.open or self.listen_only or self.bus_off:
            return REFUSED
        frames.append(Frame(identifier, data, remote, extended, fd, line[:1] in b"bB"))
        return (b"Z" if extended else b"z") + OK
