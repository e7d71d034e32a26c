"""`python -m firmware_sim.trials.make`: trials with their truth beside them, one folder each, to learn on.

`--seed S --count N [--laws catalogue|other|mixed|latest] [--imperfections none|some|all|vague] [--kinds K,…] --out DIR
[--first F] [--workers W]`. Folder DIR/00000 holds `recordings/…csv.gz`, `joint.toml`, `truth.json` and `truth.npz`.
A trial depends on the seed, its number and what was asked for, not on how many are made.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import as_completed
from pathlib import Path

from firmware_sim.plant import PlantError
from firmware_sim.trials.folder import write_world
from firmware_sim.trials.order import IMPERFECTIONS, KINDS, LAWS, Wanted
from firmware_sim.trials.processes import processes
from firmware_sim.trials.world import draw_world
from firmware_sim.trials.writing import folder_name


def make_one(wanted: Wanted, number: int, out: str) -> int:
    """Draw one trial and write its folder; returns its number."""
    write_world(Path(out) / folder_name(number), draw_world(wanted, number), wanted)
    return number


def make(wanted: Wanted, count: int, out: Path, first: int = 0, workers: int = 1) -> None:
    """Write trials `first` … `first + count − 1` under `out`; those that stand there already are kept.

    Raises PlantError for a count below one or a folder that cannot be made.
    """
    if count < 1 or workers < 1 or first < 0:
        raise PlantError(f"count {count}, first {first}, workers {workers}: at least 1, 0 and 1 are accepted")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlantError(f"{out}: cannot be made ({error.strerror}); give another folder") from None
    numbers = [k for k in range(first, first + count) if not (out / folder_name(k)).exists()]
    done = count - len(numbers)
    if workers == 1:
        for k in numbers:
            make_one(wanted, k, str(out))
            done += 1
            print(f"written {done} of {count}", flush=True)
        return
    with processes(workers) as pool:
        for job in as_completed([pool.submit(make_one, wanted, k, str(out)) for k in numbers]):
            job.result()
            done += 1
            print(f"written {done} of {count}", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, or 2 for bad input (one line on stderr)."""
    parser = argparse.ArgumentParser(prog="python -m firmware_sim.trials.make", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--laws", choices=LAWS, default="mixed")
    parser.add_argument("--imperfections", choices=IMPERFECTIONS, default="some")
    parser.add_argument("--kinds", default="single,pair,none,stranger", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    a = parser.parse_args(arguments)
    try:
        wanted = Wanted(a.seed, tuple(a.kinds.split(",")), a.laws, a.imperfections)
        make(wanted, a.count, a.out, a.first, a.workers)
    except PlantError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
