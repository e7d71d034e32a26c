"""Frames of a log, not of a bus: what a link's devices would have read from them."""

from __future__ import annotations

from typing import Protocol

from cablecomp.errors import InputError
from cablecomp.links.link import BusLink
from cablecomp.links.ports import PortBase, Sink
from cablecomp.links.records import EXTENDED, BusState
from cablecomp.links.schema import LinkConfig


class LoggedFrame(Protocol):
    """One received frame of a log."""

    @property
    def time_s(self) -> float: ...
    @property
    def identifier(self) -> int: ...
    @property
    def extended(self) -> bool: ...
    @property
    def data(self) -> bytes: ...


class _LogPort(PortBase):
    """A port through which one frame at a time is put."""

    def __init__(self) -> None:
        super().__init__()
        self.state = BusState.ACTIVE
        self.frame: tuple[int, bytes] | None = None

    def open(self) -> None:
        """Nothing to open."""

    def drain(self, sink: Sink, limit: int) -> int:
        """Hand over the frame."""
        if self.frame is None:
            return 0
        sink(*self.frame)
        self.frame = None
        return 1

    def send(self, identifier: int, data: bytes) -> bool:
        """Nothing is sent into a log."""
        return False

    def dropped(self) -> int:
        """None."""
        return 0

    def close(self) -> None:
        """Nothing to close."""


class LinkDecoder:
    """Channels of one joint from logged frames, in the log's order, by the link's own devices.

    Values are at the pulleys, in SI, as `run` with this link would have seen them. Raises InputError if the link
    has no such joint, or several and none is named.
    """

    def __init__(self, config: LinkConfig, joint: str | None = None) -> None:
        names = [j.name for j in config.joint]
        if joint is None and len(names) > 1:
            raise InputError(f"link {config.name}: has joints {', '.join(names)}; choose one with --joint")
        if joint is not None and joint not in names:
            raise InputError(f"link {config.name}: has no joint {joint}; it has {', '.join(names)}")
        self._port = _LogPort()
        self._link = BusLink(config, self._port)
        self._readings = self._link.joints[0 if joint is None else names.index(joint)]

    def __call__(self, frame: LoggedFrame) -> tuple[str, dict[str, float]] | None:
        """Name of the message and the channel values that it brought; None for a frame that brought none."""
        before = list(self._readings.updates)
        self._port.frame = (frame.identifier | (EXTENDED if frame.extended else 0), frame.data)
        self._link.poll(frame.time_s)
        new = [k for k, count in enumerate(self._readings.updates) if count != before[k]]
        if not new:
            return None
        channels = self._readings.channels
        return f"0x{frame.identifier:X}", {channels[k]: self._readings.values[k] for k in new}
