"""Jobs side by side: all are done, none stops another, wherever they are done."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest

from cablecomp.cluster import Done, Workers, spread
from cablecomp.errors import ConfigError, InputError


def square(x: int) -> int:
    """x²; raises, dies or says what is wrong with its input where it is asked to."""
    if x == 3:
        raise ZeroDivisionError("three")
    if x == 4:
        raise InputError("four.csv: is empty")
    if x == 5:
        os._exit(1)
    return x * x


def outcomes(numbers: tuple[int, ...], workers: Workers) -> dict[int, Done[int]]:
    """Each number's outcome; none is told twice."""
    done = list(spread(square, [(x,) for x in numbers], workers))
    assert sorted(d.job for d in done) == list(range(len(numbers)))
    return {numbers[d.job]: d for d in done}


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """Address of a Dask cluster in threads of this process."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        protocol="tcp://",
    ) as cluster:
        yield cluster.scheduler_address


def test_one_failure_stops_nothing() -> None:
    done = outcomes((1, 2, 3, 4, 6), Workers(0))
    assert {x: d.result for x, d in done.items() if not d.failed} == {1: 1, 2: 4, 6: 36}
    assert done[3].failed == "ZeroDivisionError: three"
    assert done[4].failed == "four.csv: is empty"


def missing(path: str) -> None:
    """Says what is wrong with a configuration and where, in more than one line."""
    raise ConfigError([f"{path}: missing key `name`", f"{path}: missing key `drive`"])


def test_what_is_wrong_with_a_job_is_one_line() -> None:
    (done,) = spread(missing, [("a\nb.toml",)], Workers(0))
    assert done.failed == "a b.toml: missing key `name`; a b.toml: missing key `drive`"


def threads(_: int) -> int:
    """How many threads fits would be done in here."""
    from cablecomp.estimation.parallel import side_by_side

    return len(set(side_by_side(lambda k: (time.sleep(0.05), threading.get_ident())[1], range(8))))


def test_processes_share_the_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    assert [d.result for d in spread(threads, [(0,), (1,)], Workers(2))] == [1, 1]
    assert "OMP_NUM_THREADS" not in os.environ
    assert [d.result for d in spread(threads, [(0,)], Workers(1))] == [min(2, threads(0))]
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert threads(0) == 1


def test_a_process_that_dies_fails_alone() -> None:
    done = outcomes((1, 5, 2, 3, 6), Workers(2))
    assert {x: d.result for x, d in done.items() if not d.failed} == {1: 1, 2: 4, 6: 36}
    assert "died" in done[5].failed
    assert done[3].failed == "ZeroDivisionError: three"


def meeting(folder: str, part: str) -> int:
    """How many processes met in a folder; one part dies while the other waits, once."""
    begun = Path(folder, "begun")
    if part == "die":
        written(begun)
        os._exit(1)
    if part == "wait" and not begun.exists():
        begun.write_text("once", encoding="utf-8")
        time.sleep(600.0)
    if part == "meet":
        Path(folder, f"met-{os.getpid()}").touch()
        end = time.monotonic() + 60.0
        while len(list(Path(folder).glob("met-*"))) < 2 and time.monotonic() < end:
            time.sleep(0.05)
    return len(list(Path(folder).glob("met-*")))


def test_after_a_process_that_died_the_rest_is_done_side_by_side_again(tmp_path: Path) -> None:
    parts = ("die", "wait", "meet", "meet")
    done = {d.job: d for d in spread(meeting, [(str(tmp_path), part) for part in parts], Workers(2))}
    assert "died" in done[0].failed
    assert [done[k].result for k in (1, 2, 3)] == [0, 2, 2]


def mark(folder: str, number: int) -> None:
    """Leaves a file behind."""
    Path(folder, str(number)).touch()


def test_who_goes_after_the_first_outcome_leaves_the_rest_undone(tmp_path: Path) -> None:
    outcomes = spread(mark, [(str(tmp_path), k) for k in range(6)], Workers(1))
    assert next(outcomes).job == 0
    outcomes.close()
    assert [p.name for p in tmp_path.iterdir()] == ["0"]


def test_a_cluster_does_the_same(scheduler: str) -> None:
    done = outcomes((1, 2, 3, 4, 6), Workers(scheduler=scheduler))
    assert {x: (d.result, d.failed) for x, d in done.items()} == {
        x: (d.result, d.failed) for x, d in outcomes((1, 2, 3, 4, 6), Workers(0)).items()
    }


@pytest.mark.parametrize("address", ["nowhere", "carrier-pigeon://127.0.0.1:1"])
def test_no_scheduler_there_is_one_line(address: str) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed")
    with pytest.raises(InputError, match=r"no Dask scheduler answers there") as caught:
        list(spread(square, [(1,)], Workers(scheduler=address)))
    assert "\n" not in str(caught.value)


def local_cluster(place: str) -> None:
    """Be a Dask cluster that works in threads of this process, and write its address."""
    import distributed

    with distributed.LocalCluster(
        n_workers=1, processes=False, dashboard_address="127.0.0.1:0", host="127.0.0.1", protocol="tcp://"
    ) as cluster:
        Path(place).write_text(cluster.scheduler_address, encoding="utf-8")
        time.sleep(600.0)


@pytest.fixture
def mortal(tmp_path: Path) -> Iterator[tuple[BaseProcess, str]]:
    """A Dask cluster that is a process, and its address."""
    pytest.importorskip("distributed", reason="Dask is not installed")
    cluster = get_context("spawn").Process(target=local_cluster, args=(str(tmp_path / "address"),))
    cluster.start()
    yield cluster, written(tmp_path / "address")
    cluster.kill()
    cluster.join()


def test_a_scheduler_that_goes_makes_no_job_fail(
    mortal: tuple[BaseProcess, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    cluster, address = mortal
    outcomes = spread(
        sleeping, [(str(tmp_path / "pid"),), (str(tmp_path / "next"),)], Workers(scheduler=address)
    )
    threading.Thread(target=lambda: (written(tmp_path / "pid"), cluster.kill()), daemon=True).start()
    with pytest.raises(InputError, match=r"has gone, .* the same command again goes on"):
        next(outcomes)
    assert "Traceback" not in capfd.readouterr().err


class Elsewhere:
    """What only this process can make."""

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return import_module, ("cablecomp.of_another_version",)


def test_workers_that_cannot_read_a_job_make_none_fail(mortal: tuple[BaseProcess, str]) -> None:
    with pytest.raises(InputError, match="its workers cannot do this work") as caught:
        list(spread(square, [(Elsewhere(),), (2,)], Workers(scheduler=mortal[1])))
    assert str(caught.value).isprintable()


def written(place: Path) -> str:
    """What somebody writes there, once it is."""
    end = time.monotonic() + 60.0
    while not (place.exists() and place.read_text(encoding="utf-8")) and time.monotonic() < end:
        time.sleep(0.05)
    return place.read_text(encoding="utf-8")


def sleeping(place: str) -> None:
    """Say who this is, and sleep far longer than the test."""
    Path(place).write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(600.0)


def test_processes_end_with_a_starter_that_is_killed(tmp_path: Path) -> None:
    said = tmp_path / "pid"
    starter = get_context("spawn").Process(target=start_sleeping, args=(str(said),))
    starter.start()
    worker = int(written(said))
    starter.kill()
    starter.join()
    end = time.monotonic() + 60.0
    while lives(worker) and time.monotonic() < end:
        time.sleep(0.05)
    assert not lives(worker)


def start_sleeping(place: str) -> None:
    """One job in a process of its own."""
    list(spread(sleeping, [(place,)], Workers(1)))


def lives(process: int) -> bool:
    """Whether there is such a process, and it is more than one that nobody has buried."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")
    return not (stat.exists() and stat.read_text(encoding="utf-8").rpartition(")")[2].split()[0] == "Z")
