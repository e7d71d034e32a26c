"""A disk that takes no more: one line, exit 2, nothing half-written. The limit on file size stands for the disk."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from cablecomp.config import load_joint

RATIO = load_joint("tendon-finger").drive.ratio
ANSWERS = (
    *("output_radius_mm=30", "input_radius_mm=10", "cable=steel-7x7", "cable_diameter_mm=1"),
    *("free_length_mm=200", "output_turns=1", "input_turns=3", "joint_torque_max_Nm=2"),
)
COMMANDS = {
    "replay": ["replay", "a.csv", "--config", "tendon-finger", "--out", "out/replay"],
    "design": ["design", "--config", "tendon-finger", "--out", "out/design"],
    "csv": ["convert", "a.csv", "out.csv"],
    "gzip": ["convert", "a.csv", "out.csv.gz"],
    "parquet": ["convert", "a.csv", "out.parquet"],
    "npz": ["convert", "a.csv", "out.npz"],
    "guide": ["guide", "--html", "guide.html"],
    "inspect": ["inspect", "a.csv", "--save"],
    "example": ["example", "links/wrist-virtual"],
    "init": ["init", *(word for answer in ANSWERS for word in ("--set", answer))],
}
LIMITED = """
import contextlib, io, json, resource, sys
from cablecomp.cli.app import main
commands = json.loads(sys.argv[1])
for name in ("replay", "design"):  # whatever is compiled is compiled now
    main(commands[name][:-1] + ["warm/" + name])
answers = {}
for name, arguments in commands.items():
    out, error = io.StringIO(), io.StringIO()
    most = 200 if name in ("inspect", "example", "init") else 20_000
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = main(arguments)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    answers[name] = [code, error.getvalue()]
print(json.dumps(answers))
"""


def test_no_command_leaves_half_a_file_on_a_full_disk(tmp_path: Path) -> None:
    pytest.importorskip("resource", reason="limits of file size are a thing of POSIX")
    rng = np.random.default_rng(3)
    rows = {
        "time_s": np.arange(4000) * 1e-3,
        "motor_position_rad": 0.1 * np.sin(np.arange(4000) * 0.01),
        "joint_position_rad": RATIO * 0.1 * np.sin(np.arange(4000) * 0.01) + 1e-6 * rng.standard_normal(4000),
        "joint_torque_Nm": 0.1 * np.sin(np.arange(4000) * 0.007),
    }
    pl.DataFrame(rows).write_csv(tmp_path / "a.csv")
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, json.dumps(COMMANDS)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=900,
        check=True,
    )
    for name, (code, error) in json.loads(done.stdout.splitlines()[-1]).items():
        assert code == 2, name
        said = [line for line in error.splitlines() if "seems to" not in line]  # of the recording
        assert len(said) == 1, error
        assert "cannot be written" in said[0], (name, error)
    left = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if not p.match("warm*"))
    assert [p for p in left if not p.startswith("warm/")] == ["a.csv"]


def test_a_closed_pipe_and_a_full_standard_output_end_without_a_traceback() -> None:
    info = [sys.executable, "-m", "cablecomp.cli", "example"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(info, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "cablecomp: output: No space left on device; free some space or choose another place"
    ]
