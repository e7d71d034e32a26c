"""The watch of a running joint, in simulated time: what it says once it has learnt what is usual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cablecomp.cli import main
from cablecomp.config import load_joint
from cablecomp.config.options import Remainder
from cablecomp.signals import Estimate, Sample
from cablecomp.watch.live import LiveOptions, LiveWatch

JOINT = Path(__file__).parents[2] / "configs/joints/wrist-capstan.toml"


@pytest.mark.parametrize(
    ("known_rad", "raised"), [(None, True), (4e-4, True), (1e-3, False)], ids=["noise", "less", "as known"]
)
def test_what_the_joint_is_known_to_leave_is_no_mismatch_from_the_start(
    tmp_path: Path, known_rad: float | None, raised: bool
) -> None:
    """A residual of 2 mrad RMS beside 0.02 mrad of noise: a hundred floors, or five or two times what is known."""
    joint = load_joint(JOINT).model_copy(update={"remainder": Remainder(joint_position_rad=known_rad)})
    watch = LiveWatch(joint, 1e-3, tmp_path, LiveOptions(learning_s=4.0), inline=True)
    noise = 2e-5 * np.random.default_rng(0).standard_normal(5_000)
    news = []
    for k, jitter in enumerate(noise):
        t = 1e-3 * k
        angle = 2e-3 * np.sqrt(2.0) * np.sin(2.0 * np.pi * t) + jitter
        sample = Sample(t, 0.0, 0.0, float(angle), temperature_degC=20.0)
        said = watch.take(sample, Estimate(t, 0.0, 0.0, 0.0, 0.0, 0.0, 60.0, 60.0), True)
        news += [said] if said else []
    assert any("since the start" in said for said in news) is raised


@pytest.mark.parametrize("inline", [True, False])
def test_whatever_goes_wrong_in_the_watch_is_news_and_ends_it_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, inline: bool
) -> None:
    watch = LiveWatch(load_joint(JOINT), 1e-3, tmp_path, LiveOptions(block_s=0.01), inline=inline)
    asked = []

    def breaks(state: object, time_s: float, residual_rad: float) -> None:
        asked.append(time_s)
        raise FloatingPointError("out of nowhere")

    monkeypatch.setattr("cablecomp.watch.live.step", breaks)
    estimate = Estimate(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 60.0, 60.0)
    samples = [Sample(1e-3 * k, 0.0, 0.0, 0.0, temperature_degC=20.0) for k in range(500)]
    said = [watch.take(sample, estimate, True) for sample in samples]
    news = [words for words in said if words] + watch.finish()
    assert news == ["the watch is off: FloatingPointError: out of nowhere"]
    assert len(asked) == 1
    assert watch.kept == []


def test_a_watch_that_could_see_nothing_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Impedance mode finds the load from both encoders: no mismatch could ever show."""
    words = ["run", "--config", "wrist-capstan", "--sim", "--fast", "--mode", "impedance", "--live"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 2
    assert "--live: the load is found from both encoders" in " ".join(capsys.readouterr().err.split())
