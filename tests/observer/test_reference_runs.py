"""Against an independent finite-element plant: noise-free runs of four joints (tests/data/reference, see its
README)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cablecomp.config import load_joint
from cablecomp.observer import Observer
from cablecomp.recording.reader import read_all

FOLDER = Path(__file__).parents[1] / "data" / "reference"
RUNS = sorted(path.name for path in FOLDER.glob("*.csv.gz"))


@pytest.mark.parametrize("run", RUNS)
def test_the_observer_follows_everywhere(run: str) -> None:
    config = load_joint(FOLDER / f"{run.partition('_')[0]}.toml")
    columns = read_all(FOLDER / run).columns
    found = Observer(config).run(columns)
    stage = config.drive.stage[0]
    deflection = (
        columns["joint_position_rad"]
        - stage.input_radius_m / stage.output_radius_m * columns["motor_position_rad"]
    )
    span = float(np.ptp(deflection))
    assert np.max(np.abs(found["deflection_rad"] - deflection)) < 5e-4 * span
    assert np.max(np.abs(found["tension_h_N"] - columns["tension_h_N"])) < 5e-4 * stage.pretension_N


def test_all_four_runs_are_there() -> None:
    assert len(RUNS) == 4
