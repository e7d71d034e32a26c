"""A blind run on a Dask cluster of processes: one worker killed in mid-run costs nothing, and the run goes on
where it stopped."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest

from cablecomp.cluster import Workers
from cablecomp.trials.run import Job, Place, diagnose_all, verdict_of

distributed = pytest.importorskip("distributed", reason="Dask is not installed")
TRIALS = 12


def diagnose(folder: Path, further: Sequence[Path], out: Path) -> None:
    """Writes a verdict; the first worker that meets trial 3 dies of it, as of memory that ran out."""
    with (out.parent / f"{folder.name}.begun").open("a") as file:
        file.write(f"{os.getpid()}\n")
    killed = out.parent / "killed"
    if folder.name == "00003" and not killed.exists():
        killed.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    (out / "diagnosis.json").write_text(json.dumps({"trial": int(folder.name)}))


def test_a_killed_worker_loses_nothing(tmp_path: Path) -> None:
    places = [Place(tmp_path, k) for k in range(TRIALS)]
    jobs: list[Job] = [(diagnose, p.public, (), p.verdict) for p in places]
    told: list[tuple[int, int]] = []
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
    ) as cluster:
        by = Workers(scheduler=cluster.scheduler_address)
        diagnose_all(jobs[:5], by, "diagnosing", lambda what, done, of: told.append((done, of)))
        diagnose_all(jobs, by, "diagnosing", lambda what, done, of: told.append((done, of)))
    assert (tmp_path / "verdicts" / "killed").exists()
    for p in places:
        found = verdict_of(p.verdict)
        assert found.said == {"trial": p.number}
        begun = (tmp_path / "verdicts" / f"{p.number:05d}.begun").read_text().split()
        assert len(begun) <= 2
        if p.number == 3:
            assert len(set(begun)) == 2  # once more, elsewhere
    assert told[5:7] == [(5, 5), (5, TRIALS)]  # what had a verdict was not done again
    assert told[-1] == (TRIALS, TRIALS)
