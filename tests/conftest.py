"""What did not run is said at the end of every run: how many tests, and what they miss."""

from __future__ import annotations

from collections import Counter

import pytest

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
