"""Checks everything, in order: format, lint, types, import contracts, tests (by two workers); stops at the first
failure.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOOLS = Path(sys.executable).parent  # of the virtual environment that runs this
CHECKS = (
    ("ruff", "format", "--check", "."),
    ("ruff", "check", "."),
    ("mypy", "-n", "2"),
    ("lint-imports",),
    ("pytest", "-n", "2", "--durations=15"),
)


def main() -> int:
    """Run every check from the project's root; the exit code is that of the first that failed, or 0."""
    for check in CHECKS:
        print(f"== {' '.join(check)}", flush=True)
        begin = time.monotonic()
        code = subprocess.run([TOOLS / check[0], *check[1:]], cwd=ROOT, check=False).returncode
        print(
            f"== {check[0]}: {'passed' if code == 0 else f'FAILED (exit code {code})'} "
            f"in {time.monotonic() - begin:.0f} s",
            flush=True,
        )
        if code != 0:
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
