"""How often the truth lies within what `cablecomp calibrate` says: simulated joints off their nominal values, each run
through the calibration protocol, calibrated, compared with what the plant was given.

    python tests/golden/calibration_coverage.py --joints 20 [--bench]

Motor, link, bus and sensors are those of the demonstration; with --bench the motor goes where it is told, and a logger
takes 50 samples a second. The plant shares no equation with the observer.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import JointConfig, load_joint, read_toml
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
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.hosted import OFF_NOMINAL, off_nominal
from firmware_sim.plant import PlantConfig, simulate

JOINTS = ("wrist-capstan", "capstan-arm")


def deviations(name: str, seed: int, bench: bool) -> dict[str, float]:
    """Found less true over the stated sd, by parameter; NaN where the calibration says that it does not know."""
    path = example("joints", name)
    joint = load_joint(path)
    data = read_toml(path)
    plant = off_nominal(PlantConfig.from_dict(data, name), data["tolerance"], seed)
    columns = benched(joint, plant, seed) if bench else looped(joint, path, name, seed)
    found = calibrate(joint, {"calibration": columns})
    known = {v.name: v for v in found.values}
    return {
        k: (known[k].value - getattr(plant.stages[0], k)) / known[k].sd if k in known else math.nan
        for k in OFF_NOMINAL
    }


def looped(joint: JointConfig, path: Path, name: str, seed: int) -> dict[str, FloatArray]:
    """The calibration protocol run behind the demonstration's bus, with feed-forward left out."""
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
        return read_all(Path(folder) / "run" / "recording.csv").columns


def benched(joint: JointConfig, plant: PlantConfig, seed: int) -> dict[str, FloatArray]:
    """The calibration protocol's motion at 50 Hz, read with the noise that the joint's file states of its sensors."""
    protocol = calibration_protocol(joint)
    time = np.arange(0.0, protocol.duration_s, 0.02)
    asked = [protocol.reference(float(t)) for t in time]
    motor = np.array([a.joint_position_rad for a in asked]) / joint.drive.ratio
    load = np.array([a.joint_torque_Nm for a in asked])
    seen = simulate(plant, time, motor, load)
    rng = np.random.default_rng(seed)
    noise_rad = joint.sensors.joint_position_noise_rad or 2e-5
    noise_Nm = joint.sensors.joint_torque_noise_Nm or 1e-3 * float(np.max(np.abs(load)))
    return {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_position_rad": seen.joint_position_rad + noise_rad * rng.standard_normal(len(time)),
        "joint_torque_Nm": load + noise_Nm * rng.standard_normal(len(time)),
    }


def main() -> None:
    """Print a line for each joint, then the shares within one and two sd."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--joints", type=int, default=20)
    parser.add_argument("--seed", type=int, default=100, help="of the first joint")
    parser.add_argument("--bench", action="store_true", help="a logger's 50 samples a second, no loop")
    asked = parser.parse_args()
    found = []
    for k in range(asked.joints):
        name = JOINTS[k % len(JOINTS)]
        z = deviations(name, asked.seed + k, asked.bench)
        found += [v for v in z.values() if math.isfinite(v)]
        print(f"{name} {asked.seed + k}: ", "  ".join(f"{n} {v:+.1f}" for n, v in z.items()), flush=True)
    within = [sum(abs(v) < n for v in found) / len(found) for n in (1, 2, 3)]
    print(f"{len(found)} values: {100 * within[0]:.0f} % within 1 sd, {100 * within[1]:.0f} % within 2, "
          f"{100 * within[2]:.0f} % within 3 (normal: 68, 95, 99.7)")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
