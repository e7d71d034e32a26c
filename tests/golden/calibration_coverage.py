"""How often the truth lies within what `cablecomp calibrate` says: simulated joints off their nominal values, each run
through the calibration protocol behind its bus, calibrated, compared with what the plant was given.

    python tests/golden/calibration_coverage.py --joints 20

Motor, link, bus and sensors are those of the demonstration; the plant shares no equation with the observer.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint, read_toml
from cablecomp.control.motors import control_for
from cablecomp.control.options import FeedForward, load_control
from cablecomp.control.standard import calibration_protocol
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.examples import example
from cablecomp.links.load import load_link
from cablecomp.recording.reader import read_all
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched, same_joint
from cablecomp.runtime.simulated import SimulationWish
from firmware_sim.hosted import OFF_NOMINAL, off_nominal
from firmware_sim.plant import PlantConfig

JOINTS = ("wrist-capstan", "capstan-arm")


def deviations(name: str, seed: int) -> dict[str, float]:
    """Found less true over the stated sd, by parameter; NaN where the calibration says that it does not know."""
    path = example("joints", name)
    joint = load_joint(path)
    control = load_control(example("control", name)) if name == "wrist-capstan" else control_for(joint)
    bus, control = matched(load_link("wrist-virtual"), control, own_link=False)
    bus = same_joint(bus, [joint.name])
    alone = control.compensator.model_copy(update={"feed_forward": FeedForward.NONE})
    control = control.model_copy(update={"compensator": alone})
    with tempfile.TemporaryDirectory() as folder:
        simulation = start_simulation(path, SimulationWish(bus, control, 1, True, seed))
        try:
            options = RunOptions(stepped=True, out=Path(folder) / "run")
            run_joint(joint, bus, control, calibration_protocol(joint), options, simulation)
        finally:
            simulation.close()
        columns = read_all(Path(folder) / "run" / "recording.csv").columns
    found = calibrate(joint, {"calibration": columns})
    data = read_toml(path)
    true = off_nominal(PlantConfig.from_dict(data, name), data["tolerance"], seed).stages[0]
    known = {v.name: v for v in found.values}
    return {
        k: (known[k].value - getattr(true, k)) / known[k].sd if k in known else math.nan for k in OFF_NOMINAL
    }


def main() -> None:
    """Print a line for each joint, then the shares within one and two sd."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--joints", type=int, default=20)
    parser.add_argument("--seed", type=int, default=100, help="of the first joint")
    asked = parser.parse_args()
    found = []
    for k in range(asked.joints):
        name = JOINTS[k % len(JOINTS)]
        z = deviations(name, asked.seed + k)
        found += [v for v in z.values() if math.isfinite(v)]
        print(f"{name} {asked.seed + k}: ", "  ".join(f"{n} {v:+.1f}" for n, v in z.items()), flush=True)
    within = [sum(abs(v) < n for v in found) / len(found) for n in (1, 2, 3)]
    print(f"{len(found)} values: {100 * within[0]:.0f} % within 1 sd, {100 * within[1]:.0f} % within 2, "
          f"{100 * within[2]:.0f} % within 3 (normal: 68, 95, 99.7)")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
