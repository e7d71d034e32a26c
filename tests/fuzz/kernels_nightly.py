"""Drive random joints without mercy for minutes, with every index of the kernels checked:
`python tests/fuzz/kernels_nightly.py --minutes 30`, and with tests after it, those too: `… -- tests/observer`. By
number in place of time, and with soft cables alone (0.1 to 10 % of strain): `--joints 4000 --soft`. Every check of the
project runs forty joints of it without effects (`--joints 40 --plain`: `test_checked_kernels.py`).

The checked kernels are compiled into a cache of their own (ten seconds, with effects half a minute). Exit code 1 where
an index leaves its array, a state breaks an invariant, or a refusal leaves its mark; the seed is said.
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
    parser.add_argument("--joints", type=int, help="end after so many, in place of --minutes")
    parser.add_argument("--soft", action="store_true", help="strains under pretension of 0.1 to 10 %%")
    parser.add_argument(
        "--plain", action="store_true", help="no effects, whose kernels take longest to compile"
    )
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--samples", type=int, default=200, help="that each joint is driven by")
    parser.add_argument("--cache", type=Path, default=Path("out/kernels-checked"))
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("tests", nargs="*")
    asked = parser.parse_args(arguments)
    if asked.here:
        return fuzz(asked)
    checked = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(asked.cache.resolve())}
    again = [sys.executable, __file__, "--here", "--minutes", str(asked.minutes), "--seed", str(asked.seed)]
    again += ["--samples", str(asked.samples)]
    again += [] if asked.joints is None else ["--joints", str(asked.joints)]
    again += [f"--{name}" for name in ("soft", "plain") if getattr(asked, name)]
    tests = [sys.executable, "-m", "pytest", *asked.tests]
    for command in (again, tests) if asked.tests else (again,):
        if subprocess.run(command, cwd=ROOT, env=checked, check=False).returncode != 0:
            return 1
    return 0


def checks_indices() -> bool:
    """Whether a kernel of the project's own that goes one place beyond its array says so."""
    import numpy as np

    from cablecomp.mechanics.jit import kernel

    @kernel
    def beyond(values: np.ndarray) -> float:
        return float(values[len(values)])

    try:
        beyond(np.zeros(3))
    except IndexError:
        return True
    return False


def fuzz(asked: argparse.Namespace) -> int:
    """Random joints one after the other, each by a seed of its own; returns 1 if one of them broke."""
    sys.path[:0] = [str(ROOT / part) for part in (".", "tests/observer", "tests/shared")]
    if not checks_indices():
        print(
            "the kernels are compiled without looking at their indices: NUMBA_BOUNDSCHECK does nothing here"
        )
        return 1
    import numpy as np
    from random_joints import ANY_STRAIN, SOFT_STRAIN, Taken, drive_hard, random_joint

    strain = SOFT_STRAIN if asked.soft else ANY_STRAIN
    end = time.monotonic() + 60.0 * asked.minutes
    total, joints, broken = Taken(0, 0), 0, 0
    while joints < asked.joints if asked.joints is not None else time.monotonic() < end:
        seed = asked.seed + joints
        rng = np.random.default_rng(seed)
        try:
            taken = drive_hard(random_joint(rng, not asked.plain, strain), rng, asked.samples)
            total = Taken(total.accepted + taken.accepted, total.refused + taken.refused)
        except Exception as error:
            print(f"seed {seed}: {type(error).__name__}: {error}", flush=True)
            broken += 1
        joints += 1
    print(f"{joints} joints took {total.accepted} samples and refused {total.refused}; {broken} broke")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
