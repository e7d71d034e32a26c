"""`python -m firmware_sim.trials`: write blind trials with sealed truths, or run an experiment on a sealed joint.

Trials: `--trials N --seed S --out DIR [--kinds K,…] [--laws L] [--imperfections I] [--workers W]`; progress is
printed as `written K of N`, then `sha256 HEX`. Experiment: `experiment --sealed FILE --protocol FILE --out FILE
[--seed S]`. `python -m firmware_sim.trials.make` makes the same trials with their truth beside them, to learn on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_sim.plant import PlantError
from firmware_sim.starter import parsed
from firmware_sim.trials.experiment import run_experiment
from firmware_sim.trials.generate import generate
from firmware_sim.trials.order import IMPERFECTIONS, KINDS, LAWS, Wanted


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, or 2 for bad input (one line on stderr)."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        return _experiment(given[1:]) if given[:1] == ["experiment"] else _trials(given)
    except PlantError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def _trials(given: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m firmware_sim.trials", description=__doc__)
    parser.add_argument("--trials", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--kinds", default="single,pair,none,stranger", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--laws", default="mixed", help=", ".join(LAWS))
    parser.add_argument("--imperfections", default="some", help=", ".join(IMPERFECTIONS))
    parser.add_argument("--workers", type=int, default=2)
    a = parsed(parser, given)

    def tell(done: int, total: int) -> None:
        print(f"written {done} of {total}", flush=True)

    wanted = Wanted(a.seed, tuple(a.kinds.split(",")), a.laws, a.imperfections)
    print(f"sha256 {generate(wanted, a.trials, a.out, a.workers, tell)}", flush=True)
    return 0


def _experiment(given: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m firmware_sim.trials experiment")
    parser.add_argument("--sealed", type=Path, required=True)
    parser.add_argument("--protocol", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    a = parsed(parser, given)
    print(run_experiment(a.sealed, a.protocol, a.out, a.seed))
    return 0


if __name__ == "__main__":
    sys.exit(main())
