"""`python -m firmware_sim.conceal --in PIECES --seed S [--physics A,B…] --out DIR`: conceal physics in pieces of
recordings, seal the truth.

PIECES/00000 holds `recording-1.npz`, … (canonical channels) of the first round and the `joint.toml` that goes along
into the folders DIR/trials/00000, … of its trials, and so on; what is true of a trial is sealed in
DIR/sealed/00000.zip. Prints `written K of N`, then `sha256 HEX` of all seals.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from firmware_sim.conceal.physics import Table
from firmware_sim.conceal.plan import Trial, trials_of, usable
from firmware_sim.errors import SimError
from firmware_sim.starter import parsed
from firmware_sim.trials.seal import SEALED, TRUTH, digest, truth_text, write_seal

JOINT_FILE = "joint.toml"


def conceal(pieces: Path, seed: int, out: Path, only: Sequence[str] = ()) -> str:
    """Write all trials and the seal; returns the seal's SHA-256. Raises SimError for a folder without pieces, or an
    unknown physics."""
    folders = sorted(p for p in pieces.iterdir() if p.is_dir())
    tables = [_read(f) for f in folders]
    if not tables or not all(usable(t) for t in tables):
        raise SimError(f"{pieces}: holds no piece with a joint_position_rad in every recording")
    joints = [(f / JOINT_FILE).read_text(encoding="utf-8") for f in folders]
    trials, missing = trials_of(tables, seed, only)
    for k, trial in enumerate(trials, start=1):
        name = f"{trial.number:05d}"
        _write(out / "trials" / name, trial, joints[trial.round])
        write_seal(out / SEALED / f"{name}.zip", {TRUTH: truth_text(trial.truth())})
        print(f"written {k} of {len(trials)}", flush=True)
    for physics, why in missing.items():
        print(f"left out {physics}: {why}", flush=True)
    return digest(out / SEALED)


def _read(folder: Path) -> list[Table]:
    found = []
    for path in sorted(folder.glob("recording-*.npz")):
        with np.load(path) as data:
            found.append({name: np.asarray(data[name], dtype=np.float64) for name in data.files})
    return list(found)


def _write(folder: Path, trial: Trial, joint: str) -> None:
    (folder / "recordings").mkdir(parents=True, exist_ok=True)
    (folder / JOINT_FILE).write_text(joint, encoding="utf-8")
    for k, table in enumerate(trial.recordings, start=1):
        path = folder / "recordings" / f"recording-{k}.npz"
        # numpy's stub takes `**` for `allow_pickle`, a bool
        np.savez(path, **table)  # type: ignore[arg-type]  # numpy's stub: a name may be a flag


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, or 2 for bad input (one line on stderr)."""
    parser = argparse.ArgumentParser(prog="python -m firmware_sim.conceal", description=__doc__)
    parser.add_argument("--in", dest="pieces", type=Path, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--physics", default="", help="these alone, by their ids, with commas between")
    parser.add_argument("--out", type=Path, required=True)
    a = parsed(parser, arguments)
    only = [name.strip() for name in a.physics.split(",") if name.strip()]
    try:
        print(f"sha256 {conceal(a.pieces, a.seed, a.out, only)}", flush=True)
    except (SimError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
