"""What did not run is said at the end of every run: how many tests, and what they miss. Property tests hold
laws, not times: on a loaded machine an example may take long. Two workers (`pytest -n 2`) share the files, the longest
first; what runs in real time stays with one of them.
"""

from __future__ import annotations

import gc
import os
from collections import Counter
from typing import Any

import pytest
from hypothesis import settings

# the workers share the cores; threads of each, of linear algebra or of fits side by side, would only wait
for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

BENCHMARKS = "Skipping benchmark"  # asked for by pyproject.toml, no lack

LIVE = (  # in real time, or by processes and ports
    "tests/firmware_sim/test_sim_p",
    "tests/firmware_sim/test_sim_third_party.py",
    "tests/links/test_can_fd.py",
    "tests/links/test_foreign_frames.py",
    "tests/links/test_line_ports.py",
    "tests/links/test_link_ports.py",
    "tests/runtime/",
    "tests/system/test_ways_out.py",
)
FIRST = (  # while one worker compiles the kernels, the other tests what needs none; then the longest
    "tests/diagnosis/test_diagnose.py",
    ("tests/thesis/test_bench_evaluation.py", "tests/thesis/test_closed_forms", "tests/report/test_theory"),
    "tests/golden/",
    "tests/observer/test_bounds.py",
    LIVE,
    ("tests/system/", "tests/guide/", "tests/diagnosis/", "tests/observer/", "tests/firmware_sim/"),
    ("tests/report/", "tests/thesis/", "tests/trials/"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest first, so that two workers end together."""

    def place(item: pytest.Item) -> int:
        return next((k for k, begin in enumerate(FIRST) if item.nodeid.startswith(begin)), len(FIRST))

    items.sort(key=place)


def pytest_collection_finish() -> None:
    """What is loaded by now stays: the garbage collector need not look through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """By files, whose fixtures then are made once; all that runs in real time counts as one file."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return "live" if file.startswith(LIVE) else file

    config.option.loadscopereorder = False  # in the order of FIRST
    return ByFile(config, log)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One line for each reason to skip, with its count."""
    reasons = Counter(
        report.longrepr[2].removeprefix("Skipped: ")
        for report in terminalreporter.stats.get("skipped", ())
        if isinstance(report.longrepr, tuple)
    )
    for reason, count in reasons.most_common():
        if not reason.startswith(BENCHMARKS):
            terminalreporter.write_line(f"not run: {count} tests: {reason}", yellow=True)
