"""The first use of a version on a machine: the kernels of the bounds, half of all, are compiled by a process of their
own beside the others.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import tomllib
from contextlib import suppress
from pathlib import Path

from cablecomp.config import JointConfig, parse_joint
from cablecomp.config_text import joint_text
from cablecomp.effects.catalogue import is_bounded, other_channels
from cablecomp.errors import InputError
from cablecomp.mechanics.jit import CACHE, is_compiled
from cablecomp.observer.observer import Observer
from cablecomp.signals import Sample


def compile_first(config: JointConfig, bounds: bool) -> None:
    """Have what a joint's replay calls compiled and kept on disk, unless it is; the process beside may fail, its part
    is compiled later then."""
    if is_compiled("step_rows") and (not bounds or is_compiled("bounds_step")):
        return
    with tempfile.TemporaryDirectory() as folder:
        beside = _beside(config, Path(folder)) if bounds and is_bounded(config) else None
        try:
            with suppress(InputError):  # a joint that cannot stand still says so of its recording
                Observer(config).step(_still(config))
            if beside is not None and beside.wait() == 0:
                _take_over(Path(folder) / CACHE.parent.name / CACHE.name)
        finally:
            if beside is not None:
                beside.kill()
                beside.wait()


def _beside(config: JointConfig, folder: Path) -> subprocess.Popen[bytes]:
    """A process that compiles the bounds into a cache in `folder`: two processes that wrote into one could take each
    other's machine code for theirs."""
    path = folder / "joint.toml"
    path.write_text(joint_text(config), encoding="utf-8")
    return subprocess.Popen(
        [sys.executable, "-m", __name__, str(path)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _take_over(made: Path) -> None:
    """Move the machine code of functions that the cache lacks into it, each function's index last."""
    for index in sorted(made.rglob("*.nbi")):
        home = CACHE / index.parent.relative_to(made)
        if (home / index.name).exists():
            continue
        home.mkdir(parents=True, exist_ok=True)
        for code in [*index.parent.glob(f"{index.stem}.*.nbc"), index]:
            (home / code.name).write_bytes(code.read_bytes())


def _still(config: JointConfig) -> Sample:
    return Sample(0.0, 0.0, 0.0, 0.0, config.motor_zero_Nm, 0.0, (0.0,) * len(other_channels(config)))


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as file:
        Observer(parse_joint(tomllib.load(file), "joint"), bounds=True).compile_bounds()
