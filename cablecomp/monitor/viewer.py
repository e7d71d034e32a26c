"""The process beside the loop: receives datagrams, serves onlookers. It ends with the run, or when the run has gone."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

from cablecomp.config import JointConfig
from cablecomp.errors import CablecompError, InputError
from cablecomp.monitor.frames import Profiles, profiles_of, unpacked
from cablecomp.monitor.instrument import END, Instrument
from cablecomp.monitor.server import PageServer
from cablecomp.monitor.sinks import Foxglove, Mcap, PlotJuggler, Sink

READY_S: Final = 120.0
"""How long the process may take to be there: it loads compiled code."""
END_S: Final = 5.0
"""How long it may take to be gone."""


@dataclass(frozen=True)
class Onlookers:
    """Who looks on: the built-in page, Foxglove, PlotJuggler; and the file that is written."""

    page: bool = False
    foxglove: bool = False
    plotjuggler: bool = False
    mcap: Path | None = None

    @property
    def any(self) -> bool:
        """Whether there is anyone."""
        return self.page or self.foxglove or self.plotjuggler or self.mcap is not None


@dataclass
class Viewer:
    """What a run has of its viewer: the instrument to hand to it, a line about each place to look, and, once it is
    over, why what was written is incomplete."""

    instrument: Instrument
    words: tuple[str, ...]
    failures: tuple[str, ...] = ()


@contextmanager
def watched(config: JointConfig, who: Onlookers, styles: str) -> Iterator[Viewer]:
    """A viewer for the time of a run. Raises InputError if it cannot serve, as for a file that cannot be written."""
    context = get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(
        target=serve, args=(there, config, who, styles, os.getpid()), name="viewer", daemon=True
    )
    with _keys_held():
        process.start()
    there.close()
    try:
        port, words = _answer(here)
        viewer = Viewer(Instrument(port), words)
        try:
            yield viewer
        finally:
            viewer.instrument.close()
            viewer.failures = _last_words(here)
            process.join(END_S)
    finally:
        if process.is_alive():
            process.terminate()
            process.join()
        here.close()


@contextmanager
def _keys_held() -> Iterator[None]:
    """A process that is started inside never gets the signals of a terminal's keys, which are for the run: at no
    moment, not even while it imports, does it end by a traceback, or halt so that nothing ends it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # starting it would let SIGINT through again
    before = signal.pthread_sigmask(
        signal.SIG_BLOCK, (signal.SIGINT, signal.SIGQUIT, signal.SIGTSTP, signal.SIGHUP)
    )
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _answer(here: Connection) -> tuple[int, tuple[str, ...]]:
    found: tuple[int, tuple[str, ...]] | str = "it ended without a word"
    with suppress(EOFError):
        found = here.recv() if here.poll(READY_S) else "it does not answer"
    if isinstance(found, str):
        raise InputError(f"viewer: {found}")
    return found


def _last_words(here: Connection) -> tuple[str, ...]:
    with suppress(EOFError):
        if here.poll(END_S):
            found: tuple[str, ...] = here.recv()
            return found
    return ("viewer: it ended without a word; what it wrote may be incomplete",)


def serve(there: Connection, config: JointConfig, who: Onlookers, styles: str, parent: int) -> None:
    """The process's whole life: open, say where, pass frames on, close."""
    sinks: list[Sink] = []
    try:
        words = _open(config, who, styles, sinks)
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.bind(("127.0.0.1", 0))
        profiles = profiles_of(config)
    except (CablecompError, OSError, RuntimeError) as error:
        there.send(str(error).partition("\n")[0])
        return
    there.send((receiver.getsockname()[1], words))
    with suppress(KeyboardInterrupt):  # where it could not be held back: the run gets it too, and ends this
        pass_on(receiver, profiles, sinks, parent)
    receiver.close()
    with suppress(BrokenPipeError):  # the run has gone
        there.send(tuple(_closed(sinks)))


def _closed(sinks: Sequence[Sink]) -> Iterator[str]:
    """Close every one of them; why what one kept is incomplete."""
    for sink in sinks:
        try:
            sink.close()
        except CablecompError as error:
            yield str(error)


def _open(config: JointConfig, who: Onlookers, styles: str, sinks: list[Sink]) -> tuple[str, ...]:
    words = []
    if who.page:
        page = PageServer(config.name, styles)
        sinks.append(page)
        words.append(f"live: {page.address}")
    if who.foxglove:
        foxglove = Foxglove()
        sinks.append(foxglove)
        words.append(f"Foxglove: ws://127.0.0.1:{foxglove.port}")
    if who.plotjuggler:
        sinks.append(PlotJuggler())
        words.append("PlotJuggler: UDP server, JSON, port 9870")
    if who.mcap is not None:
        sinks.append(Mcap(who.mcap))
    return tuple(words)


def pass_on(receiver: socket.socket, profiles: Profiles, sinks: Sequence[Sink], parent: int) -> None:
    """Give every datagram's frame to every sink until END, or until the run's process is gone."""
    receiver.settimeout(0.5)
    while True:
        try:
            datagram = receiver.recv(65_535)
        except TimeoutError:
            if os.getppid() != parent:
                return
            continue
        if datagram == END:
            return
        found = unpacked(datagram, profiles)
        for sink in sinks:
            with suppress(OSError):
                sink.take(found)
