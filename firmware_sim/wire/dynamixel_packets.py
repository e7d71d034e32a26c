"""Dynamixel protocol 2.0 on the line, device side: instruction packets in, status packets out.

FF FF FD 00 | id | length u16 | instruction | parameters | CRC-16 (0x8005, start 0, over all before it); little end
first. Within instruction and parameters FF FF FD is stuffed with one more FD. A status packet has instruction 0x55
and an error byte before its parameters. Source: Robotis e-Manual, "DYNAMIXEL Protocol 2.0".
"""

from __future__ import annotations

from firmware_sim.wire.frame import Frame

START = b"\xff\xff\xfd"
STATUS = 0x55
SHORTEST, LONGEST = 3, 1000


def crc(data: bytes) -> int:
    """CRC-16, bit by bit."""
    register = 0
    for byte in data:
        register ^= byte << 8
        for _ in range(8):
            register = (register << 1 ^ 0x8005) & 0xFFFF if register & 0x8000 else register << 1
    return register


def stuff(data: bytes) -> bytes:
    """Data without a header inside."""
    out = bytearray()
    for byte in data:
        out.append(byte)
        if out[-3:] == START:
            out.append(0xFD)
    return bytes(out)


def unstuff(data: bytes) -> bytes:
    """Inverse of `stuff`."""
    out, skip = bytearray(), False
    for byte in data:
        if skip and byte == 0xFD:
            skip = False
            continue
        out.append(byte)
        skip = out[-3:] == START
    return bytes(out)


def status_packet(frame: Frame) -> bytes:
    """The bytes of a status: a frame of the drive's number, its error byte and parameters."""
    body = stuff(bytes([STATUS]) + frame.data)
    packet = START + bytes([0, frame.identifier]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc(packet).to_bytes(2, "little")


class InstructionReader:
    """Cuts a byte stream into instructions, as frames of the number addressed; what is damaged is passed over."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def reset(self) -> None:
        """Forget half a packet."""
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Frame]:
        """Frames that are complete with these bytes."""
        self._buffer += data
        frames = []
        while (frame := self._next()) is not None:
            if frame:
                frames.append(frame)
        return frames

    def _next(self) -> Frame | tuple[()] | None:
        b = self._buffer
        start = b.find(START + b"\0")
        if start < 0:
            del b[: max(len(b) - 3, 0)]
            return None
        del b[:start]
        if len(b) < 7:
            return None
        length = int.from_bytes(b[5:7], "little")
        if SHORTEST <= length <= LONGEST and len(b) < 7 + length:
            return None
        packet = bytes(b[: 7 + length])
        if not SHORTEST <= length <= LONGEST or crc(packet[:-2]) != int.from_bytes(packet[-2:], "little"):
            del b[:4]
            return ()
        del b[: 7 + length]
        body = unstuff(packet[7:-2])
        return () if body[0] == STATUS else Frame(packet[4], body)
