"""Random joints driven hard by kernels that look at each of their indices: compiled for this alone, and kept beside the
others, as they take ten seconds."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from cablecomp.mechanics.jit import CACHE

NIGHTLY = Path(__file__).with_name("kernels_nightly.py")
CHECKED = CACHE.parents[1] / "cablecomp-checked"


def test_no_index_of_the_kernels_leaves_its_array() -> None:
    command = [sys.executable, str(NIGHTLY), "--joints", "40", "--samples", "60", "--plain", "--seed", "0"]
    done = subprocess.run(
        [*command, "--cache", str(CHECKED)], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"40 joints took (\d+) samples and refused (\d+); 0 broke", done.stdout)
    assert found, done.stdout
    assert int(found[1]) > 1000
    assert int(found[2]) > 300
