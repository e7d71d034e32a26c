"""What did not run is said at the end of every run: how many tests, and what they miss. Property tests hold
laws, not times: on a loaded machine an example may take long."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

BENCHMARKS = "Skipping benchmark"  # asked for by pyproject.toml, no lack


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
