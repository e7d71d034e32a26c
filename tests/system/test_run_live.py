"""`cablecomp run --live` on the simulated joint: a change in mid-run is raised, located and kept; without one
nothing is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from joints import WRIST_GAINS

from cablecomp.cli.live import LiveRun
from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.config_text import write_joint
from cablecomp.control.options import load_control
from cablecomp.control.standard import reaching_protocol
from cablecomp.effects import with_effects
from cablecomp.links.load import load_link
from cablecomp.recording.reader import read_all
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import SimulationWish
from cablecomp.watch.live import LiveOptions

CONFIGS = Path(__file__).parents[2] / "configs"
JOINT = CONFIGS / "joints/wrist-capstan.toml"
OPTIONS = LiveOptions(between_false_alarms_s=3_600.0, learning_s=4.0, keep_s=6.0, after_s=2.0)
SLIPS_AT_S = 6.3
RATE_HZ = 500.0  # half of what the joint usually runs at: half of the work


def watched_run(out: Path, duration_s: float, slip_m: float = 0.0) -> tuple[RunReport, LiveRun]:
    """A run in stepped time; the simulated joint is exactly as configured, but that a clamp slips in it."""
    joint, control = load_joint(JOINT), load_control(CONFIGS / "control/wrist-capstan.toml")
    options = control.compensator.model_copy(update=WRIST_GAINS)
    link = load_link(CONFIGS / "links/wrist-virtual.toml").model_copy(update={"rate_Hz": RATE_HZ})
    link, control = matched(link, control.model_copy(update={"compensator": options}), own_link=False)
    true = joint
    if slip_m > 0.0:
        true = with_effects(joint, [("clamp_slip", {"slip_m": slip_m, "time_s": SLIPS_AT_S})])
    out.mkdir(exist_ok=True)
    write_joint(out / "true.toml", true)
    simulation = start_simulation(out / "true.toml", SimulationWish(link, control, off_nominal=False, seed=3))
    live = LiveRun(joint, link.rate_Hz, out, lambda loop, tick: None, stepped=True, options=OPTIONS)
    try:
        asked = reaching_protocol(joint, 2, duration_s)
        report = run_joint(
            joint, link, control, asked, RunOptions(duration_s, True, out), simulation, live.watch
        )
    finally:
        simulation.close()
    return live.finish(report), live


@pytest.fixture(scope="module")
def slipped(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunReport, LiveRun]:
    return watched_run(tmp_path_factory.mktemp("slipped"), 11.0, slip_m=2e-5)


def test_a_clamp_that_slips_in_mid_run_is_raised_and_located(slipped: tuple[RunReport, LiveRun]) -> None:
    report, live = slipped
    news = [(t, what) for t, _, what in report.events if what.startswith("mismatch")]
    assert len(live.kept) == 1
    assert len(news) == 2  # raised, then located
    note = json.loads(live.kept[0].with_suffix(".json").read_text())
    began = read_all(live.kept[0]).columns["time_s"][0]
    assert began < note["since_s"] <= note["at_s"]
    assert any(abs(change - SLIPS_AT_S) < 0.1 for change in note["changes_s"])
    assert note["since_s"] == pytest.approx(SLIPS_AT_S, abs=0.3)
    assert note["mismatch"][0]["covariate"] == "time"
    assert note["mismatch"][0]["p_value"] < 0.05


def test_what_was_kept_is_a_stretch_of_the_run_s_own_recording(slipped: tuple[RunReport, LiveRun]) -> None:
    report, live = slipped
    assert report.folder is not None
    kept, whole = (read_all(path).columns for path in (live.kept[0], report.folder / "recording.csv"))
    first = int(np.searchsorted(whole["time_s"], kept["time_s"][0]))
    for name, values in kept.items():
        np.testing.assert_array_equal(values, whole[name][first : first + len(values)])
    span = kept["time_s"][-1] - kept["time_s"][0]
    assert span == pytest.approx(OPTIONS.keep_s, abs=0.2)


def test_a_joint_as_configured_raises_nothing(tmp_path: Path) -> None:
    report, live = watched_run(tmp_path / "run", 11.0)
    assert not live.kept
    assert not [what for _, _, what in report.events if "mismatch" in what]
