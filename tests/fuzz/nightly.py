"""Fuzz every reader and decoder for minutes: `python tests/fuzz/nightly.py --minutes 10 [--target recording]`.

Coverage-guided by atheris where it is installed (`pip install atheris`), by seeded mutations elsewhere. What
breaks is kept in `--out` (default `out/fuzz`), and the exit code is 1; put it into `corpus` once it is mended.
"""

from __future__ import annotations

import argparse
import importlib.util
import random
import shutil
import subprocess
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORPUS = HERE / "corpus"


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz the targets one after the other; returns 1 if one of them broke."""
    known = sorted(path.name for path in CORPUS.iterdir())
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="for all targets together")
    parser.add_argument("--target", action="append", choices=known)
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--guided", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args(arguments)
    names = asked.target or known
    if asked.guided:
        return guided(names[0], asked.minutes * 60.0, asked.out, asked.seed)
    each_s = asked.minutes * 60.0 / len(names)
    with_atheris = importlib.util.find_spec("atheris") is not None
    broken = []
    for name in names:
        begin = time.monotonic()
        if with_atheris:
            command = [
                sys.executable,
                str(HERE / "nightly.py"),
                "--guided",
                "--target",
                name,
                "--out",
                str(asked.out),
            ]
            command += ["--minutes", str(each_s / 60.0), "--seed", str(asked.seed)]
            fine = subprocess.run(command, check=False).returncode == 0
        else:
            fine = unguided(name, each_s, asked.out, asked.seed)
        print(f"{name}: {'fine' if fine else 'BROKEN'} after {time.monotonic() - begin:.0f} s", flush=True)
        broken += [] if fine else [name]
    return 1 if broken else 0


def unguided(name: str, seconds: float, out: Path, seed: int) -> bool:
    """Mutate the corpus at random; False, and the input kept, at the first that breaks the target."""
    from fuzz_targets import TARGETS
    from mutate import mutated

    random_ = random.Random(seed)
    seeds = [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        data = mutated(random_.choice(seeds), random_)
        try:
            TARGETS[name](data)
        except Exception:
            traceback.print_exc()
            out.mkdir(parents=True, exist_ok=True)
            (out / f"{name}-{seed}").write_bytes(data)
            return False
    return True


def guided(name: str, seconds: float, out: Path, seed: int) -> int:
    """Run atheris (libFuzzer) on one target; it ends the process itself."""
    import atheris

    with atheris.instrument_imports(include=["cablecomp", "can.io", "tomllib", "rosbags"]):
        from fuzz_targets import TARGETS

    fresh = out / f"corpus-{name}"
    fresh.mkdir(parents=True, exist_ok=True)
    options = [
        f"-max_total_time={max(int(seconds), 1)}",
        f"-seed={seed & 0x7FFFFFFF}",
        "-timeout=30",
        "-rss_limit_mb=3000",
    ]
    options += [f"-artifact_prefix={out}/{name}-", "-max_len=16384", "-verbosity=0", "-print_final_stats=1"]
    atheris.Setup([sys.argv[0], *options, str(fresh), str(CORPUS / name)], TARGETS[name])
    try:
        atheris.Fuzz()
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(HERE))
    sys.exit(main())
