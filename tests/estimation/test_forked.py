"""Work in forks of a process: in order, with the starter's own objects, whatever becomes of a fork; and the same
diagnosis as in one process."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from small_drive import TOLERANT, recorded

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import report_json
from cablecomp.effects import extend
from cablecomp.errors import InputError
from cablecomp.estimation import parallel
from cablecomp.estimation.forked import forkable, forked, helping
from cablecomp.estimation.parallel import forks_allowed, in_processes
from firmware_sim.plant import EffectSpec

needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="other systems work in threads")


@dataclass(frozen=True)
class Found:
    """What was there before, and what is new."""

    before: NDArray[np.float64]
    doubled: NDArray[np.float64]
    where: int


def _at_once(k: int) -> None:
    """Let the other process take an item, too."""
    time.sleep(0.05)


def _met(folder: Path, processes: int) -> int:
    """This process, once so many have begun an item."""
    (folder / str(os.getpid())).touch()
    until = time.monotonic() + 60.0
    while len(list(folder.iterdir())) < processes and time.monotonic() < until:
        time.sleep(0.01)
    return os.getpid()


@pytest.fixture
def none_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Every process that a test forks is gone when it has ended, and was taken notice of (others may have been started
    by this one before)."""
    forks: list[int] = []
    fork = os.fork

    def kept() -> int:
        forks.append(fork())
        return forks[-1]

    monkeypatch.setattr(os, "fork", kept)
    yield
    assert forks
    for each in forks:
        with pytest.raises(ChildProcessError):
            os.waitpid(each, os.WNOHANG)


@pytest.fixture
def forking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two cores, and nothing that keeps this process from being forked (a test's own process may have threads)."""
    monkeypatch.setattr(parallel, "_threads", lambda: 2)
    monkeypatch.setattr(parallel, "forkable", lambda items: True)


@needs_linux
@pytest.mark.usefixtures("none_left")
@pytest.mark.parametrize("processes", [2, 4])
def test_results_are_in_order_and_hold_the_starters_own_objects(processes: int, tmp_path: Path) -> None:
    rows = [np.full(1000, float(k)) for k in range(8)]

    def work(k: int) -> Found:
        return Found(rows[k], 2.0 * rows[k], _met(tmp_path, processes))

    found = forked(work, range(8), processes)
    assert len({f.where for f in found}) == processes
    for f, row in zip(found, rows, strict=True):
        assert f.before is row  # not a copy of it, whichever process looked at it
        np.testing.assert_array_equal(f.doubled, 2.0 * row)


@needs_linux
def test_dear_items_are_begun_with() -> None:
    order = forked(lambda k: (_at_once(k), time.monotonic())[1], range(6), 2, dear=lambda k: k)
    assert sorted(order[4:]) < sorted(order[2:4]) < sorted(order[:2])


@needs_linux
@pytest.mark.usefixtures("none_left")
@pytest.mark.parametrize("refused", range(4))
def test_what_is_raised_is_raised_to_whom_asked(refused: int) -> None:
    def refuse(k: int) -> int:
        _at_once(k)
        if k == refused:
            raise InputError("no such item")
        return k

    with pytest.raises(InputError, match="no such item"):
        forked(refuse, range(4), 2)


@needs_linux
@pytest.mark.usefixtures("none_left")
@pytest.mark.parametrize("dearest", [1, -1])
def test_of_several_refusals_the_first_in_order_is_raised(dearest: int) -> None:
    begun = []

    def refuse(k: int) -> int:
        if not helping():
            begun.append(k)
        _at_once(k)
        raise InputError(f"no item {k}")

    with pytest.raises(InputError, match="no item 0"):
        forked(refuse, range(40), 2, dear=lambda k: dearest * k)
    assert len(begun) <= 2  # once one has raised nobody takes a further one, and the first is done once more


@needs_linux
@pytest.mark.usefixtures("none_left")
def test_what_a_killed_fork_has_not_done_is_done_here() -> None:
    here = os.getpid()

    def work(k: int) -> int:
        _at_once(k)
        if os.getpid() != here and k > 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return k * k

    assert forked(work, range(6), 2) == [k * k for k in range(6)]


@needs_linux
@pytest.mark.usefixtures("none_left")
def test_what_a_fork_that_hangs_has_not_done_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cablecomp.estimation.forked.PATIENCE_S", 0.1)

    def work(k: int) -> int:
        _at_once(k)
        if helping():
            time.sleep(1000.0)
        return k * k

    assert forked(work, range(6), 2) == [k * k for k in range(6)]


@needs_linux
def test_where_no_process_can_be_started_the_work_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    def fork() -> int:
        raise OSError("no room")

    monkeypatch.setattr(os, "fork", fork)
    assert forked(lambda k: k * k, range(6), 2) == [k * k for k in range(6)]


@needs_linux
@pytest.mark.usefixtures("none_left")
def test_what_cannot_be_sent_back_is_done_here() -> None:
    assert [f() for f in forked(lambda k: lambda: k, range(4), 2)] == [0, 1, 2, 3]


@needs_linux
def test_machine_code_does_not_leave_its_process() -> None:
    """Another process has something else at its address."""
    entry = EffectEntry(id="termination_backlash", gap_rad=2e-3)
    joint = TOLERANT.model_copy(update={"effect": (entry,)})
    found = forked(lambda k: extend(joint), range(4), 2)  # cannot be sent, so it is made here
    assert [t.address for change in found for t in change.terms] == [
        t.address for t in extend(joint).terms
    ] * 4
    with pytest.raises(TypeError, match="in its own process"):
        pickle.dumps(extend(joint))


@needs_linux
def test_forks_end_with_their_starter(tmp_path: Path) -> None:
    program = f"""
import os, time
from pathlib import Path
from cablecomp.estimation.forked import forked, helping

def work(k):
    if helping():
        Path({str(tmp_path)!r}, "fork").write_text(str(os.getpid()))
    time.sleep(0.3)
    return k

forked(work, range(1000), 2)
"""
    starter = subprocess.Popen([sys.executable, "-c", program])
    told = tmp_path / "fork"
    until = time.monotonic() + 60.0
    while not (told.exists() and told.read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    fork = int(told.read_text())
    starter.kill()
    starter.wait()
    until = time.monotonic() + 10.0
    while _runs(fork) and time.monotonic() < until:
        time.sleep(0.05)
    assert not _runs(fork)


def _runs(process: int) -> bool:
    """Whether it does, and is not just waiting to be taken notice of."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@needs_linux
@pytest.mark.usefixtures("forking")
def test_nobody_is_forked_who_has_not_said_so(tmp_path: Path) -> None:
    def where(k: int) -> int:
        _at_once(k)
        return os.getpid()

    def within(k: int) -> tuple[bool, set[int], int]:
        own = _met(tmp_path, 2)
        return helping(), set(in_processes(where, range(2))), own

    assert set(in_processes(where, range(4))) == {os.getpid()}
    with forks_allowed():
        found = in_processes(within, range(4))
    assert {h: own for h, _, own in found}[False] == os.getpid()
    assert len({own for _, _, own in found}) == 2
    assert all(inner == {own} for _, inner, own in found)  # work within work forks no further
    assert set(in_processes(where, range(4))) == {os.getpid()}


def test_a_process_with_further_threads_is_not_forked() -> None:
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        assert not forkable(2)
    finally:
        done.set()
        other.join()


@needs_linux
@pytest.mark.usefixtures("forking")
def test_a_diagnosis_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    data = {"here": recorded([EffectSpec("termination_backlash", {"gap_rad": 2e-3})], 12.0)}
    with forks_allowed():
        apart = report_json(diagnose(TOLERANT, data))
    monkeypatch.setattr(parallel, "_threads", lambda: 1)
    alone = report_json(diagnose(TOLERANT, data))
    assert alone["missing_physics"]
    apart.pop("runtime_s"), alone.pop("runtime_s")
    assert str(apart) == str(alone)
