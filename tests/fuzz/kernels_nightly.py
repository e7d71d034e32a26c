"""Drive random joints without mercy for minutes, with every index of the kernels checked:
`python tests/fuzz/kernels_nightly.py --minutes 30`, and with tests after it, those too: `… -- tests/observer`.

The checked kernels are compiled into a cache of their own (minutes, once). Exit code 1 where an index leaves its array,
a state breaks an invariant, or a refusal leaves its mark; the seed is said.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main(arguments: Sequence[str] | None = None) -> int:
    """Start this script anew with checked kernels, then the tests asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--cache", type=Path, default=Path("out/kernels-checked"))
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("tests", nargs="*")
    asked = parser.parse_args(arguments)
    if asked.here:
        return fuzz(asked.minutes, asked.seed)
    checked = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(asked.cache.resolve())}
    again = [sys.executable, __file__, "--here", "--minutes", str(asked.minutes), "--seed", str(asked.seed)]
    tests = [sys.executable, "-m", "pytest", *asked.tests]
    for command in (again, tests) if asked.tests else (again,):
        if subprocess.run(command, cwd=ROOT, env=checked, check=False).returncode != 0:
            return 1
    return 0


def fuzz(minutes: float, seed: int) -> int:
    """Random joints one after the other, each by a seed of its own."""
    sys.path[:0] = [str(ROOT / part) for part in (".", "tests/observer", "tests/shared")]
    import numpy as np
    from random_joints import drive_hard, random_joint

    end = time.monotonic() + 60.0 * minutes
    joints = accepted = 0
    while time.monotonic() < end:
        rng = np.random.default_rng(seed + joints)
        try:
            accepted += drive_hard(random_joint(rng), rng, 200).accepted
        except Exception as error:
            print(f"seed {seed + joints}: {type(error).__name__}: {error}", flush=True)
            return 1
        joints += 1
    print(f"{joints} joints took {accepted} samples")
    return 0


if __name__ == "__main__":
    sys.exit(main())
