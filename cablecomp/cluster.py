"""Independent jobs side by side: in processes of this machine, or on a Dask cluster (extra `[cluster]`)."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context, parent_process
from socket import create_connection
from threading import Thread
from typing import Any, Final, Generic, TypeVar

from cablecomp.errors import CablecompError, ConfigError, InputError, printable

R = TypeVar("R")

THREADS: Final = "OMP_NUM_THREADS"
"""What tells a process how many threads it may use: heeded by `estimation.parallel`, and by NumPy's libraries."""
CONNECT_S: Final = 10.0
"""How long a scheduler is waited for; one that is there answers in milliseconds."""


@dataclass(frozen=True)
class Workers:
    """Where jobs are done: `processes` of this machine (0: here and now), or the cluster of a Dask `scheduler`.

    A cluster's workers need this package in the same version, and every path that a job names.
    """

    processes: int = 2
    scheduler: str | None = None


@dataclass(frozen=True)
class Done(Generic[R]):
    """What came of job number `job`: its `result`, or in `failed` one line that says why there is none."""

    job: int
    result: R | None
    failed: str = ""


def spread(
    work: Callable[..., R], jobs: Sequence[tuple[Any, ...]], workers: Workers
) -> Generator[Done[R], None, None]:
    """Call `work(*job)` for every job; outcomes in the order in which they come.

    A job that raises, or whose process dies, is an outcome like others: it stops no other job. `work` is a function of
    a module, what it takes and returns can be pickled. Once closed, it begins nothing more. Raises InputError where the
    scheduler does not answer or goes, and where its workers cannot read the jobs: what is not told then is not done.
    """
    if workers.scheduler is not None:
        yield from _on_cluster(work, jobs, workers.scheduler)
    elif workers.processes == 0:
        yield from (Done(k, *_told(work, job)) for k, job in enumerate(jobs))
    else:
        yield from _in_processes(work, jobs, workers.processes)


def _told(work: Callable[..., R], job: tuple[Any, ...]) -> tuple[R | None, str]:
    """Result, or what went wrong: an exception need not survive the way back to the caller."""
    try:
        return work(*job), ""
    except ConfigError as error:
        return None, "; ".join(error.lines)
    except CablecompError as error:
        return None, printable(str(error))
    except Exception as error:  # whatever it is, it is this job's own failure
        return None, printable(f"{type(error).__name__}: {error}")


def _in_processes(
    work: Callable[..., R], jobs: Sequence[tuple[Any, ...]], processes: int
) -> Iterator[Done[R]]:
    """A process that dies takes its pool along: what was worked on is then done one by one, to find whose fault it was,
    and the rest side by side again. A pool is handed no more than it works on: what it has it does, also after its
    user has gone."""
    left = dict(enumerate(jobs))
    suspects: list[int] = []
    while left:
        count = 1 if suspects else min(processes, len(left))
        waiting = iter(suspects or list(left))
        begun = []
        with _pool(count) as pool, suppress(BrokenProcessPool):
            running: dict[Future[tuple[R | None, str]], int] = {}
            for k in islice(waiting, count):
                running[pool.submit(_told, work, left[k])] = k
                begun.append(k)
            # who watches the pool's processes looks for new ones as work is handed in, before it starts one for it
            pool.submit(int)
            while running:
                finished = next(iter(wait(running, return_when=FIRST_COMPLETED).done))
                number, (result, failed) = running.pop(finished), finished.result()
                del left[number]
                yield Done(number, result, failed)
                for k in islice(waiting, 1):
                    running[pool.submit(_told, work, left[k])] = k
                    begun.append(k)
        died = [k for k in begun if k in left]
        if died and count == 1:
            del left[died[0]]
            yield Done(died[0], None, "its process died (out of memory?)")
        suspects = [k for k in suspects or died if k in left]


@contextmanager
def _pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """A pool that starts nothing more once its user has gone. Its processes share the cores: with as many threads in
    each as there are cores they would wait for each other."""
    stated = THREADS in os.environ
    if not stated:
        os.environ[THREADS] = str(max(1, (os.cpu_count() or 1) // processes))
    pool = ProcessPoolExecutor(processes, get_context("spawn"), _end_with_its_starter)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        if not stated:
            os.environ.pop(THREADS, None)


def _end_with_its_starter() -> None:
    """Have this process end when the one that started it has died: no pipe tells it, a pool's processes hold the other
    end of theirs themselves."""
    starter = parent_process()

    def watch() -> None:
        if starter is not None:
            starter.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def _on_cluster(work: Callable[..., R], jobs: Sequence[tuple[Any, ...]], address: str) -> Iterator[Done[R]]:
    try:
        from distributed import CancelledError, Client, KilledWorker
        from distributed import as_completed as completed
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install 'cablecomp[cluster]'") from None
    try:
        scheme, place = parse_address(address)
        if scheme not in ("tcp", "tls"):
            raise ValueError("tcp://HOST:PORT and tls://HOST:PORT are accepted")
        # a client that gets no answer would be waited for once more as it goes
        create_connection(parse_host_port(place), CONNECT_S).close()
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        words = str(error).partition("\n")[0]
        raise InputError(f"--scheduler {address}: no Dask scheduler answers there ({words})") from None
    logging.getLogger("distributed.client").setLevel(
        logging.CRITICAL
    )  # a scheduler that goes is told of below
    with client, client.as_current():
        running = {client.submit(_told, work, job, pure=False): k for k, job in enumerate(jobs)}
        for finished in completed(running):
            try:
                result, failed = finished.result()
            except KilledWorker as error:  # one worker after the other died of this job
                result, failed = None, printable(f"KilledWorker: {error}")
            except CancelledError:  # no job's fault: what is left is not done, and not failed
                raise InputError(
                    f"--scheduler {address}: the Dask scheduler has gone, or dropped the work; start it anew, "
                    "the same command again goes on"
                ) from None
            except Exception as error:  # nor this: whatever a job raises is told by `_told`
                why = printable(f"{type(error).__name__}: {error}")
                raise InputError(
                    f"--scheduler {address}: its workers cannot do this work ({why}); "
                    "install this version of cablecomp for them, the same command again goes on"
                ) from None
            yield Done(running[finished], result, failed)
