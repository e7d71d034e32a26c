"""Confounded trials really coincide, and a proposed experiment can be run on a sealed joint."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from firmware_sim.plant import COARSE, EffectSpec, PlantError
from firmware_sim.plant.records import Floats
from firmware_sim.trials import Wanted, draw_world, generate, run_experiment
from firmware_sim.trials.confounded import CASES
from firmware_sim.trials.experiment import sealed_joint
from firmware_sim.trials.order import order
from firmware_sim.trials.protocol import sample_protocol
from firmware_sim.trials.seal import open_truth
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.suspects import Scene

PROTOCOL = """
schema = 1
name = "more load, faster"
[[segment]]
kind = "ramp"
duration_s = 0.5
load_Nm = 0.05
[[segment]]
kind = "rate_pair"
amplitude = 0.1
rates = [0.2, 1.0]
dwell_s = 0.1
[[segment]]
kind = "angle_sweep"
from_rad = -0.3
to_rad = 0.3
speed_rad_s = 0.5
[[segment]]
kind = "unload"
rate_Nm_s = 0.1
dwell_s = 0.5
"""


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("protocol") / "next.toml"
    path.write_text(PROTOCOL)
    return path


def test_protocol_goes_where_it_says(protocol: Path) -> None:
    time, position, load = sample_protocol(protocol)
    assert np.allclose(np.diff(time), 0.01)
    assert load[50] == pytest.approx(0.05)
    assert load.max() == pytest.approx(0.15)
    assert load.min() == pytest.approx(-0.05)
    assert (position.min(), position.max()) == pytest.approx((-0.3, 0.3))
    assert load[-1] == 0.0
    assert position[-1] == pytest.approx(-0.3)
    assert np.max(np.abs(np.diff(load))) <= 1.0 * 0.01 + 1e-9


def test_experiment_writes_a_recording_and_no_truth(tmp_path: Path, protocol: Path) -> None:
    generate(Wanted(2, ("confounded", "none"), "catalogue", "none"), 2, tmp_path, workers=1)
    sealed = tmp_path / "sealed" / "00000.zip"
    out = run_experiment(sealed, protocol, tmp_path / "experiment.csv.gz")
    with gzip.open(out, "rt") as file:
        names = file.readline().strip().split(",")
        first = float(file.readline().split(",")[0])
    assert names[:4] == ["time_s", "motor_position_rad", "joint_position_rad", "joint_torque_Nm"]
    truth = open_truth(sealed)
    assert first >= truth["recordings"][-1]["ends_s"]
    assert truth["true"]["EA_N"] == sealed_joint(truth).true.stages[0].EA_N
    with pytest.raises(PlantError, match="on confounded ones"):
        run_experiment(tmp_path / "sealed" / "00001.zip", protocol, tmp_path / "x.csv.gz")


@pytest.mark.parametrize(("text", "message"), [("segment = 3", "is no protocol"), ("[[", "is no protocol")])
def test_what_is_no_protocol_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "p.toml"
    path.write_text(text)
    with pytest.raises(PlantError, match=message):
        sample_protocol(path)


@pytest.mark.parametrize("number", range(len(CASES)))
def test_the_other_explanation_fits_a_confounded_recording(number: int) -> None:
    """Some size of the partner leaves less than a tenth of what the true effect does."""
    wanted = Wanted(5, ("confounded",), "catalogue", "none")
    if order(wanted, number).tie.name == "compliance_or_stiffness":
        return  # its partner is the cable's stiffness itself
    trial = draw_world(wanted, number)
    scene = Scene(trial.joint, trial.legs[0].course, trial.plain)
    plain = run_course(scene, (), COARSE).joint_position_rad
    added = run_course(scene, [trial.hidden[0].sized.spec], COARSE).joint_position_rad - plain
    added -= added.mean()
    partners = _partners(trial.partner, scene)
    left = min(_left(scene, trial.partner, start, added, plain) for start in partners)
    assert left < 0.1


def _partners(identifier: str, scene: Scene) -> list[tuple[dict[str, float], str]]:
    """Parameters of the other explanation, and which of them is its size."""
    load = 0.02 * scene.joint.load_Nm
    options: dict[str, list[tuple[dict[str, float], str]]] = {
        "gravity_load": [({"moment_Nm": load, "phase_rad": p}, "moment_Nm") for p in (0.0, np.pi)],
        "inertial_load": [({"inertia_kgm2": 0.2 * load}, "inertia_kgm2")],
        "thermal_pretension": [({"coefficient_per_K": -2e-3, "reference_degC": 20.0}, "coefficient_per_K")],
        "pretension_relaxation": [({"fraction": 5e-3, "time_constant_s": 8.0}, "fraction")],
        "crosstalk": [({"load_coefficient": k * 0.02}, "load_coefficient") for k in (-1.0, 1.0)],
    }
    return options[identifier]


def _left(
    scene: Scene, identifier: str, start: tuple[dict[str, float], str], added: Floats, plain: Floats
) -> float:
    """What is left of `added`, by RMS share, once the other explanation is taken off in its best size."""
    values, size = dict(start[0]), start[1]
    left = 1.0
    for _ in range(6):
        try:
            run = run_course(scene, [EffectSpec(identifier, values)], COARSE)
        except PlantError:
            return left
        other = run.joint_position_rad - plain
        other -= other.mean()
        left = min(left, float(np.linalg.norm(added - other) / np.linalg.norm(added)))
        share = float(other @ added / (other @ other))
        if share <= 0.0:
            return left
        values[size] *= min(share, 10.0)
    return left
